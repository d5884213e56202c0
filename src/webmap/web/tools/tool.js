/** The frame of a tool: its button, its body, and the note about a refusal. */

import { RefusalNote } from "../motion/report.js";
import { button, html, svg, setText } from "./elements.js";

/** Symbols of tools, as SVG paths in a square of 24. */
const SYMBOLS = {
  alerts: "M6 17v-6a6 6 0 0 1 12 0v6l2 2H4zM10 22h4M12 5V3",
  align: "M4 8h9v9H4zM11 4h9v9h-4M8 12.5h.1",
  area: "M5 6l9-2 6 6-4 9-11-1z",
  goal: "M6 21V4h11l-2.5 4L17 12H6",
  label: "M4 4h8l8.5 8.5-8 8L4 12zM8 8h.1",
  layers: "M12 3.5l9 5-9 5-9-5zM4 13l8 4.5 8-4.5",
  log: "M4 5h16M4 10h16M4 15h10M4 20h7",
  measure: "M3 15.5L15.5 3 21 8.5 8.5 21zM7 11.5l2 2M10.5 8l2 2M14 4.5l2 2",
  route: "M6 19.5a2.5 2.5 0 1 0 .01 0zM6 17h8a3.5 3.5 0 0 0 0-7h-4a3.5 3.5 0 0 1 0-7h8",
  shift: "M9 3.5h6v3.5H9zM9 5H5v16h14V5h-4M8.5 11.5h7M8.5 16h5",
};

/** @typedef {keyof typeof SYMBOLS} Symbol */

/**
 * The content of a tool's button: a symbol and the name. A page with little room may
 * hide the name with CSS; screen readers still read it.
 *
 * @param {Symbol} symbol
 * @param {string} name
 * @returns {Node[]}
 */
export function toolName(symbol, name) {
  const icon = svg(
    "svg",
    { class: "webmap-symbol webmap-tool-icon", viewBox: "0 0 24 24", "aria-hidden": "true" },
    svg("path", { d: SYMBOLS[symbol] }),
  );
  return [icon, html("span", "webmap-tool-name", {}, name)];
}

/**
 * A tool: its button, and a body with everything that it shows while it is used. Every
 * page decides with CSS where the body is.
 *
 * @param {string} className
 * @param {string} label What the tool is for, for screen readers.
 * @param {HTMLElement} go The button that begins and ends the tool.
 * @param {...Node} content
 */
export function tool(className, label, go, ...content) {
  go.classList.add("webmap-tool-go");
  return html(
    "section",
    `webmap-panel webmap-tool ${className}`,
    { "aria-label": label },
    go,
    html("div", "webmap-tool-body", {}, ...content),
  );
}

/**
 * A tool that is a list or a form: the button opens and closes the body.
 *
 * @param {string} className
 * @param {Symbol} symbol
 * @param {string} name
 * @param {Record<string, string>} attributes
 * @param {...Node} content
 */
export function foldedTool(className, symbol, name, attributes, ...content) {
  const close = button("webmap-tool-close", "×", () => {
    details.open = false;
    summary.focus();
  });
  close.setAttribute("aria-label", `Close ${name}`);
  const head = html("p", "webmap-tool-head", {}, html("strong", "", {}, name), close);
  const summary = html("summary", "webmap-tool-go", { title: name }, ...toolName(symbol, name));
  const body = html("div", "webmap-tool-body", {}, head, ...content);
  const details = html(
    "details",
    `webmap-panel webmap-tool ${className}`,
    attributes,
    summary,
    body,
  );
  return details;
}

/**
 * Note that presses on a map belong to a tool, or no longer do. Meanwhile the pointer is a
 * cross, and a press selects no robots.
 *
 * @param {SVGSVGElement} svg The map's.
 * @param {string} name The tool's.
 * @param {boolean} on
 */
export function claimPresses({ dataset }, name, on) {
  const tools = new Set(dataset.webmapPress?.split(" "));
  if (on) tools.add(name);
  else tools.delete(name);
  if (tools.size > 0) dataset.webmapPress = [...tools].join(" ");
  else delete dataset.webmapPress;
}

/**
 * Make the drawing of a tool over the whole map.
 *
 * @param {string} className
 * @param {...SVGElement} parts
 */
export function toolDrawing(className, ...parts) {
  return svg("svg", { class: className, "aria-hidden": "true" }, ...parts);
}

/**
 * Show in an element why an operation was refused, until the causes of all robots are over.
 *
 * @param {Element} element
 * @param {string} text
 * @param {import('../drive.js').Drive} drive
 * @param {readonly string[]} robots
 */
export function showNote(element, text, drive, robots) {
  const notes = robots.map((robot) => ({ robot, note: new RefusalNote(text, "", performance.now()) }));
  setText(element, text);
  const off = drive.on("step", () => {
    const now = performance.now();
    const over = notes.filter(({ robot, note }) => note.isOver(drive.robots.get(robot), now));
    const replaced = element.textContent !== text;
    if (!replaced && over.length < notes.length) return;
    if (!replaced) setText(element, "");
    off();
  });
}
