import { listenToActions, listenToPanel } from "./side_panel.js";
import { listenToPalette } from "./palette.js";
import { listenToRobots } from "./robot_list.js";
import { markRobots } from "./robot_marks.js";
import { byId, onBeat, setText, typing } from "../web/tools/elements.js";
import { endOf } from "../web/tools/overlay.js";
import { foldTools, keepInView, keepSizes, listenToList, listenToTools } from "./view_tools.js";

/**
 * The parts of the console that run in the browser, because they must be quick or work
 * while the display cannot be reached: the state of the connection, which robots are
 * "yours", the buttons of the view and of the card, the search, the sheet on a phone,
 * help.
 */

/** @typedef {import('../web/drive.js').Drive} Drive */
/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */
/** @typedef {{title: string, bounds: [number, number, number, number] | null}} Options */

/**
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {(message: Record<string, unknown>) => void} send
 */
export default function attach(map, options, send) {
  const ending = new AbortController();
  const { signal } = ending;
  document.title = options.title;
  const offs = [
    keepSizes(map),
    showConnection(map.drive),
    listenToActions(map, send, signal),
    nameSheet(map),
    markRobots(map),
    listenToRobots(map, signal),
    listenToHelp(map.drive, signal),
    listenToPalette(map.drive, signal),
    listenToPanel(map, signal),
  ];
  listenToTools(map, options, signal);
  listenToList(map, signal);
  keepInView(map, signal);
  listenToSheet(signal);
  foldTools(signal);
  return { destroy: endOf(() => ending.abort(), ...offs) };
}

/**
 * Show whether commands would arrive, and which robots are "yours". The round trip
 * depends on the robot too, so the driving panel shows it.
 *
 * @param {Drive} drive
 */
function showConnection(drive) {
  const link = byId("link");
  const show = () => {
    if (link.dataset.link !== drive.state) link.dataset.link = drive.state;
  };
  /** @type {Map<string, boolean>} */
  const known = new Map();
  const hear = (/** @type {{robot: string, mine?: boolean}} */ { robot, mine = false }) => {
    // All elements of the page are searched only if something is new.
    if ((known.get(robot) ?? false) !== mine) mark();
    known.set(robot, mine);
  };
  const mark = () => {
    for (const element of document.querySelectorAll("[data-robot]")) {
      if (!(element instanceof HTMLElement)) continue;
      const mine = drive.robots.get(element.dataset.robot ?? "")?.mine ?? false;
      element.toggleAttribute("data-mine", mine);
    }
  };
  const look = () => {
    show();
    mark();
    count();
  };
  look();
  return endOf(onBeat(look, 2), drive.on("state", show), drive.on("robot", hear));
}

/**
 * Open and close the sheet on a narrow screen.
 *
 * @param {AbortSignal} signal
 */
function listenToSheet(signal) {
  const handle = byId("sheet");
  const turn = () => {
    const open = handle.getAttribute("aria-expanded") === "true";
    handle.setAttribute("aria-expanded", `${!open}`);
  };
  handle.addEventListener("click", turn, { signal });
}

/**
 * Show the selected robots on the sheet's handle, for a closed sheet.
 *
 * @param {MapCanvas} map
 */
function nameSheet(map) {
  const text = byId("sheet-text");
  const show = () => {
    const row = `#robots [data-robot="${map.selected}"]`;
    const name = document.querySelector(`${row} .name`)?.textContent;
    const states = [...document.querySelectorAll(`${row} .state > *`)]
      .filter((one) => getComputedStyle(one).display !== "none")
      .map((one) => one.textContent?.replace(/^ \u00b7 /, ""));
    const robots = byId("robots-count").textContent ?? "";
    setText(text, name ? `${name}: ${states.join(" \u00b7 ")}` : robots);
  };
  show();
  return endOf(onBeat(show, 2), map.onSelect(show));
}

/** Show the number of robots, of those that need someone, and of stale data. */
function count() {
  const number = (/** @type {string} */ path) =>
    document.querySelectorAll(`#robots > .row${path}`).length;
  const [rows, needed, old] = [number(""), number("[data-need]"), number(" .age.stale")];
  const robots = rows === 1 ? "1 robot" : `${rows} robots`;
  const needs = needed > 0 ? `, ${needed} ${needed === 1 ? "needs" : "need"} someone` : "";
  const stale = old > 0 ? `, ${old} with stale data` : "";
  setText(byId("robots-count"), `${robots}${needs}${stale}`);
}

/**
 * Help opens beside STOP and is not a modal dialog, because a modal dialog would block
 * clicks on STOP. While help is open no input moves a robot (`data-hands-off`), because
 * help covers the operator's view. Esc closes help, unless this page is driving: then
 * Esc is STOP.
 *
 * @param {Drive} drive
 * @param {AbortSignal} signal
 */
function listenToHelp(drive, signal) {
  const help = /** @type {HTMLDialogElement} */ (byId("help"));
  const turn = () => {
    if (help.open) help.close();
    else {
      drive.goNeutral();
      help.show();
      byId("help-open").setAttribute("aria-expanded", "true");
    }
  };
  const closed = () => {
    byId("help-open").setAttribute("aria-expanded", "false");
    // The event comes late on a busy page: the operator may be typing elsewhere.
    if (document.activeElement === document.body) byId("help-open").focus();
  };
  help.addEventListener("close", closed, { signal });
  byId("help-open").addEventListener("click", turn, { signal });
  byId("help-close").addEventListener("click", turn, { signal });
  const outside = (/** @type {PointerEvent} */ { target }) => {
    const map = target instanceof Element && target.closest("svg.webmap");
    if (help.open && map) turn();
  };
  document.addEventListener("pointerdown", outside, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "?" || typing(event)) return;
    event.preventDefault();
    turn();
  };
  document.addEventListener("keydown", key, { signal });
  return drive.on("stop", () => {
    if (help.open) turn();
  });
}
