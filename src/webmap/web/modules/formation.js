/** @typedef {import('../view.js').Point} Point */
/** @typedef {import('./aim.js').Pose} Pose */

/** So many robots at most stand in one line; more stand in a grid. */
export const LONGEST_LINE = 4;

/**
 * Return places for several robots around a pose: a line across the heading, or a grid.
 *
 * The middle of the first line is the pose, and every other line is behind it.
 *
 * @param {Pose} pose
 * @param {number} count
 * @param {number} spacing Metres between neighbours.
 * @returns {Pose[]}
 */
export function formation({ x, y, yaw }, count, spacing) {
  const lines = Math.ceil(count / LONGEST_LINE);
  const across = Math.ceil(count / lines);
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return Array.from({ length: count }, (_, n) => {
    const line = Math.floor(n / across);
    const inLine = Math.min(across, count - line * across);
    const left = ((inLine - 1) / 2 - (n % across)) * spacing;
    const ahead = -line * spacing;
    return { x: x + cos * ahead - sin * left, y: y + sin * ahead + cos * left, yaw };
  });
}

/**
 * Match robots to places so that their straight ways are short all together; ways that
 * cross could be made shorter by exchanging their ends, so none do.
 *
 * @param {Point[]} robots
 * @param {Pose[]} places As many as there are robots.
 * @returns {Pose[]} The place of each robot.
 */
export function assign(robots, places) {
  const chosen = [...places];
  /** @param {number} robot @param {number} place */
  const way = (robot, place) =>
    Math.hypot(robots[robot].x - chosen[place].x, robots[robot].y - chosen[place].y);
  let better = true;
  while (better) {
    better = false;
    for (let i = 0; i < robots.length; i++) {
      for (let j = i + 1; j < robots.length; j++) {
        if (way(i, j) + way(j, i) < way(i, i) + way(j, j) - 1e-9) {
          [chosen[i], chosen[j]] = [chosen[j], chosen[i]];
          better = true;
        }
      }
    }
  }
  return chosen;
}
