import { byId } from "../web/tools/dom.js";

/** @typedef {import('../web/view.js').Matrix} Matrix */
/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */
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
      if (view) map.setView(view);
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

/** @typedef {[number, number]} Point In pixels of the window. */

/** How much around a robot has to be free, in pixels. */
const CLEAR = 48;

/** Between two places where a robot may be brought, in pixels, at least. */
const APART = 32;

/** How many places are looked at, about. */
const PLACES = 600;

/** For how long the card of a robot may take to appear, in milliseconds. */
const PATIENCE = 1500;

/**
 * Move the map so that a robot that is selected in the list lies where nothing covers the
 * map.
 *
 * @param {MapCanvas} map
 * @param {AbortSignal} signal
 */
export function listenToList(map, signal) {
  const chosen = (/** @type {MouseEvent} */ { target }) => {
    const button = target instanceof Element && target.closest("[aria-pressed]");
    const robot = button && button.closest(".row")?.getAttribute("data-robot");
    if (robot) waitForCard(map, robot, performance.now() + PATIENCE, signal);
  };
  byId("robots").addEventListener("click", chosen, { signal });
}

/**
 * @param {MapCanvas} map
 * @param {string} robot
 * @param {number} until
 * @param {AbortSignal} signal
 */
function waitForCard(map, robot, until, signal) {
  const card = byId("card");
  if (signal.aborted) return;
  if (card.dataset.robot === robot && !card.hidden && map.selected === robot) {
    show(map, robot);
  } else if (performance.now() < until) {
    requestAnimationFrame(() => waitForCard(map, robot, until, signal));
  }
}

/**
 * @param {MapCanvas} map
 * @param {string} robot
 */
function show(map, robot) {
  const element = map.world.querySelector(
    `.robot:not(.unplaced)[data-robot="${CSS.escape(robot)}"]`,
  );
  const place = element instanceof SVGGraphicsElement ? element.getScreenCTM() : null;
  if (!place || map.following || isFree(map, [place.e, place.f])) return;
  const free = nearest(map);
  if (!free) return;
  const [x, y] = free;
  const { view } = map;
  const moved = { ...view, e: view.e + x - place.e, f: view.f + y - place.f };
  map.setView(moved);
}

/**
 * @param {MapCanvas} map
 * @returns {Point | undefined} Where nothing covers the map, as near to its middle as
 *     may be.
 */
function nearest({ svg }) {
  const { left, top, width, height } = svg.getBoundingClientRect();
  const middle = /** @type {Point} */ ([left + width / 2, top + height / 2]);
  /** @type {Point[]} */
  const places = [];
  const step = Math.max(APART, Math.sqrt((width * height) / PLACES));
  for (let x = left + CLEAR; x < left + width; x += step) {
    for (let y = top + CLEAR; y < top + height; y += step) places.push([x, y]);
  }
  const far = (/** @type {Point} */ [x, y]) => Math.hypot(x - middle[0], y - middle[1]);
  places.sort((one, other) => far(one) - far(other));
  return places.find((place) => isFree({ svg }, place));
}

/**
 * @param {Pick<MapCanvas, 'svg'>} map
 * @param {Point} place
 * @returns {boolean} Whether the map is to be seen there and around.
 */
function isFree({ svg }, [x, y]) {
  const corners = [-CLEAR, 0, CLEAR].flatMap((dx) =>
    [-CLEAR, 0, CLEAR].map((dy) => document.elementFromPoint(x + dx, y + dy)),
  );
  return corners.every((element) => element !== null && svg.contains(element));
}
