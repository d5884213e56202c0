/** The stick on the page, and what a position of any stick means. */

import { takesKeys } from "./focus.js";

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
    const end = (/** @type {PointerEvent} */ event) => {
      if (event.pointerId === this._pointer) this.release();
    };
    pad.addEventListener("pointerup", end, options);
    pad.addEventListener("pointercancel", end, options);
    pad.addEventListener("lostpointercapture", end, options);
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
 * @param {{sideways?: boolean, zone?: number}} [options]
 * @returns {Axes}
 */
export function axesOfStick(right, down, { sideways = false, zone = DEAD_ZONE } = {}) {
  // Beyond the edge of the pad, the direction stays the same.
  const beyond = Math.max(1, Math.hypot(right, down));
  const ahead = beyondDeadZone(-down / beyond, zone);
  const left = beyondDeadZone(-right / beyond, zone);
  return sideways ? { x: ahead, y: left, turn: 0 } : { x: ahead, y: 0, turn: left };
}

/**
 * @param {number} value In [-1, 1].
 * @param {number} [zone] The dead zone.
 * @returns {number} The part beyond the dead zone, scaled to [-1, 1].
 */
export function beyondDeadZone(value, zone = DEAD_ZONE) {
  const size = Math.abs(value) - zone;
  return size > 0 ? (Math.sign(value) * size) / (1 - zone) : 0;
}
