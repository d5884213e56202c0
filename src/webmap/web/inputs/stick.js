import { takesKeys } from "../motion/attention.js";

/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('../motion/axes.js').Axes} Axes */

/** How far from its middle the knob goes, as a share of the pad's radius. */
const TRAVEL = 0.62;

/**
 * A pad with a knob as a drive input, for one finger, pen or mouse button.
 *
 * The pointer is captured: wherever it goes, its release is heard here. Whatever ends it
 * is neutral, and a pointer that was forgotten does nothing until it presses anew.
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
    /** Where the pad was when it was pressed; it may move as words around it change. */
    this._middle = { x: 0, y: 0, way: 1 };
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
    // A finger that rests would open a menu, and a menu is a doubt.
    pad.addEventListener("touchstart", (event) => event.preventDefault(), {
      ...options,
      passive: false,
    });
    this._offs = [
      drive.on("drop", () => this.release()),
      drive.on("read", () => this._check()),
    ];
  }

  /** Forget the pointer, neutral. */
  release() {
    const pointer = this._pointer;
    if (pointer === null) return;
    this._pointer = null;
    if (this._pad.hasPointerCapture(pointer)) this._pad.releasePointerCapture(pointer);
    this._draw(0, 0);
    this._pad.classList.remove("held");
    this._drive.setInput("stick", null);
  }

  /** Stop listening, neutral. */
  destroy() {
    this._ending.abort();
    for (const off of this._offs) off();
    this.release();
  }

  /** A capture that is lost is not told before the pointer moves again. */
  _check() {
    if (this._pointer === null) return;
    if (!this._pad.hasPointerCapture(this._pointer)) this.release();
  }

  /** @param {PointerEvent} event */
  _down(event) {
    event.preventDefault();
    if (this._pointer !== null || event.button !== 0) return;
    // As the press is not heard of elsewhere, it would leave the keys in a text field.
    const focused = document.activeElement;
    if (focused instanceof HTMLElement && takesKeys(focused)) focused.blur();
    const { left, top, width, height } = this._pad.getBoundingClientRect();
    this._middle = { x: left + width / 2, y: top + height / 2, way: (TRAVEL * width) / 2 };
    this._pointer = event.pointerId;
    this._pad.setPointerCapture(event.pointerId);
    this._pad.classList.add("held");
    this._move(event);
  }

  /** @param {PointerEvent} event */
  _move(event) {
    if (event.pointerId !== this._pointer) return;
    // While another mouse button is held, that this one went up is told as a move.
    if ((event.buttons & 1) === 0) return this.release();
    const { x, y, way } = this._middle;
    const right = (event.clientX - x) / way;
    const down = (event.clientY - y) / way;
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

/** What of a stick's way does nothing, so that straight ahead is straight; a share. */
export const DEAD_ZONE = 0.15;

/**
 * Return what a stick asks for that is moved so far.
 *
 * Across the screen it turns the robot on the spot or on its way, or moves it sideways.
 *
 * @param {number} right Share of the stick's whole way, to the right.
 * @param {number} down Likewise, towards the operator.
 * @param {{sideways?: boolean}} [options]
 * @returns {Axes}
 */
export function axesOfStick(right, down, { sideways = false } = {}) {
  // Pulled beyond its edge, a stick still points the same way.
  const beyond = Math.max(1, Math.hypot(right, down));
  const ahead = beyondDeadZone(-down / beyond);
  const left = beyondDeadZone(-right / beyond);
  return sideways ? { x: ahead, y: left, turn: 0 } : { x: ahead, y: 0, turn: left };
}

/**
 * @param {number} value In [-1, 1].
 * @returns {number} What of it lies beyond the dead zone, again up to 1.
 */
export function beyondDeadZone(value) {
  const size = Math.abs(value) - DEAD_ZONE;
  return size > 0 ? (Math.sign(value) * size) / (1 - DEAD_ZONE) : 0;
}
