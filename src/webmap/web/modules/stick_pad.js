import { Stick } from "../inputs/stick.js";
import { button, html } from "./elements.js";

/** @typedef {import('../drive.js').Drive} Drive */

/**
 * The on-screen stick: there from the start where fingers are the pointer, and wherever
 * it is asked for.
 */
export class StickPad {
  /** @param {Drive} drive */
  constructor(drive) {
    this._sideways = false;
    /** Whether the operator wants it. */
    this.wanted = matchMedia("(pointer: coarse)").matches;
    const knob = html("div", "webmap-stick-knob");
    this._pad = html(
      "div",
      "webmap-stick",
      { role: "img", "aria-label": "Stick: hold the knob and move it to drive" },
      knob,
    );
    this._mode = button("webmap-panel webmap-stick-mode", "Sideways", () => {
      this._stick.release();
      this._sideways = !this._sideways;
      this._mode.setAttribute("aria-pressed", String(this._sideways));
    });
    this._mode.title = "Left and right move the robot sideways and do not turn it";
    this._mode.setAttribute("aria-pressed", "false");
    this._mode.hidden = true;
    this.element = html("div", "webmap-stick-place", {}, this._mode, this._pad);
    this._stick = new Stick(drive, this._pad, () => this._sideways && !this._mode.hidden);
    this.show(false, false);
  }

  /** Whether the base that it drives moves sideways, too. */
  set holonomic(/** @type {boolean} */ holonomic) {
    if (this._mode.hidden !== holonomic) return;
    // What is held would mean something else from one moment to the next.
    this._stick.release();
    this._mode.hidden = !holonomic;
  }

  /** Let go. */
  release() {
    this._stick.release();
  }

  /**
   * @param {boolean} useful Whether there is a robot that it could drive.
   * @param {boolean} dead Whether what is held now does nothing.
   */
  show(useful, dead) {
    const visible = useful && this.wanted;
    if (!visible) this._stick.release();
    this.element.hidden = !visible;
    this._pad.classList.toggle("dead", dead);
  }

  destroy() {
    this._stick.destroy();
  }
}
