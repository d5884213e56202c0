/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('./route_run.js').RouteRun} RouteRun */

/** A map that is not there again by then is another one, in ms. */
export const KEPT_FOR = 5000;

/**
 * What a tool for routes leaves behind: its points, and who goes along what.
 *
 * @typedef {object} Route
 * @property {Pose[]} points
 * @property {boolean} loop
 * @property {boolean} open Whether its panel was unfolded.
 * @property {Map<string, {name: string, run: RouteRun}>} runs By robot.
 */

/** @type {Map<number, {route: Route, at: number}>} */
const kept = new Map();

/**
 * Keep a route for the tool that comes next on the same map: when the link of the page
 * breaks, everything on it is drawn anew, and this tool is taken away with it.
 *
 * @param {number} map
 * @param {Route} route
 * @param {number} now
 */
export function keepRoute(map, route, now) {
  kept.set(map, { route, at: now });
}

/**
 * @param {number} map
 * @param {number} now
 * @returns {Route | null} What was kept a moment ago; it is kept no longer.
 */
export function keptRoute(map, now) {
  const { route, at } = kept.get(map) ?? { route: null, at: 0 };
  kept.delete(map);
  return route !== null && now - at < KEPT_FOR ? route : null;
}
