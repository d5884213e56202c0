/** The state of all inputs of this page, and the axes that they request. */

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

/** How long all inputs must be neutral before a press counts again, in ms. */
export const REST = 200;

/**
 * The state of all inputs, and whether it may move a robot.
 *
 * There are several inputs (keyboard, stick, gamepad), but only one moves the robot at a
 * time: the first that leaves neutral. Another that is pressed meanwhile has no effect
 * until it is released.
 *
 * Inputs are blocked at first and after {@link Inputs#block}. A press unblocks them if
 * all inputs were neutral for at least {@link REST} ms before; they stay unblocked while
 * the operator presses and releases. So no motion resumes by itself: a key that is held
 * during an outage moves nothing.
 *
 * Times are in milliseconds of the caller's clock.
 */
export class Inputs {
  /** @param {number} now */
  constructor(now) {
    /**
     * The inputs that are not neutral.
     * @type {Map<string, Readonly<Axes>>}
     */
    this._pressed = new Map();
    /**
     * Inputs that were pressed when a press had no effect.
     * @type {Set<string>}
     */
    this._void = new Set();
    this._blocked = true;
    /**
     * Inputs that were pressed when the page froze: their release may have been lost.
     * @type {Set<string>}
     */
    this._frozen = new Set();
    /** Since when all inputs are neutral, at the earliest since the last block. */
    this._quietSince = now;
  }

  /** Whether an input may be held since the page froze. */
  get frozen() {
    return this._frozen.size > 0;
  }

  /** Whether any input is not neutral, blocked or not. */
  get pressed() {
    return this._pressed.size > 0;
  }

  /** Whether inputs have no effect until they are released and pressed again. */
  get blocked() {
    return this._blocked;
  }

  /** The axes that may move a robot: neutral while blocked. */
  get axes() {
    if (this._blocked) return NEUTRAL;
    for (const [source, axes] of this._pressed) {
      if (!this._void.has(source)) return axes;
    }
    return NEUTRAL;
  }

  /**
   * @param {number} now
   * @returns {boolean} Whether a press would have an effect now.
   */
  ready(now) {
    if (this.pressed) return false;
    return !this._blocked || now - this._quietSince >= REST;
  }

  /**
   * Set the state of one input.
   *
   * @param {string} source
   * @param {Partial<Axes> | null} asked Its axes; null if the input is gone.
   * @param {number} now
   * @param {{fresh?: boolean}} [how] `fresh`: whether this page received the press. An
   *     input that was pressed before has no effect until it is released.
   */
  set(source, asked, now, { fresh = true } = {}) {
    const axes = clean(asked);
    if (isNeutral(axes)) {
      this._release(source, now);
      return;
    }
    if (this._pressed.has(source)) this._pressed.set(source, axes);
    else this._press(source, axes, fresh && this.ready(now));
    if (!fresh) this._void.add(source);
  }

  /**
   * Block the inputs until all were neutral for {@link REST} and one is pressed again.
   *
   * @param {number} now
   */
  block(now) {
    this._blocked = true;
    this._quietSince = now;
  }

  /**
   * Forget the pressed inputs: another window may have received the release.
   *
   * @param {number} now
   * @param {{frozen?: boolean}} [how] `frozen`: whether the page was frozen, so that they
   *     may still be held.
   */
  drop(now, { frozen = false } = {}) {
    if (frozen) for (const source of this._pressed.keys()) this._frozen.add(source);
    this._pressed.clear();
    this._void.clear();
    this.block(now);
  }

  /**
   * @param {string} source
   * @param {Readonly<Axes>} axes
   * @param {boolean} counts
   */
  _press(source, axes, counts) {
    this._frozen.clear();
    this._pressed.set(source, axes);
    if (counts) this._blocked = false;
    else this._void.add(source);
  }

  /**
   * @param {string} source
   * @param {number} now
   */
  _release(source, now) {
    this._void.delete(source);
    this._frozen.delete(source);
    if (this._pressed.delete(source) && !this.pressed) this._quietSince = now;
  }
}
