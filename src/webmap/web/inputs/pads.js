import { past, throwOf } from "./throws.js";

/** @typedef {import('../motion/axes.js').Axes} Axes */

/** The button that must be held for a gamepad to drive: the left shoulder, LB or L1. */
export const DEAD_MAN = 4;

/** A gamepad that says nothing new for this long may be gone unnoticed; ms. */
export const SILENT = 2000;

/**
 * What is read of a gamepad, as the browser has it.
 *
 * @typedef {object} Pad
 * @property {number} index
 * @property {string} id
 * @property {boolean} connected
 * @property {string} mapping
 * @property {number} timestamp
 * @property {readonly number[]} axes
 * @property {readonly {pressed: boolean}[]} buttons
 */

/**
 * Decides what gamepads ask for: nothing, unless the dead-man button of one is held.
 *
 * The button must have been seen up since the gamepad came and since the last doubt.
 * A gamepad that lost its radio link goes on showing the last thing it said; so one
 * that says nothing new while its button is held is doubted as well. Times are in
 * milliseconds of one clock.
 */
export class Pads {
  constructor() {
    /** @type {Map<string, {timestamp: number, newsAt: number, fresh: boolean}>} */
    this._known = new Map();
    /** Whether a dead-man button is held that does nothing. */
    this.spent = false;
  }

  /** Whether there is a gamepad that could drive. */
  get present() {
    return this._known.size > 0;
  }

  /**
   * @param {Iterable<Pad | null>} pads What the browser lists.
   * @param {number} now
   * @param {{holonomic?: boolean}} [options]
   * @returns {Axes | null} Null when none drives.
   */
  read(pads, now, { holonomic = false } = {}) {
    const seen = new Set();
    /** @type {Axes | null} */
    let axes = null;
    this.spent = false;
    for (const pad of pads) {
      if (!pad?.connected || pad.mapping !== "standard") continue;
      const key = `${pad.index} ${pad.id}`;
      seen.add(key);
      if (!this._drives(key, pad, now)) continue;
      axes ??= axesOfPad(pad, holonomic);
    }
    for (const key of this._known.keys()) if (!seen.has(key)) this._known.delete(key);
    return axes;
  }

  /** Doubt: no button that is held now counts any more. */
  drop() {
    for (const state of this._known.values()) state.fresh = false;
  }

  /**
   * @param {string} key
   * @param {Pad} pad
   * @param {number} now
   */
  _drives(key, pad, now) {
    const { timestamp } = pad;
    const state = this._known.get(key) ?? { timestamp, newsAt: now, fresh: false };
    this._known.set(key, state);
    if (timestamp !== state.timestamp) Object.assign(state, { timestamp, newsAt: now });
    if (!pad.buttons[DEAD_MAN]?.pressed) {
      state.fresh = true;
      return false;
    }
    if (now - state.newsAt > SILENT) state.fresh = false;
    if (!state.fresh) this.spent = true;
    return state.fresh;
  }
}

/**
 * The left stick drives and turns. For a base that moves sideways it moves it, and the
 * right stick turns.
 *
 * @param {Pad} pad
 * @param {boolean} holonomic
 * @returns {Axes}
 */
function axesOfPad({ axes }, holonomic) {
  const [right = 0, down = 0, turn = 0] = axes;
  if (!holonomic) return throwOf(right, down);
  return { ...throwOf(right, down, { sideways: true }), turn: past(-turn) };
}
