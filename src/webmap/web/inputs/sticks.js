/** The stick on the page, and the sticks of gamepads. */

import { takesKeys, attentive } from "./focus.js";

/** @typedef {import('../motion/inputs.js').Axes} Axes */
/** @typedef {import('../drive.js').Drive} Drive */

/** How far the knob moves from the centre, as a share of the pad's radius. */
const TRAVEL = 0.62;

/**
 * A pad with a knob as a drive input, for one finger, pen or mouse button.
 *
 * The pointer is captured, so its release arrives here from everywhere. Every end of the
 * press is neutral. After {@link Stick#release} the pointer has no effect until the next
 * press.
 */
export class Stick {
  /**
   * @param {Drive} drive
   * @param {HTMLElement} pad
   * @param {() => boolean} sideways Whether left and right move the base sideways.
   */
  constructor(drive, pad, sideways) {
    this._drive = drive;
    this._pad = pad;
    this._sideways = sideways;
    /** @type {number | null} */
    this._pointer = null;
    /** The pad's position at the press: texts around it may change and move it. */
    this._middle = { x: 0, y: 0, travel: 1 };
    this._ending = new AbortController();
    const options = { signal: this._ending.signal };
    pad.addEventListener("pointerdown", (event) => this._down(event), options);
    pad.addEventListener("pointermove", (event) => this._move(event), options);
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) {
      pad.addEventListener(
        kind,
        (event) => {
          if (/** @type {PointerEvent} */ (event).pointerId === this._pointer) {
            this.release();
          }
        },
        options,
      );
    }
    // A resting finger would open a menu, and a menu ends driving.
    pad.addEventListener("touchstart", (event) => event.preventDefault(), {
      ...options,
      passive: false,
    });
    this._offs = [
      drive.on("drop", () => this.release()),
      drive.on("read", () => this._check()),
    ];
  }

  /** Forget the pointer and go neutral. */
  release() {
    const pointer = this._pointer;
    if (pointer === null) return;
    this._pointer = null;
    if (this._pad.hasPointerCapture(pointer)) this._pad.releasePointerCapture(pointer);
    this._draw(0, 0);
    this._pad.classList.remove("held");
    this._drive.setInput("stick", null);
  }

  /** Stop listening and go neutral. */
  destroy() {
    this._ending.abort();
    for (const off of this._offs) off();
    this.release();
  }

  /** A lost capture has no event before the pointer moves again. */
  _check() {
    if (this._pointer === null) return;
    if (!this._pad.hasPointerCapture(this._pointer)) this.release();
  }

  /** @param {PointerEvent} event */
  _down(event) {
    event.preventDefault();
    if (this._pointer !== null || event.button !== 0) return;
    // The press is handled here only, so a text field would keep the focus and the keys.
    const focused = document.activeElement;
    if (focused instanceof HTMLElement && takesKeys(focused)) focused.blur();
    const { left, top, width, height } = this._pad.getBoundingClientRect();
    this._middle = { x: left + width / 2, y: top + height / 2, travel: (TRAVEL * width) / 2 };
    this._pointer = event.pointerId;
    this._pad.setPointerCapture(event.pointerId);
    this._pad.classList.add("held");
    this._move(event);
  }

  /** @param {PointerEvent} event */
  _move(event) {
    if (event.pointerId !== this._pointer) return;
    // While another mouse button is held, the release of this one is a move event.
    if ((event.buttons & 1) === 0) return this.release();
    const { x, y, travel } = this._middle;
    const right = (event.clientX - x) / travel;
    const down = (event.clientY - y) / travel;
    this._draw(right, down);
    this._drive.setInput("stick", axesOfStick(right, down, { sideways: this._sideways() }));
  }

  /**
   * @param {number} right
   * @param {number} down
   */
  _draw(right, down) {
    const beyond = Math.max(1, Math.hypot(right, down));
    this._pad.style.setProperty("--right", `${right / beyond}`);
    this._pad.style.setProperty("--down", `${down / beyond}`);
  }
}

/** The share of a stick's travel without effect, so that straight ahead is straight. */
export const DEAD_ZONE = 0.15;

/**
 * Return the axes for a position of a stick.
 *
 * To the left and right, it turns the robot or moves it sideways.
 *
 * @param {number} right To the right, as a share of the stick's travel.
 * @param {number} down Towards the operator, likewise.
 * @param {{sideways?: boolean}} [options]
 * @returns {Axes}
 */
export function axesOfStick(right, down, { sideways = false } = {}) {
  // Beyond the edge of the pad, the direction stays the same.
  const beyond = Math.max(1, Math.hypot(right, down));
  const ahead = beyondDeadZone(-down / beyond);
  const left = beyondDeadZone(-right / beyond);
  return sideways ? { x: ahead, y: left, turn: 0 } : { x: ahead, y: 0, turn: left };
}

/**
 * @param {number} value In [-1, 1].
 * @returns {number} The part beyond the dead zone, scaled to [-1, 1].
 */
export function beyondDeadZone(value) {
  const size = Math.abs(value) - DEAD_ZONE;
  return size > 0 ? (Math.sign(value) * size) / (1 - DEAD_ZONE) : 0;
}

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
