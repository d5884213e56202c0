/** @typedef {import('../motion/axes.js').Axes} Axes */

/** What of a stick's way does nothing, so that straight ahead is straight; a share. */
export const DEAD_ZONE = 0.15;

/**
 * Return what a stick asks for that is moved so far.
 *
 * Across the screen it turns the robot on the spot or on its way, or moves it sideways.
 *
 * @param {number} right Share of the stick's whole way, to the right.
 * @param {number} down Likewise, towards the operator.
 * @param {{sideways?: boolean}} [options]
 * @returns {Axes}
 */
export function throwOf(right, down, { sideways = false } = {}) {
  // Pulled beyond its edge, a stick still points the same way.
  const beyond = Math.max(1, Math.hypot(right, down));
  const ahead = past(-down / beyond);
  const left = past(-right / beyond);
  return sideways ? { x: ahead, y: left, turn: 0 } : { x: ahead, y: 0, turn: left };
}

/**
 * @param {number} value In [-1, 1].
 * @returns {number} What of it lies beyond the dead zone, again up to 1.
 */
export function past(value) {
  const size = Math.abs(value) - DEAD_ZONE;
  return size > 0 ? (Math.sign(value) * size) / (1 - DEAD_ZONE) : 0;
}
