import { attentive } from "../motion/attention.js";
import { beyondDeadZone, axesOfStick } from "./stick.js";

/** @typedef {import('../drive.js').Drive} Drive */
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
  if (!holonomic) return axesOfStick(right, down);
  return { ...axesOfStick(right, down, { sideways: true }), turn: beyondDeadZone(-turn) };
}

/**
 * Gamepads as a drive input. They tell nothing by themselves: they are asked at each
 * step, and when one is unplugged.
 */
export class Gamepads {
  /**
   * @param {Drive} drive
   * @param {object} owner
   * @param {() => boolean} owner.wanted Whether there is a robot that they could drive.
   * @param {() => boolean} owner.holonomic Whether it can move sideways.
   */
  constructor(drive, owner) {
    this._drive = drive;
    this._owner = owner;
    this._pads = new Pads();
    this._ending = new AbortController();
    const options = { signal: this._ending.signal };
    window.addEventListener("gamepaddisconnected", () => this._lost(), options);
    this._offs = [
      drive.on("read", () => this._read()),
      drive.on("drop", () => this._pads.drop()),
    ];
  }

  /** Whether there is a gamepad that could drive. */
  get present() {
    return this._pads.present;
  }

  /** Whether a dead-man button is held that does nothing. */
  get spent() {
    return this._pads.spent;
  }

  /** Stop listening, neutral. */
  destroy() {
    this._ending.abort();
    for (const off of this._offs) off();
    this._drive.setInput("gamepad", null);
  }

  _read() {
    const holonomic = this._owner.holonomic();
    if (!attentive()) this._pads.drop();
    const axes = this._pads.read(listed(), performance.now(), { holonomic });
    this._drive.setInput("gamepad", this._owner.wanted() ? axes : null);
  }

  /** One is gone, and the list may not say so yet. */
  _lost() {
    this._pads.drop();
    this._drive.setInput("gamepad", null);
  }
}

/** @returns {Iterable<Pad | null>} */
function listed() {
  try {
    return navigator.getGamepads?.() ?? [];
  } catch {
    // A page in a frame may not be allowed to ask.
    return [];
  }
}
