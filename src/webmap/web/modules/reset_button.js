import { Twice } from "../motion/twice.js";
import { button, say } from "./elements.js";

/**
 * A button that ends a STOP when it is pressed twice, deliberately.
 *
 * Its first press asks in words for the second, so that it works alike for a finger, a
 * mouse, a keyboard and a screen reader. Enter presses it; Space is STOP everywhere.
 */
export class ResetButton {
  /** @param {() => void} reset */
  constructor(reset) {
    this._twice = new Twice();
    this._label = "Reset";
    this.element = button("webmap-reset", this._label, () => {
      if (this._twice.press(performance.now())) reset();
      this.show(this._label);
    });
    this.element.addEventListener("blur", () => {
      this._twice.forget();
      this.show(this._label);
    });
  }

  /**
   * @param {string} label What it says before it is pressed.
   * @param {boolean} [visible]
   */
  show(label, visible = !this.element.hidden) {
    this._label = label;
    this.element.hidden = !visible;
    if (!visible) this._twice.forget();
    const waiting = visible && this._twice.waiting(performance.now());
    this.element.classList.toggle("asking", waiting);
    say(this.element, waiting ? "Press again to reset" : label);
  }
}
