import { byId, setHidden } from "../web/tools/elements.js";
import { rotate, scale, scaleOf, translate } from "../web/view.js";

/** @typedef {import('../web/view.js').Matrix} Matrix */
/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('./console.js').Options} Options */

/** Zoom factor of one press of a zoom button. */
const STEP = 1.5;

/** Smallest margin around the whole view, in pixels. */
const MARGIN = 24;

/** Space around a robot on each side, in metres. */
const AROUND = 1;

/** Position and size in metres: x, y, width to the right, height up. */
/** @typedef {[number, number, number, number]} Box */

/**
 * Keep names and marks on the map at a constant size in pixels at every zoom, and
 * upright at every rotation; map.css draws them.
 *
 * @param {MapCanvas} map
 */
export function keepSizes(map) {
  let shown = "";
  const keep = () => {
    const { a, b } = map.view;
    const size = (1 / scaleOf(map.view)).toPrecision(4);
    const turn = Number(Math.atan2(b, a).toFixed(4));
    if (shown === `${size} ${turn}`) return;
    shown = `${size} ${turn}`;
    map.svg.style.setProperty("--metre-per-pixel", size);
    map.svg.style.setProperty("--turn", `${turn}rad`);
    byId("north-up").style.setProperty("--turn", `${turn}rad`);
    const degrees = Math.round((-turn * 180) / Math.PI) || 0;
    byId("north-up").title = `Turn north up (map turned by ${degrees}°)`;
    byId("north-up").classList.toggle("turned", degrees !== 0);
  };
  keep();
  return map.onView(keep);
}

/**
 * Handle the buttons of the view in the browser.
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
  on("north-up", () => northUp(map));
  // Before the module that moves the view, which does not know the floor.
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
 * Fold the tools that have no room in the bar into More: they are in further lines, which
 * are hidden until it is pressed.
 *
 * @param {AbortSignal} signal
 */
export function foldTools(signal) {
  const [tools, more] = [byId("tools"), byId("tools-more")];
  const buttons = () => [...tools.querySelectorAll(".webmap-tool-go, .webmap-export-go")];
  const unfold = (/** @type {boolean} */ open) => {
    tools.classList.toggle("unfolded", open);
    more.setAttribute("aria-expanded", `${open}`);
  };
  const fold = () => {
    const all = buttons();
    const top = tools.getBoundingClientRect().top + tools.clientTop;
    const below = all.map((one) => one.getBoundingClientRect().top > top + 1);
    all.forEach((one, i) => one.classList.toggle("folded", below[i]));
    setHidden(more, !below.includes(true));
    if (more.hidden) unfold(false);
  };
  more.addEventListener("click", () => unfold(more.ariaExpanded !== "true"), { signal });
  // A tool of the further lines begins to work where it was pressed.
  tools.addEventListener("click", () => unfold(false), { signal });
  const sizes = new ResizeObserver(fold);
  const watch = () => {
    // Also when a style sheet comes after a tool.
    sizes.disconnect();
    for (const each of [tools, ...buttons()]) sizes.observe(each);
  };
  const dock = () => {
    const open = tools.querySelector(":scope > details[open]");
    document.body.classList.toggle("docked", open !== null);
  };
  // A list may be open when it is added.
  const added = new MutationObserver(() => [watch(), dock()]);
  added.observe(tools, { childList: true });
  const opened = new MutationObserver(dock);
  watch();
  dock();
  opened.observe(tools, { subtree: true, attributeFilter: ["open"] });
  signal.addEventListener("abort", () => {
    for (const observer of [sizes, added, opened]) observer.disconnect();
  });
}

/**
 * @param {MapCanvas} map
 * @param {number} factor
 * @returns {Matrix} The zoomed view, about the followed robot or the middle of the
 *     view.
 */
function zoom(map, factor) {
  const { view } = map;
  const [x, y] = (map.following && placeOfSelected(map)) || [
    map.width / 2,
    map.height / 2,
  ];
  return scale(view, factor, x, y);
}

/**
 * @param {MapCanvas} map
 * @returns {Matrix} The view without its rotation, about the middle.
 */
function northUp({ view, width, height }) {
  const degrees = (Math.atan2(view.b, view.a) * 180) / Math.PI;
  return rotate(view, degrees, width / 2, height / 2);
}

/**
 * @param {MapCanvas} map
 * @param {Box | null} bounds
 * @returns {Matrix | null} The view of the floor and of every robot, or of all drawn
 *     things where there is no floor, north up; null if there is nothing yet.
 */
function showAll({ crowd, world, width, height }, bounds) {
  crowd.drawAll();
  const box = world.getBBox();
  const all = bounds ?? [box.x, box.y, box.width, box.height];
  const [x, y, across, up] = placesOfRobots(world).reduce(withPlace, all);
  const room = [width - 2 * MARGIN, height - 2 * MARGIN];
  const k = Math.min(room[0] / across, room[1] / up);
  if (!(k > 0) || !Number.isFinite(k)) return null;
  const [e, f] = [width / 2 - k * (x + across / 2), height / 2 + k * (y + up / 2)];
  return { a: k, b: 0, c: 0, d: -k, e, f };
}

/**
 * @param {Box} box
 * @param {[number, number]} place
 * @returns {Box} The box, extended by the place with room around it.
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
 * @returns {[number, number][]} Positions of the robots, in metres.
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
 * @returns {[number, number] | null} Position of the selected robot, in the map's
 *     pixels.
 */
