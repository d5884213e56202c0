import { byId } from "./dom.js";

/** @typedef {import('./console.js').Matrix} Matrix */
/** @typedef {import('./console.js').MapCanvas} MapCanvas */
/** @typedef {import('./console.js').Options} Options */

/** What a press of a zoom button zooms by. */
const STEP = 1.5;

/** The least space around what is shown as a whole, in pixels. */
const MARGIN = 24;

/**
 * Let map.css draw names and marks in pixels at every zoom, and upright at every turn.
 *
 * @param {MapCanvas} map
 */
export function keepSizes(map) {
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
 * The buttons of the view, which the browser owns.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {AbortSignal} signal
 */
export function listenToTools(map, options, signal) {
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
 * @returns {Matrix} The view, zoomed about the robot that is followed, or its middle.
 */
function zoom(map, factor) {
  const { view } = map;
  const [x, y] = (map.following && placeOfSelected(map)) || [
    map.width / 2,
    map.height / 2,
  ];
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
 * @param {MapCanvas} map
 * @returns {[number, number] | null} Where the selected robot is, in the map's pixels.
 */
function placeOfSelected({ world }) {
  const robot = world.querySelector(".robot.selected");
  if (!(robot instanceof SVGGraphicsElement)) return null;
  const matrix = robot.getCTM();
  return matrix && [matrix.e, matrix.f];
}
