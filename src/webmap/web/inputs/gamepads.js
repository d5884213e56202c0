import { attentive } from "./focus.js";
import { beyondDeadZone, axesOfStick } from "./stick.js";

/** @typedef {import('../motion/inputs.js').Axes} Axes */
/** @typedef {import('../drive.js').Drive} Drive */

/** The button that must be held for a gamepad to drive: the left shoulder, LB or L1. */
export const DEAD_MAN = 4;

/** A gamepad without a change for this time may be disconnected; ms. */
export const SILENT = 2000;

/**
 * The parts of the browser's `Gamepad` that are read.
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
 * Computes the axes of gamepads: neutral, unless a dead-man button is held.
 *
 * The button must have been released since the gamepad was connected and since the last
 * {@link Pads#drop}. A gamepad that lost its radio connection keeps its last state; so the
 * button also has no effect when the gamepad does not change for {@link SILENT} ms. Times
 * are in milliseconds of one clock.
 */
export class Pads {
  constructor() {
    /** @type {Map<string, {timestamp: number, changedAt: number, fresh: boolean}>} */
    this._known = new Map();
    /** Whether a dead-man button is held without effect. */
    this.spent = false;
    /** Why a connected gamepad cannot drive, in a sentence; empty if all can. */
    this.refusal = "";
  }

  /** Whether there is a gamepad for driving. */
  get present() {
    return this._known.size > 0;
  }

  /**
   * @param {Iterable<Pad | null>} pads The browser's list.
   * @param {number} now
   * @param {{holonomic?: boolean}} [options]
   * @returns {Axes | null} null if no gamepad drives.
   */
  read(pads, now, { holonomic = false } = {}) {
    const seen = new Set();
    /** @type {Axes | null} */
    let axes = null;
    this.spent = false;
    this.refusal = "";
    for (const pad of pads) {
      if (!pad?.connected) continue;
      if (pad.mapping !== "standard") {
        this.refusal ||= refusalOf(pad);
        continue;
      }
      const key = `${pad.index} ${pad.id}`;
      seen.add(key);
      if (!this._drives(key, pad, now)) continue;
      axes ??= axesOfPad(pad, holonomic);
    }
    for (const key of this._known.keys()) if (!seen.has(key)) this._known.delete(key);
    return axes;
  }

  /** Buttons that are held now have no effect until they are released. */
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
    const state = this._known.get(key) ?? { timestamp, changedAt: now, fresh: false };
    this._known.set(key, state);
    if (timestamp !== state.timestamp) Object.assign(state, { timestamp, changedAt: now });
    if (!pad.buttons[DEAD_MAN]?.pressed) {
      state.fresh = true;
      return false;
    }
    if (now - state.changedAt > SILENT) state.fresh = false;
    if (!state.fresh) this.spent = true;
    return state.fresh;
  }
}

/** @param {Pad} pad */
function refusalOf({ id, mapping }) {
  const got = mapping ? `the mapping "${mapping}"` : "no mapping";
  return (
    `The gamepad "${id.slice(0, 80)}" cannot drive: the browser reports ${got} of its ` +
    'buttons, expected "standard". Switch it to another mode, such as XInput, or use ' +
    "another gamepad."
  );
}

/**
 * The left stick drives and turns. For a holonomic base the left stick drives in all
 * directions, and the right stick turns.
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
 * Gamepads as a drive input. They have no events for their axes, so they are read at each
 * step, and when one is disconnected.
 */
export class Gamepads {
  /**
   * @param {Drive} drive
   * @param {object} owner
   * @param {() => boolean} owner.wanted Whether there is a robot to drive.
   * @param {() => boolean} owner.holonomic Whether it can move sideways.
   */
  constructor(drive, owner) {
    this._drive = drive;
    this._owner = owner;
    this._pads = new Pads();
    this._refusal = "";
    this._ending = new AbortController();
    const options = { signal: this._ending.signal };
    window.addEventListener("gamepaddisconnected", () => this._lost(), options);
    this._offs = [
      drive.on("read", () => this._read()),
      drive.on("drop", () => this._pads.drop()),
    ];
  }

  /** Whether there is a gamepad for driving. */
  get present() {
    return this._pads.present;
  }

  /** Whether a dead-man button is held without effect. */
  get spent() {
    return this._pads.spent;
  }

  /** Stop listening and go neutral. */
  destroy() {
    this._ending.abort();
    for (const off of this._offs) off();
    this._drive.setInput("gamepad", null);
    this._report("");
  }

  _read() {
    const holonomic = this._owner.holonomic();
    if (!attentive()) this._pads.drop();
    const axes = this._pads.read(listed(), performance.now(), { holonomic });
    this._drive.setInput("gamepad", this._owner.wanted() ? axes : null);
    this._report(this._pads.refusal);
  }

  /** @param {string} refusal */
  _report(refusal) {
    if (refusal === this._refusal) return;
    this._refusal = refusal;
    this._drive.refuseGamepad(refusal);
  }

  /** A gamepad is gone; the browser's list may still contain it. */
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
    // A page in a frame may not have the permission.
    return [];
  }
}
