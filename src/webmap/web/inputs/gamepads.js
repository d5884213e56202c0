import { attentive } from "../motion/attention.js";
import { Pads } from "./pads.js";

/** @typedef {import('../drive.js').Drive} Drive */

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

/** @returns {Iterable<import('./pads.js').Pad | null>} */
function listed() {
  try {
    return navigator.getGamepads?.() ?? [];
  } catch {
    // A page in a frame may not be allowed to ask.
    return [];
  }
}
