import { NEUTRAL, clean, isNeutral } from "./axes.js";

/** @typedef {import('./axes.js').Axes} Axes */

/** How long every input must be neutral before a press counts again, in ms. */
export const REST = 200;

/**
 * What the operator's inputs ask for, and whether that counts.
 *
 * Several inputs (keyboard, stick, gamepad) say their state; one of them owns the
 * motion at a time: the first to leave neutral. Another that is pressed meanwhile
 * does nothing until it has been let go of.
 *
 * Inputs are dead at first and after every doubt ({@link Inputs#block}). They come to
 * life by a press that follows at least {@link REST} ms of all inputs neutral, and
 * stay alive while the operator presses and releases. So nothing ever resumes by
 * itself: a key held through an outage moves nothing.
 *
 * Times are in milliseconds of one clock that the caller reads.
 */
export class Inputs {
  /** @param {number} now */
  constructor(now) {
    /**
     * The inputs that are away from neutral.
     * @type {Map<string, Readonly<Axes>>}
     */
    this._pressed = new Map();
    /**
     * Inputs that were pressed while they could not act.
     * @type {Set<string>}
     */
    this._void = new Set();
    this._blocked = true;
    /** Since when all inputs have been neutral, no earlier than the last doubt. */
    this._quietSince = now;
  }

  /** Whether any input is away from neutral, dead or not. */
  get pressed() {
    return this._pressed.size > 0;
  }

  /** Whether the inputs do nothing until they were let go of and pressed again. */
  get blocked() {
    return this._blocked;
  }

  /** The axes that may act: neutral while dead. */
  get axes() {
    if (this._blocked) return NEUTRAL;
    for (const [source, axes] of this._pressed) {
      if (!this._void.has(source)) return axes;
    }
    return NEUTRAL;
  }

  /**
   * @param {number} now
   * @returns {boolean} Whether a press at this moment would act.
   */
  ready(now) {
    if (this.pressed) return false;
    return !this._blocked || now - this._quietSince >= REST;
  }

  /**
   * Take the state of one input.
   *
   * @param {string} source
   * @param {Partial<Axes> | null} asked Its axes; null when it is gone.
   * @param {number} now
   * @param {{fresh?: boolean}} [how] `fresh`: whether the press was heard. An input that
   *     was pressed before does nothing until it is released.
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
   * Make the inputs dead until all were neutral for {@link REST} and pressed again.
   *
   * @param {number} now
   */
  block(now) {
    this._blocked = true;
    this._quietSince = now;
  }

  /**
   * Forget what is held: its release may have gone to another window.
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
