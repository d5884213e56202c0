import { listenToActions } from "./card_actions.js";
import { listenToPalette } from "./palette.js";
import { listenToPanel } from "./side_panel.js";
import { byId, listenToSheet, nameSheet, setText, typing } from "../web/tools/dom.js";
import { keepInView, keepSizes, listenToList, listenToTools } from "./view_tools.js";

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
    spreadNames(map),
    listenToHelp(map.drive, signal),
    listenToPalette(map.drive, signal),
    listenToPanel(map, signal),
    keepInView(map),
  ];
  listenToTools(map, options, signal);
  listenToSearch(signal);
  listenToList(map, signal);
  listenToSheet(signal);
  return {
    destroy() {
      ending.abort();
      for (const off of offs) off();
    },
  };
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
    link.dataset.link = drive.state;
  };
  const mark = () => {
    for (const element of document.querySelectorAll("[data-robot]")) {
      if (!(element instanceof HTMLElement)) continue;
      const mine = drive.robots.get(element.dataset.robot ?? "")?.mine ?? false;
      if (mine !== "mine" in element.dataset) toggle(element, "mine", mine);
    }
  };
  const look = () => {
    show();
    mark();
    count();
  };
  look();
  const timer = setInterval(look, 500);
  const offs = [drive.on("state", show), drive.on("robot", mark)];
  return () => {
    clearInterval(timer);
    for (const off of offs) off();
  };
}

/** Show the number of robots, and of robots with stale data. */
function count() {
  const rows = document.querySelectorAll("#robots > .row").length;
  const old = document.querySelectorAll("#robots > .row .age.stale").length;
  const robots = rows === 1 ? "1 robot" : `${rows} robots`;
  setText(byId("robots-count"), old > 0 ? `${robots}, ${old} with stale data` : robots);
}

/**
 * @param {HTMLElement} element
 * @param {string} name
 * @param {boolean} on
 */
function toggle(element, name, on) {
  if (on) element.dataset[name] = "";
  else delete element.dataset[name];
}

/** Milliseconds between two checks which names have room. */
const PERIOD = 300;

/**
 * Size of a name on the screen, in pixels: about the width of a letter, and the height
 * of a line.
 */
const LETTER = 8;
const LINE = 18;

/** With more visible robots than this, only the selected robot has its name. */
const MOST = 150;

/**
 * A name on the screen: its middle and its size, in pixels.
 *
 * @typedef {object} Name
 * @property {number} x
 * @property {number} y
 * @property {number} width
 * @property {boolean} first Whether this name takes priority over the others.
 */

/**
 * Return which names can be shown without covering one another.
 *
 * @param {Name[]} names
 * @returns {boolean[]} For each name, whether there is room.
 */
export function roomFor(names) {
  const order = names.map((_, index) => index);
  order.sort((a, b) => Number(names[b].first) - Number(names[a].first) || a - b);
  const shown = names.map(() => false);
  /** @type {Name[]} */
  const placed = [];
  for (const index of order) {
    const name = names[index];
    const free = placed.every(
      (other) =>
        Math.abs(other.y - name.y) >= LINE ||
        Math.abs(other.x - name.x) >= (other.width + name.width) / 2,
    );
    if (!free && !name.first) continue;
    shown[index] = true;
    placed.push(name);
  }
  return shown;
}

/**
 * Keep the robots' names on the map from covering one another.
 *
 * @param {MapCanvas} map
 * @returns {() => void} Ends the updates.
 */
function spreadNames(map) {
  const spread = () => {
    const robots = [...map.world.querySelectorAll(".robot:not(.unplaced)")];
    const names = robots.map((robot) => nameOf(map, robot));
    const shown =
      robots.length > MOST ? names.map(({ first }) => first) : roomFor(names);
    robots.forEach((robot, index) => {
      if (robot.classList.contains("nameless") !== shown[index]) return;
      robot.classList.toggle("nameless", !shown[index]);
    });
  };
  const timer = setInterval(spread, PERIOD);
  const off = map.onSelect(spread);
  spread();
  return () => {
    clearInterval(timer);
    off();
  };
}

/**
 * @param {MapCanvas} map
 * @param {Element} robot
 * @returns {Name}
 */
function nameOf({ view, selected }, robot) {
  const list = robot instanceof SVGGraphicsElement ? robot.transform.baseVal : null;
  const { e: x, f: y } = list?.numberOfItems ? list.getItem(0).matrix : { e: 0, f: 0 };
  return {
    x: view.a * x + view.c * y + view.e,
    y: view.b * x + view.d * y + view.f,
    width: (robot.getAttribute("data-name")?.length ?? 0) * LETTER,
    first: robot.getAttribute("data-robot") === selected,
  };
}

/**
 * Hide the robots whose name does not contain the search text. Enter selects the robot
 * if only one is left.
 *
 * @param {AbortSignal} signal
 */
function listenToSearch(signal) {
  const input = /** @type {HTMLInputElement} */ (byId("search"));
  const filter = () => {
    const wanted = input.value.trim().toLowerCase();
    for (const row of document.querySelectorAll("#robots > .row")) {
      const name = row.querySelector(".name")?.textContent?.toLowerCase() ?? "";
      row.classList.toggle("filtered", !name.includes(wanted));
    }
    const found = hits().length;
    byId("select-shown").hidden = wanted === "" || found < 2;
    const none = wanted !== "" && found === 0;
    setText(byId("not-found"), none ? `No robot has “${input.value.trim()}” in its name.` : "");
  };
  input.addEventListener("input", filter, { signal });
  const newcomers = new MutationObserver(filter);
  newcomers.observe(byId("robots"), { childList: true });
  signal.addEventListener("abort", () => newcomers.disconnect());
  const choose = (/** @type {KeyboardEvent} */ event) => {
    const [only, ...more] = event.key === "Enter" ? hits() : [];
    if (only && more.length === 0) only.click();
  };
  input.addEventListener("keydown", choose, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "/" || event.ctrlKey || event.metaKey || typing(event)) return;
    event.preventDefault();
    input.focus();
  };
  document.addEventListener("keydown", key, { signal });
}

/** @returns {HTMLElement[]} The buttons that select the listed robots. */
function hits() {
  return [...document.querySelectorAll("#robots > .row:not(.filtered) [aria-pressed]")].filter(
    (button) => button instanceof HTMLElement,
  );
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
    byId("help-open").focus();
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
