import { byId } from "./dom.js";

/** @typedef {import('./console.js').MapCanvas} MapCanvas */
/** @typedef {[number, number]} Point In pixels of the window. */

/** How much around a robot has to be free, in pixels. */
const AROUND = 48;

/** Between two places where a robot may be brought, in pixels, at least. */
const STEP = 32;

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
  map.setView(moved, { user: true });
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
  const step = Math.max(STEP, Math.sqrt((width * height) / PLACES));
  for (let x = left + AROUND; x < left + width; x += step) {
    for (let y = top + AROUND; y < top + height; y += step) places.push([x, y]);
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
  const corners = [-AROUND, 0, AROUND].flatMap((dx) =>
    [-AROUND, 0, AROUND].map((dy) => document.elementFromPoint(x + dx, y + dy)),
  );
  return corners.every((element) => element !== null && svg.contains(element));
}
