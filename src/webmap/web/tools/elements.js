import { Twice } from "../motion/twice.js";

/**
 * Make an HTML element.
 *
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {string} className
 * @param {Record<string, string>} [attributes]
 * @param {...(Node | string)} children Strings are text, never markup.
 * @returns {HTMLElementTagNameMap[K]}
 */
export function html(tag, className, attributes = {}, ...children) {
  const element = document.createElement(tag);
  element.className = className;
  for (const [name, value] of Object.entries(attributes)) {
    element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/**
 * Make an SVG element.
 *
 * @template {keyof SVGElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, string>} attributes
 * @param {...Node} children
 * @returns {SVGElementTagNameMap[K]}
 */
export function svg(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) {
    element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/**
 * Make a button.
 *
 * @param {string} className
 * @param {string} label
 * @param {(event: MouseEvent) => void} act
 * @returns {HTMLButtonElement}
 */
export function button(className, label, act) {
  const element = html(
    "button",
    `webmap-button ${className}`,
    { type: "button" },
    label,
  );
  element.addEventListener("click", act);
  return element;
}

/**
 * Make a button that acts as soon as it is touched: STOP waits for no release.
 *
 * A finger beside another one, one that rests, and one under which the page is made
 * anew never make a click. Keyboards and assistive technology make nothing else.
 *
 * @param {string} className
 * @param {string} label
 * @param {() => void} act
 * @returns {HTMLButtonElement}
 */
export function stopButton(className, label, act) {
  /** @type {number | null} */
  let pressed = null;
  const element = button(`webmap-stop-button ${className}`, label, (event) => {
    // A press that has acted may end in a click.
    const { pointerId } = /** @type {PointerEvent} */ (event);
    const acted = pointerId === pressed;
    pressed = null;
    if (!acted) act();
  });
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || element.disabled) return;
    pressed = event.pointerId;
    act();
  });
  // A mouse is one pointer for ever: what is pressed and left is no click that comes.
  element.addEventListener("pointerleave", (event) => {
    if (event.pointerType === "mouse") pressed = null;
  });
  return element;
}

/**
 * Change an element's text, and nothing when it is the same: a screen reader reads a
 * live region again for every change.
 *
 * @param {Element} element
 * @param {string} text
 */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

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
