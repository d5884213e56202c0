/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/**
 * @param {MapCanvas} map
 * @param {string} robot
 * @returns {Pose | null} Where the map shows the robot; null where it does not.
 */
export function poseOf(map, robot) {
  const element = map.world.querySelector(`.robot[data-robot="${CSS.escape(robot)}"]`);
  if (!(element instanceof SVGGraphicsElement)) return null;
  const onMap = element.getCTM();
  const world = map.world.getCTM();
  if (!onMap || !world) return null;
  const { a, b, e, f } = world.inverse().multiply(onMap);
  return { x: e, y: f, yaw: Math.atan2(b, a) };
}

/**
 * @param {MapCanvas} map
 * @returns {string[]} The robots that are selected: the one, and those marked besides.
 */
export function chosen(map) {
  if (map.selected === null) return [];
  const marked = [...map.world.querySelectorAll(".robot.marked")].flatMap(
    (element) => element.getAttribute("data-robot") ?? [],
  );
  return [map.selected, ...marked.filter((robot) => robot !== map.selected)];
}
