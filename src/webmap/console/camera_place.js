/**
 * Where the camera's panel is, and what of it is kept in the browser.
 *
 * @typedef {'side' | 'below' | 'float'} Dock
 *
 * @typedef {object} Kept
 * @property {boolean} open
 * @property {Dock} dock
 * @property {string} camera The name of the camera that was chosen last.
 * @property {number} x Where it floats: parts of the free room, from 0 to 1.
 * @property {number} y
 */

export const DOCKS = /** @type {const} */ (["side", "below", "float"]);

/** Where it is until somebody puts it elsewhere. */
export const FOUND = { dock: /** @type {const} */ ("side"), x: 0, y: 0 };

const KEY = "webmap.camera";

/** @returns {Kept} What was kept, or what is meant without it. */
export function readKept() {
  /** @type {any} */
  let said = null;
  try {
    said = JSON.parse(localStorage.getItem(KEY) ?? "null");
  } catch {
    // Not ours, or there is no storage: begin anew.
  }
  const part = (/** @type {unknown} */ value, /** @type {number} */ otherwise) =>
    typeof value === "number" && value >= 0 && value <= 1 ? value : otherwise;
  return {
    open: said?.open === true,
    dock: DOCKS.includes(said?.dock) ? said.dock : "side",
    camera: typeof said?.camera === "string" ? said.camera : "",
    x: part(said?.x, 0),
    y: part(said?.y, 0),
  };
}

/** @param {Kept} kept */
export function keep(kept) {
  try {
    localStorage.setItem(KEY, JSON.stringify(kept));
  } catch {
    // Without storage it is as before after a reload.
  }
}

/**
 * Return the corner that comes after the one that is nearest, clockwise.
 *
 * @param {number} x
 * @param {number} y
 */
export function nextCorner(x, y) {
  if (y < 0.5) return x < 0.5 ? { x: 1, y: 0 } : { x: 1, y: 1 };
  return x < 0.5 ? { x: 0, y: 0 } : { x: 0, y: 1 };
}

/** Pixels that what floats stays away from other things, and from the map's top. */
const GAP = 12;
const TOOLS = 72;

/**
 * Return the free room for the top left corner of what floats over a map, between all
 * other things that are there.
 *
 * @param {Element} floating
 * @param {Element} over
 */
export function roomFor(floating, over) {
  const map = over.getBoundingClientRect();
  const { width, height } = floating.getBoundingClientRect();
  const tools = rectangle(".map-tools");
  const card = rectangle("#card");
  const teleop = rectangle(".webmap-teleop");
  const middle = (map.left + map.right) / 2;
  const left = Math.max(map.left, tools.left < middle ? tools.right : 0) + GAP;
  const ends = [card, tools].map((thing) => (thing.left > middle ? thing.left : Infinity));
  const right = Math.min(map.right, ...ends) - GAP;
  const top = map.top + TOOLS;
  const bottom = Math.min(map.bottom, teleop.top > top ? teleop.top : Infinity) - GAP;
  return {
    left,
    top,
    width: Math.max(0, right - left - width),
    height: Math.max(0, bottom - top - height),
  };
}

/**
 * @param {string} selector
 * @returns {{left: number, top: number, right: number}} Nowhere if it is not shown.
 */
function rectangle(selector) {
  const element = document.querySelector(selector);
  const found = element?.getBoundingClientRect();
  if (!found || found.width === 0) return { left: Infinity, top: Infinity, right: 0 };
  return found;
}

/**
 * Let an element be dragged within the room that there is for it.
 *
 * @param {HTMLElement} handle What is dragged by.
 * @param {() => boolean} wanted Whether it can be dragged now.
 * @param {() => {left: number, top: number, width: number, height: number}} room For
 *     its top left corner, in pixels.
 * @param {() => {left: number, top: number}} place Where that is now.
 * @param {(x: number, y: number) => void} move Takes parts of the room.
 * @param {AbortSignal} signal
 */
export function listenToDrags(handle, wanted, room, place, move, signal) {
  /** @type {{id: number, dx: number, dy: number} | null} */
  let drag = null;
  const on = (
    /** @type {'pointerdown' | 'pointermove' | 'pointerup' | 'pointercancel'} */ kind,
    /** @type {(event: PointerEvent) => void} */ fn,
  ) => handle.addEventListener(kind, fn, { signal });
  on("pointerdown", (event) => {
    if (!wanted() || !event.isPrimary) return;
    if (event.target instanceof Element && event.target.closest("button")) return;
    const { left, top } = place();
    drag = { id: event.pointerId, dx: event.clientX - left, dy: event.clientY - top };
    handle.setPointerCapture(event.pointerId);
  });
  on("pointermove", (event) => {
    if (drag?.id !== event.pointerId) return;
    const { left, top, width, height } = room();
    const part = (/** @type {number} */ value, /** @type {number} */ size) =>
      size > 0 ? Math.min(1, Math.max(0, value / size)) : 0;
    move(
      part(event.clientX - drag.dx - left, width),
      part(event.clientY - drag.dy - top, height),
    );
  });
  const end = () => (drag = null);
  on("pointerup", end);
  on("pointercancel", end);
}
