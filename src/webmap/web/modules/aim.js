import { apply, unapply } from "../view.js";

/** @typedef {import('../view.js').Matrix} Matrix */
/** @typedef {import('../view.js').Point} Point */

/** @typedef {{x: number, y: number, yaw: number}} Pose Metres and radians. */

/** A drag shorter than this in pixels says a place but no heading. */
export const HEADING_FROM = 12;

/**
 * Return the pose that a press and a drag on the map ask for.
 *
 * @param {Matrix} view
 * @param {Point} from Where the press was, in pixels.
 * @param {Point} to Where the pointer is.
 * @param {Pose | null} robot Where the robot is; without a heading from the drag it
 *     shall look the way it comes.
 * @returns {Pose}
 */
export function aim(view, from, to, robot) {
  const place = unapply(view, from.x, from.y);
  if (Math.hypot(to.x - from.x, to.y - from.y) < HEADING_FROM) {
    return { ...place, yaw: robot ? heading(robot, place, robot.yaw) : 0 };
  }
  return { ...place, yaw: heading(place, unapply(view, to.x, to.y), 0) };
}

/**
 * Return the place and direction of a pose on the screen.
 *
 * @param {Matrix} view
 * @param {Pose} pose
 * @returns {{x: number, y: number, degrees: number}} Clockwise, as SVG has it.
 */
export function onScreen(view, { x, y, yaw }) {
  const place = apply(view, x, y);
  const ahead = apply(view, x + Math.cos(yaw), y + Math.sin(yaw));
  const angle = Math.atan2(ahead.y - place.y, ahead.x - place.x);
  return { ...place, degrees: (angle * 180) / Math.PI };
}

/**
 * @param {Point} from
 * @param {Point} to
 * @param {number} otherwise When both are the same place.
 */
function heading(from, to, otherwise) {
  const [dx, dy] = [to.x - from.x, to.y - from.y];
  return dx === 0 && dy === 0 ? otherwise : Math.atan2(dy, dx);
}