function placeOfSelected({ world }) {
  const robot = world.querySelector(".robot.selected");
  if (!(robot instanceof SVGGraphicsElement)) return null;
  const matrix = robot.getCTM();
  return matrix && [matrix.e, matrix.f];
}

/** @typedef {[number, number]} Point In pixels of the window. */

/** Free space that a robot needs on each side, in pixels. */
const CLEAR = 48;

/** Smallest distance between two candidate positions, in pixels. */
const APART = 32;

/** Approximate number of candidate positions. */
const PLACES = 600;

/** Longest wait for a robot's card to appear, in milliseconds. */
const PATIENCE = 1500;

/**
 * Keep a visible selected robot in view when a panel, a tool or the camera opens beside
 * or over the map: move the view as little as possible, and back when it is closed,
 * unless somebody has moved the view since.
 *
 * @param {MapCanvas} map
 * @param {AbortSignal} signal Ends it.
 */
export function keepInView(map, signal) {
  /** @type {DOMRect | null} null until the first check: reading it makes a layout. */
  let area = null;
  let [width, height] = [map.width, map.height];
  /** By how much the view was moved to uncover the robot, in pixels. */
  let [x, y] = [0, 0];
  const check = () => {
    const now = map.svg.getBoundingClientRect();
    const before = area ?? now;
    // The map has not adapted its view yet; its new size comes here next.
    if (Math.abs(now.width - map.width) > 1 || Math.abs(now.height - map.height) > 1) return;
    area = now;
    [width, height] = [map.width, map.height];
    if (map.following || !map.selected) return;
    const seen = isInside(before, placeOnScreen(map, map.selected));
    if (x !== 0 || y !== 0) map.setView(translate(map.view, -x, -y));
    const { e, f } = map.view;
    // Closing leaves the robot where it was, unless another part still covers that place.
    const grown = now.width > before.width + 1 || now.height > before.height + 1;
    const back = grown && isInside(now, placeOnScreen(map, map.selected));
    if (seen && !back) show(map, map.selected);
    [x, y] = [map.view.e - e, map.view.f - f];
  };
  const off = map.onView(() => {
    // With another size of the map, the map has adapted the view.
    if (map.width === width && map.height === height) [x, y] = [0, 0];
  });
  const sizes = new ResizeObserver(check);
  sizes.observe(map.svg);
  const panels = new MutationObserver(check);
  panels.observe(document.body, { attributeFilter: ["data-camera"] });
  document.addEventListener("toggle", check, { signal, capture: true });
  signal.addEventListener("abort", () => {
    off();
    for (const observer of [sizes, panels]) observer.disconnect();
  });
}

/**
 * @param {DOMRect} area
 * @param {Point | null} place
 * @returns {boolean} Whether a place is in an area.
 */
function isInside({ left, right, top, bottom }, place) {
  return place !== null && place[0] > left && place[0] < right && place[1] > top && place[1] < bottom;
}

/**
 * Move the map so that a robot selected in the list is where nothing covers the map.
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
 * Move the map as little as possible so that nothing covers a robot.
 *
 * @param {MapCanvas} map
 * @param {string} robot
 */
function show(map, robot) {
  const place = placeOnScreen(map, robot);
  if (!place || map.following || isFree(map, place)) return;
  const free = nearest(map, place);
  if (free) map.setView(translate(map.view, free[0] - place[0], free[1] - place[1]));
}

/**
 * @param {MapCanvas} map
 * @param {string} robot
 * @returns {Point | null} Where the robot is drawn; null if it has no place.
 */
function placeOnScreen(map, robot) {
  const element = map.world.querySelector(
    `.robot:not(.unplaced)[data-robot="${CSS.escape(robot)}"]`,
  );
  if (!(element instanceof SVGGraphicsElement)) return null;
  map.crowd.draw(element);
  const matrix = element.getScreenCTM();
  return matrix && [matrix.e, matrix.f];
}

/**
 * @param {MapCanvas} map
 * @param {Point} place
 * @returns {Point | undefined} The uncovered point that is nearest to a place.
 */
function nearest({ svg }, place) {
  const { left, top, width, height } = svg.getBoundingClientRect();
  const step = Math.max(APART, Math.sqrt((width * height) / PLACES));
  const [columns, rows] = [steps(place[0], left, width, step), steps(place[1], top, height, step)];
  const points = columns.flatMap((x) => rows.map((y) => /** @type {Point} */ ([x, y])));
  const far = (/** @type {Point} */ [x, y]) => Math.hypot(x - place[0], y - place[1]);
  points.sort((one, other) => far(one) - far(other));
  return points.find((point) => isFree({ svg }, point));
}

/**
 * @param {number} place
 * @param {number} first
 * @param {number} size
 * @param {number} step
 * @returns {number[]} Candidates along one axis: the place itself if it is far enough
 *     from the edges, or the nearest such place, and places at regular distances.
 */
function steps(place, first, size, step) {
  const [low, high] = [first + CLEAR + 1, first + size - CLEAR - 1];
  const found = [Math.max(low, Math.min(place, high))];
  for (let each = low; each < high; each += step) found.push(each);
  return found;
}

/**
 * @param {Pick<MapCanvas, 'svg'>} map
 * @param {Point} place
 * @returns {boolean} Whether nothing covers the map at this place and around it.
 */
function isFree({ svg }, [x, y]) {
  const corners = [-CLEAR, 0, CLEAR].flatMap((dx) =>
    [-CLEAR, 0, CLEAR].map((dy) => document.elementFromPoint(x + dx, y + dy)),
  );
  return corners.every((element) => element !== null && svg.contains(element));
}
