import { Twice } from "../motion/twice.js";
import { button, say } from "./elements.js";

/**
 * A button that acts when it is pressed twice, deliberately.
 *
 * Its first press asks in words for the second, so that it works alike for a finger, a
 * mouse, a keyboard and a screen reader. Enter presses it; Space is STOP everywhere.
 */
export class TwiceButton {
  /**
   * @param {string} className
   * @param {string} label What it says before it is pressed.
   * @param {string} again What it says after the first press.
   * @param {() => void} act
   */
  constructor(className, label, again, act) {
    this._twice = new Twice();
    this._label = label;
    this._again = again;
    this.element = button(`webmap-twice ${className}`, label, () => {
      if (this._twice.press(performance.now())) act();
      this.show(true);
    });
    this.element.addEventListener("blur", () => {
      this._twice.forget();
      this.show(!this.element.hidden);
    });
  }

  /**
   * @param {boolean} visible
   * @param {string} [label]
   */
  show(visible, label = this._label) {
    this._label = label;
    this.element.hidden = !visible;
    if (!visible) this._twice.forget();
    const waiting = visible && this._twice.waiting(performance.now());
    this.element.classList.toggle("asking", waiting);
    say(this.element, waiting ? this._again : label);
  }
}
