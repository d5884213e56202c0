/**
 * What of the console acts in the browser itself, because it must be quick, or work
 * while the display cannot be reached: the state of the connection, who "you" are, the
 * buttons of the view and of the card, the search, the sheet on a phone, help.
 *
 * @typedef {{a: number, b: number, c: number, d: number, e: number, f: number}} Matrix
 *
 * @typedef {object} Report
 * @property {string} robot
 * @property {boolean} mine
 *
 * @typedef {object} Drive
 * @property {string} state
 * @property {{delay: number | null}} status
 * @property {ReadonlyMap<string, Report>} robots
 * @property {(kind: string, fn: () => void) => () => void} on
 * @property {(robot: string) => void} cancel
 * @property {(robot: string) => void} release
 *
 * @typedef {object} MapCanvas
 * @property {SVGSVGElement} svg
 * @property {SVGGElement} world
 * @property {Matrix} view
 * @property {number} width
 * @property {number} height
 * @property {string | null} selected
 * @property {number} following
 * @property {(id: number) => void} follow
 * @property {Drive} drive
 * @property {(view: Matrix, options?: {user?: boolean}) => void} setView
 * @property {(fn: () => void) => () => void} onView
 * @property {(fn: () => void) => () => void} onSelect
 *
 * @typedef {{title: string, bounds: [number, number, number, number] | null}} Options
 */

/** What a press of a zoom button zooms by. */
const STEP = 1.5;

/** The least space around what is shown as a whole, in pixels. */
const MARGIN = 24;

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
  ];
  listenToTools(map, options, signal);
  listenToSearch(signal);
  listenToSheet(signal);
  listenToHelp(signal);
  return {
    destroy() {
      ending.abort();
      for (const off of offs) off();
    },
  };
}

/**
 * Let map.css draw names and marks in pixels at every zoom, and upright at every turn.
 *
 * @param {MapCanvas} map
 */
function keepSizes(map) {
  let shown = "";
  const keep = () => {
    const { a, b, c, d } = map.view;
    const size = (1 / Math.sqrt(Math.abs(a * d - b * c))).toPrecision(4);
    const turn = Math.atan2(b, a).toFixed(4);
    if (shown === size + turn) return;
    shown = size + turn;
    map.svg.style.setProperty("--metre-per-pixel", size);
    map.svg.style.setProperty("--turn", `${turn}rad`);
  };
  keep();
  return map.onView(keep);
}

/**
 * Say whether commands would arrive, how long they take, and which robots are "yours".
 *
 * @param {Drive} drive
 */
