import { NEUTRAL, clean, isNeutral } from "./axes.js";

/** @typedef {import('./axes.js').Axes} Axes */

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
    /** Since when all inputs are neutral, at the earliest since the last block. */
    this._quietSince = now;
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
   */
  drop(now) {
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
    if (this._pressed.delete(source) && !this.pressed) this._quietSince = now;
  }
}
