/**
 * What a hand asks for, each axis in [-1, 1]: a share of the speed in force.
 *
 * @typedef {object} Axes
 * @property {number} x Forward.
 * @property {number} y To the left.
 * @property {number} turn Counter-clockwise.
 */

/** @type {Readonly<Axes>} */
export const NEUTRAL = Object.freeze({ x: 0, y: 0, turn: 0 });

/**
 * Return axes with every value in [-1, 1].
 *
 * Doubt is neutral: one value that is not a finite number makes all of them zero,
 * as half of a command may be the dangerous half.
 *
 * @param {Partial<Axes> | null | undefined} asked
 * @returns {Readonly<Axes>}
 */
export function clean(asked) {
  const x = asked?.x ?? 0;
  const y = asked?.y ?? 0;
  const turn = asked?.turn ?? 0;
  if (!(Number.isFinite(x) && Number.isFinite(y) && Number.isFinite(turn))) {
    return NEUTRAL;
  }
  if (x === 0 && y === 0 && turn === 0) return NEUTRAL;
  return Object.freeze({ x: unit(x), y: unit(y), turn: unit(turn) });
}

/**
 * @param {Readonly<Axes>} axes
 * @returns {boolean} Whether they ask for no motion at all.
 */
export function isNeutral(axes) {
  return axes.x === 0 && axes.y === 0 && axes.turn === 0;
}

/** @param {number} value */
function unit(value) {
  // Adding zero turns -0 into 0, which reads better in a log.
  return Math.max(-1, Math.min(1, value)) + 0;
}
