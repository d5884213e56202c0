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
   * @param {(meant: readonly string[]) => void} act Called with the robots, or their
   *     STOPs, that the first press was said of and that are still there.
   */
  constructor(className, label, again, act) {
    this._twice = new Twice();
    /** @type {readonly string[]} */
    this._robots = [];
    this._label = label;
    this._again = again;
    this.element = button(`webmap-twice ${className}`, label, () => {
      if (this._twice.press(performance.now(), this._robots)) act(this._twice.meant);
      this.show(true);
    });
    this.element.addEventListener("blur", () => {
      this.forget();
      this.show(!this.element.hidden);
    });
  }

  /** Forget the first press. */
  forget() {
    this._twice.forget();
  }

  /**
   * @param {boolean} visible
   * @param {readonly string[]} [robots] What a press is said of: robots by id, or their
   *     STOPs. The first press is forgotten when there is one more, or another.
   * @param {string} [label]
   */
  show(visible, robots = this._robots, label = this._label) {
    this._robots = robots;
    this._label = label;
    this.element.hidden = !visible;
    this._twice.look(robots);
    if (!visible) this.forget();
    const waiting = visible && this._twice.waiting(performance.now());
    this.element.classList.toggle("asking", waiting);
    say(this.element, waiting ? this._again : label);
  }
}
