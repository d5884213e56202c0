import { byId } from "./dom.js";

/** @typedef {import('./console.js').Matrix} Matrix */
/** @typedef {import('./console.js').MapCanvas} MapCanvas */
/** @typedef {import('./console.js').Options} Options */

/** What a press of a zoom button zooms by. */
const STEP = 1.5;

/** The least space around what is shown as a whole, in pixels. */
const MARGIN = 24;

/** The room that a robot gets to each side, in metres. */
const AROUND = 1;

/** A place and a size in metres: x, y, to the right, up. */
/** @typedef {[number, number, number, number]} Box */

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
  // Before the module that moves the view, which knows no floor.
  map.svg.addEventListener(
    "keydown",
    (event) => {
      if (event.key !== "0" || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      byId("show-all").click();
    },
    { signal, capture: true },
  );
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
 * @param {Box | null} bounds
 * @returns {Matrix | null} The view of the floor and of every robot, or of all that is
 *     drawn where there is no floor, north up; null if there is nothing yet.
 */
function showAll({ svg, world, width, height }, bounds) {
  const box = world.getBBox();
  const free = besideCard(svg, width);
  const all = bounds ?? [box.x, box.y, box.width, box.height];
  const [x, y, across, up] = placesOfRobots(world).reduce(withPlace, all);
  const room = [free - 2 * MARGIN, height - 2 * MARGIN];
  const scale = Math.min(room[0] / across, room[1] / up);
  if (!(scale > 0) || !Number.isFinite(scale)) return null;
  const e = free / 2 - scale * (x + across / 2);
  const f = height / 2 + scale * (y + up / 2);
  return { a: scale, b: 0, c: 0, d: -scale, e, f };
}

/**
 * @param {SVGSVGElement} svg
 * @param {number} width
 * @returns {number} How much of the map's width the card leaves, in pixels; all of it
 *     where little would be left, as on a phone, whose card lies in the sheet.
 */
function besideCard(svg, width) {
  const card = byId("card").getBoundingClientRect();
  const left = card.left - svg.getBoundingClientRect().left;
  return card.width > 0 && left > width / 2 && left < width ? left : width;
}

/**
 * @param {Box} box
 * @param {[number, number]} place
 * @returns {Box} The box, and the place with room around it.
 */
function withPlace([x, y, across, up], [px, py]) {
  const left = Math.min(x, px - AROUND);
  const low = Math.min(y, py - AROUND);
  const right = Math.max(x + across, px + AROUND);
  const top = Math.max(y + up, py + AROUND);
  return [left, low, right - left, top - low];
}

/**
 * @param {SVGGElement} world
 * @returns {[number, number][]} Where the robots are, in metres.
 */
function placesOfRobots(world) {
  const toWorld = world.getScreenCTM()?.inverse();
  if (!toWorld) return [];
  return [...world.querySelectorAll(".robot:not(.unplaced)")].flatMap((robot) => {
    const place = robot instanceof SVGGraphicsElement && robot.getScreenCTM();
    if (!place) return [];
    const { e, f } = toWorld.multiply(place);
    return Number.isFinite(e + f) ? [/** @type {[number, number]} */ ([e, f])] : [];
  });
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