function showConnection(drive) {
  const link = byId("link");
  const delay = byId("delay");
  const show = () => {
    link.dataset.link = drive.state;
    const { delay: ms } = drive.status;
    say(delay, drive.state === "open" && ms !== null ? `${Math.round(ms)} ms` : "");
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

/** Say how many robots there are, and of how many the data is old. */
function count() {
  const rows = document.querySelectorAll("#robots > .row").length;
  const old = document.querySelectorAll("#robots > .row .age.stale").length;
  const robots = rows === 1 ? "1 robot" : `${rows} robots`;
  say(byId("robots-count"), old > 0 ? `${robots}, ${old} with old data` : robots);
}

/**
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {AbortSignal} signal
 */
function listenToTools(map, options, signal) {
  const on = (/** @type {string} */ id, /** @type {() => Matrix | null} */ change) => {
    const act = () => {
      const view = change();
      if (view) map.setView(view, { user: true });
    };
    byId(id).addEventListener("click", act, { signal });
  };
  on("zoom-in", () => zoom(map, STEP));
  on("zoom-out", () => zoom(map, 1 / STEP));
  on("show-all", () => showAll(map, options.bounds));
}

/**
 * @param {MapCanvas} map
 * @param {number} factor
 * @returns {Matrix} The view, zoomed about its middle.
 */
function zoom({ view, width, height }, factor) {
  const [x, y] = [width / 2, height / 2];
  return {
    a: view.a * factor,
    b: view.b * factor,
    c: view.c * factor,
    d: view.d * factor,
    e: (view.e - x) * factor + x,
    f: (view.f - y) * factor + y,
  };
}

/**
 * @param {MapCanvas} map
 * @param {[number, number, number, number] | null} bounds
 * @returns {Matrix | null} The view of the floor, or of all that is drawn, north up;
 *     null if there is nothing yet.
 */
function showAll({ world, width, height }, bounds) {
  const box = world.getBBox();
  const [x, y, across, up] = bounds ?? [box.x, box.y, box.width, box.height];
  const room = [width - 2 * MARGIN, height - 2 * MARGIN];
  const scale = Math.min(room[0] / across, room[1] / up);
  if (!(scale > 0) || !Number.isFinite(scale)) return null;
  const e = width / 2 - scale * (x + across / 2);
  const f = height / 2 + scale * (y + up / 2);
  return { a: scale, b: 0, c: 0, d: -scale, e, f };
}

/**
 * The buttons of the card that act at once. Nothing here moves a robot.
 *
 * @param {MapCanvas} map
 * @param {(message: Record<string, unknown>) => void} send
 * @param {AbortSignal} signal
 */
function listenToActions(map, send, signal) {
  const show = () => {
    const button = document.querySelector("[data-act=follow]");
    const pressed = `${map.following !== 0}`;
    if (button?.getAttribute("aria-pressed") === pressed) return;
    button?.setAttribute("aria-pressed", pressed);
  };
  const act = (/** @type {MouseEvent} */ event) => {
    if (!(event.target instanceof Element) || map.selected === null) return;
    const button = event.target.closest("[data-act]");
    if (!(button instanceof HTMLElement)) return;
    if (button.dataset.act === "cancel") map.drive.cancel(map.selected);
    if (button.dataset.act === "release") map.drive.release(map.selected);
    if (button.dataset.act !== "follow") return;
    if (map.following) map.follow(0);
    else send({ op: "follow" });
    show();
  };
  byId("card").addEventListener("click", act, { signal });
  const timer = setInterval(show, 250);
  const offs = [
    map.onView(show),
    map.onSelect(() => {
      if (map.following) map.follow(0);
      show();
    }),
  ];
  return () => {
    clearInterval(timer);
    for (const off of offs) off();
  };
}

/**
 * Hide the robots whose name does not have what was typed in it.
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
  };
  input.addEventListener("input", filter, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "/" || event.ctrlKey || event.metaKey || typing(event)) return;
    event.preventDefault();
    input.focus();
  };
  document.addEventListener("keydown", key, { signal });
}

/**
 * The sheet on a narrow screen.
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
 * Say on the sheet's handle what is selected, for when it is closed.
 *
 * @param {MapCanvas} map
 */
function nameSheet(map) {
  const text = byId("sheet-text");
  const show = () => {
    const row = document.querySelector(`#robots [data-robot="${map.selected}"]`);
    const name = row?.querySelector(".name")?.textContent;
    say(text, name ?? byId("robots-count").textContent ?? "");
  };
  show();
  const timer = setInterval(show, 500);
  const off = map.onSelect(show);
  return () => {
    clearInterval(timer);
    off();
  };
}

/** @param {AbortSignal} signal */
function listenToHelp(signal) {
  const help = /** @type {HTMLDialogElement} */ (byId("help"));
  byId("help-open").addEventListener("click", () => help.showModal(), { signal });
  byId("help-close").addEventListener("click", () => help.close(), { signal });
  const outside = (/** @type {MouseEvent} */ event) => {
    if (event.target === help) help.close();
  };
  help.addEventListener("click", outside, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "?" || typing(event)) return;
    event.preventDefault();
    if (help.open) help.close();
    else help.showModal();
  };
  document.addEventListener("keydown", key, { signal });
}

/** @param {KeyboardEvent} event */
function typing({ target }) {
  return target instanceof Element && target.matches("input, textarea, select");
}

/** @param {string} id */
function byId(id) {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`console.html has no element "${id}".`);
  return element;
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

/**
 * @param {Element} element
 * @param {string} text
 */
function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
