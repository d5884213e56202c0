/**
 * The motion that an input requests. Each axis is a share of the speed limit, in [-1, 1].
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
 * If one value is not a finite number, all are zero: a part of a command may be
 * dangerous without the rest.
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
 * @returns {boolean} Whether all axes are zero.
 */
export function isNeutral(axes) {
  return axes.x === 0 && axes.y === 0 && axes.turn === 0;
}

/** @param {number} value */
function unit(value) {
  // Adding zero changes -0 to 0, which is clearer in a log.
  return Math.max(-1, Math.min(1, value)) + 0;
}
