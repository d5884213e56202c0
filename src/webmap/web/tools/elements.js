/** Elements of pages: how they are made, changed and pressed. */

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
  return filled(element, attributes, children);
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
  return filled(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

/**
 * @template {Element} E
 * @param {E} element
 * @param {Record<string, string>} attributes
 * @param {(Node | string)[]} children
 */
function filled(element, attributes, children) {
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
 * Make a button that acts at the press: STOP does not wait for the release.
 *
 * A second finger, a resting finger, and a finger on an element that is replaced never
 * make a click. Keyboards and assistive technology only make clicks.
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
  // A mouse keeps its pointer id: a press that left the button has no click here.
  element.addEventListener("pointerleave", (event) => {
    if (event.pointerType === "mouse") pressed = null;
  });
  return element;
}

/**
 * Set an element's text only if it differs: a screen reader reads a live region again
 * at every change. A text node that is there already is changed: another node would make
 * the browser evaluate every `:has()` again.
 *
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent === text) return;
  const { firstChild: only } = element;
  if (text !== "" && only?.nodeName === "#text" && !only.nextSibling) only.nodeValue = text;
  else element.textContent = text;
}

/**
 * Hide or show an element, only if that differs: the browser computes styles after each
 * writing of the attribute, also of the same value.
 *
 * @param {HTMLElement} element
 * @param {boolean} hidden
 */
export function setHidden(element, hidden) {
  if (element.hidden !== hidden) element.hidden = hidden;
}

/**
 * Set an attribute only if it differs, as {@link setHidden}. `toggleAttribute()` writes
 * only a difference, too.
 *
 * @param {Element} element
 * @param {string} name
 * @param {string} value
 */
export function setAttribute(element, name, value) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

/**
 * Put children into an order.
 *
 * @param {Element} parent
 * @param {Element[]} children A child that has its place already is not moved, to keep
 *     the focus.
 */
export function keepOrder(parent, children) {
  children.forEach((child, index) => {
    const there = parent.children[index];
    if (there !== child) parent.insertBefore(child, there ?? null);
  });
}

/**
 * Forget what is known of things that have disappeared.
 *
 * @template K, V
 * @param {Map<K, V>} known
 * @param {{has: (key: K) => boolean}} there A set or a map of what is there.
 * @param {(value: V) => void} remove Called with each value that is forgotten.
 */
export function forgetOthers(known, there, remove) {
  for (const [key, value] of known) {
    if (there.has(key)) continue;
    remove(value);
    known.delete(key);
  }
}

/** @type {Intl.Collator | undefined} Made at its first use, which takes 15 ms. */
let collator;

/**
 * Compare names as people order them: "robot 9" before "robot 10".
 *
 * @param {string} one
 * @param {string} other
 */
export function inOrder(one, other) {
  collator ??= new Intl.Collator(undefined, { numeric: true });
  return collator.compare(one, other);
}

/** Milliseconds of a beat. */
const BEAT = 250;

/** @type {Map<() => void, number>} The functions of each beat, with their periods. */
const onBeats = new Map();
let beats = 0;
/** @type {ReturnType<typeof setInterval> | undefined} */
let beating;

/**
 * Call a function periodically, at the same time as the others: the browser wakes up
 * once for all of them, and draws one frame with all that they change.
 *
 * @param {() => void} fn
 * @param {number} [period] In beats of 250 ms.
 * @returns {() => void} Ends the calls.
 */
export function onBeat(fn, period = 1) {
  onBeats.set(fn, period);
  beating ??= setInterval(beat, BEAT);
  return () => {
    onBeats.delete(fn);
    if (onBeats.size > 0) return;
    clearInterval(beating);
    beating = undefined;
  };
}

function beat() {
  beats += 1;
  for (const [fn, period] of onBeats) {
    try {
      if (beats % period === 0) fn();
    } catch (error) {
      reportError(error);
    }
  }
}

/**
 * A button that acts when it is pressed twice, deliberately.
 *
 * After the first press its label requests the second, so that it works the same with a
 * finger, a mouse, a keyboard and a screen reader. Enter presses it; Space is STOP
 * everywhere.
 */
export class TwiceButton {
  /**
   * @param {string} className
   * @param {string} label Its label before the first press.
   * @param {string} again Its label after the first press.
   * @param {(meant: readonly string[]) => void} act Called with the robots, or their
   *     STOPs, that were there at the first press and still are.
   */
  constructor(className, label, again, act) {
    this._doublePress = new DoublePress();
    /** @type {readonly string[]} */
    this._robots = [];
    this._label = label;
    this._again = again;
    this.element = button(`webmap-twice ${className}`, label, () => {
      if (this._doublePress.press(performance.now(), this._robots)) act(this._doublePress.meant);
      this.show(true);
    });
    this.element.addEventListener("blur", () => {
      this.forget();
      this.show(!this.element.hidden);
    });
  }

  /** Forget the first press. */
  forget() {
    this._doublePress.forget();
  }

  /**
   * @param {boolean} visible
   * @param {readonly string[]} [robots] What a press applies to: ids of robots, or of
   *     their STOPs. A new or other one cancels the first press.
   * @param {string} [label]
   */
  show(visible, robots = this._robots, label = this._label) {
    this._robots = robots;
    this._label = label;
    setHidden(this.element, !visible);
    this._doublePress.look(robots);
    if (!visible) this.forget();
    const waiting = visible && this._doublePress.waiting(performance.now());
    this.element.classList.toggle("asking", waiting);
    setText(this.element, waiting ? this._again : label);
  }
}

/** An earlier second press belongs to a double click; ms. */
export const SOONEST = 400;

/** After this long the first press is forgotten; ms. */
export const LATEST = 4000;

/**
 * Decides whether the operator confirms an action: by two presses, neither too fast nor
 * too slow.
 *
 * Times are in milliseconds of one clock.
 */
export class DoublePress {
  constructor() {
    /** @type {number | null} */
    this._since = null;
    /**
     * What the first press applies to, without what has disappeared since.
     * @type {readonly string[]}
     */
    this.meant = [];
  }

  /**
   * @param {number} now
   * @param {readonly string[]} [there] What a first press applies to: ids of robots, or
   *     of their STOPs.
   * @returns {boolean} Whether this is a deliberate second press.
   */
  press(now, there = []) {
    if (!this.waiting(now)) {
      this._since = now;
      this.meant = there;
      return false;
    }
    if (now - Number(this._since) < SOONEST) return false;
    this._since = null;
    return true;
  }

  /**
   * @param {number} now
   * @returns {boolean} Whether a first press waits for the second.
   */
  waiting(now) {
    return this._since !== null && now >= this._since && now - this._since <= LATEST;
  }

  /**
   * Forget the first press if something appeared that it does not apply to.
   *
   * @param {readonly string[]} there
   */
  look(there) {
    if (there.some((one) => !this.meant.includes(one))) this.forget();
    else this.meant = there;
  }

  /** Forget the first press. */
  forget() {
    this._since = null;
  }
}

/** @param {string} id */
export function byId(id) {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`console.html has no element "${id}".`);
  return element;
}

/** @param {KeyboardEvent} event */
export function typing({ target }) {
  return target instanceof Element && target.matches("input, textarea, select");
}

/** Close the sheet, if it covers the map. */
export function closeSheet() {
  byId("sheet").setAttribute("aria-expanded", "false");
}

/**
 * @param {number} time Unix seconds.
 * @param {boolean} [exact] Whether with seconds.
 * @returns {string} The time of day; with the date if it is not today.
 */
export function clock(time, exact = false) {
  const date = new Date(time * 1000);
  // Formats of a language take 15 ms to make.
  const local = new Date((time - 60 * date.getTimezoneOffset()) * 1000).toISOString();
  const shown = local.slice(11, exact ? 19 : 16);
  const today = date.toDateString() === new Date().toDateString();
  return today ? shown : `${local.slice(0, 10)} ${shown}`;
}
