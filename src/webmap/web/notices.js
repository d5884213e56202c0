import { html } from "./tools/elements.js";

/** Milliseconds for which a dismissed failure is not shown again. */
const SILENCE = 60_000;
/** Milliseconds for which what is over stays visible, to be readable. */
const LINGER = 2000;
/** Most failures that are shown; the others are counted. */
const SHOWN = 3;
/** Most failures that are kept. */
const KEPT = 50;
/** Milliseconds between two checks whether notices cover something. */
const LOOK_PERIOD = 1000;
/** Controls and panels that notices must not cover. */
const TOOLS = "button, summary, input, select, textarea, a[href], .webmap-panel";

/** Sentences for the viewer, in a corner of the page; always plain text. */
export class Notices {
  constructor() {
    /** @type {HTMLElement | null} */
    this._box = null;
    this._others = html("div", "webmap-notice others");
    /** @type {Map<string, HTMLElement>} */
    this._shown = new Map();
    /** When each failure was dismissed. @type {Map<string, number>} */
    this._dismissed = new Map();
    /** Notices that are removed soon. @type {Map<string, number>} */
    this._leaving = new Map();
    /** The layout of the page when the notices were placed. */
    this._seen = "";
    addEventListener("resize", () => this._place());
    setInterval(() => this._place(), LOOK_PERIOD);
  }

  /**
   * Show a failure until it is dismissed; the same one is shown once, and not again
   * within a minute after it was dismissed.
   *
   * @param {string} text
   */
  error(text) {
    const since = performance.now() - (this._dismissed.get(text) ?? -Infinity);
    if (since < SILENCE) return;
    this._dismissed.delete(text);
    this.show(text, text, "alert");
  }

  /**
   * Show a problem until it is solved, in place of its previous text; never again after
   * it was dismissed. The server gives it another number when it occurs again long
   * after it was solved.
   *
   * @param {number} number
   * @param {string} text Empty if it is solved.
   */
  problem(number, text) {
    const key = problemKey(number);
    if (!text) {
      this.leave(key);
      return;
    }
    if (this._dismissed.has(key)) this._stay(key);
    else this.show(key, text, "alert");
  }

  /** Remove every problem that is not reported again soon. */
  recheckProblems() {
    for (const key of this._shown.keys()) if (isProblem(key)) this.leave(key);
  }

  /**
   * Show a state until {@link hide}.
   *
   * @param {string} key
   * @param {string} text
   * @param {"status" | "alert"} [role]
   * @param {{name: string, act: () => void} | null} [action] A button of the notice.
   */
  show(key, text, role = "status", action = null) {
    this._stay(key);
    const known = this._shown.get(key);
    if (known) {
      const words = known.firstElementChild;
      if (words && words.textContent !== text) words.textContent = text;
      this._place();
      return;
    }
    const words = html("span", "", {}, text);
    const notice = html("div", `webmap-notice ${role}`, { role }, words);
    if (action) {
      const go = pressable(action.name, () => {
        this.hide(key);
        action.act();
      });
      go.className = "act";
      notice.append(go);
    }
    if (role === "alert" || action) notice.append(this._dismisser(key));
    this._shown.set(key, notice);
    this._open().append(notice);
    this._limit();
  }

  /** @param {string} key */
  hide(key) {
    this._stay(key);
    this._shown.get(key)?.remove();
    if (this._shown.delete(key)) this._limit();
  }

  /**
   * Hide a notice when there was time to read it.
   *
   * @param {string} key
   */
  leave(key) {
    if (!this._shown.has(key) || this._leaving.has(key)) return;
    this._leaving.set(key, setTimeout(() => this.hide(key), LINGER));
  }

  /** @param {string} key */
  _stay(key) {
    clearTimeout(this._leaving.get(key));
    this._leaving.delete(key);
  }

  /** @param {string} key */
  _dismisser(key) {
    const button = pressable("×", () => {
      this._dismissed.set(key, performance.now());
      this.hide(key);
    });
    button.setAttribute("aria-label", "Dismiss");
    return button;
  }

  _open() {
    if (!this._box?.isConnected) {
      this._box = html("div", "webmap-notices");
      document.body.append(this._box);
    }
    return this._box;
  }

  /** Show only the newest failures, and the number of the others. */
  _limit() {
    const failures = [...this._shown].filter(([, notice]) => isFailure(notice));
    for (const [key] of failures.slice(0, -KEPT)) {
      this._shown.get(key)?.remove();
      this._shown.delete(key);
    }
    this._place();
  }

  /** Place the notices over the map but over no tool; show fewer if space is short. */
  _place() {
    const area = this._shown.size > 0 && this._box ? mapOnScreen() : null;
    const tools = area && this._box ? toolsBeside(this._box) : [];
    const seen = JSON.stringify([area, tools, [...this._shown.keys()], this._texts()]);
    if (seen === this._seen) return;
    this._seen = seen;
    for (let count = SHOWN; count > 0; count -= 1) {
      this._show(count);
      if (this._lay(area, tools)) return;
    }
  }

  /**
   * @param {Box | null} area
   * @param {Box[]} tools
   * @returns {boolean} Whether there was room, or the layout is unknown.
   */
  _lay(area, tools) {
    const box = this._box;
    if (!box) return true;
    box.style.cssText = "";
    if (!area) return true;
    const place = freePlace(area, tools, (width) => {
      box.style.cssText = `left: 0; right: auto; width: ${width}px`;
      return box.offsetHeight;
    });
    box.style.cssText = place
      ? `inset: ${place.top}px auto auto ${place.left}px; width: ${place.width}px`
      : "";
    return place !== null;
  }

  /** @param {number} count Number of failures to show. */
  _show(count) {
    const failures = [...this._shown.values()].filter(isFailure);
    const others = Math.max(0, failures.length - count);
    failures.forEach((notice, index) => (notice.hidden = index < others));
    this._others.textContent = `and ${others} more`;
    if (others > 0) this._open().append(this._others);
    else this._others.remove();
  }

  _texts() {
    return [...this._shown.values()].map(({ textContent }) => textContent);
  }
}

/**
 * @param {string} text
 * @param {() => void} act
 */
function pressable(text, act) {
  const button = html("button", "", { type: "button" }, text);
  button.addEventListener("click", act);
  return button;
}

/** @param {HTMLElement} notice */
function isFailure(notice) {
  return notice.classList.contains("alert");
}

/**
 * @param {HTMLElement} box
 * @returns {DOMRect[]} The boxes that notices must not cover.
 */
function toolsBeside(box) {
  return [...document.querySelectorAll(TOOLS)]
    .filter((tool) => !box.contains(tool) && isVisible(tool))
    .map((tool) => tool.getBoundingClientRect());
}

/** @returns {DOMRect | null} The part of the largest map that is in the window. */
function mapOnScreen() {
  const maps = [...document.querySelectorAll("svg.webmap")].map((map) => {
    const { left, top, right, bottom } = map.getBoundingClientRect();
    const [x, y] = [Math.max(0, left), Math.max(0, top)];
    const width = Math.max(0, Math.min(innerWidth, right) - x);
    return new DOMRect(x, y, width, Math.max(0, Math.min(innerHeight, bottom) - y));
  });
  const [largest] = maps.sort((a, b) => b.width * b.height - a.width * a.height);
  return largest ?? null;
}

/** @param {Element} element */
function isVisible(element) {
  // A collapsed element has a size too. The size of what the browser leaves out
  // because it is out of view costs a layout for each element.
  const options = { visibilityProperty: true, contentVisibilityAuto: true };
  if (element.checkVisibility?.(options) === false) return false;
  const { width, height } = element.getBoundingClientRect();
  return width > 0 && height > 0;
}

const PROBLEM = "problem ";

/** @param {number} number */
function problemKey(number) {
  return PROBLEM + number;
}

/** @param {string} key */
function isProblem(key) {
  return key.startsWith(PROBLEM);
}

/**
 * @typedef {object} Box
 * @property {number} left
 * @property {number} top
 * @property {number} right
 * @property {number} bottom
 */

/** Distance between notices and elements that they must not cover, in pixels. */
export const GAP = 16;
/** Least and greatest width of notices, in pixels. */
const LEAST = 240;
const MOST = 704;

/**
 * Return the highest place where notices cover no control.
 *
 * @param {Box} area The area for notices, in pixels of the window, like all values.
 * @param {Box[]} taken The boxes that must not be covered.
 * @param {(width: number) => number} heightOf Returns their height for a width.
 * @returns {{left: number, top: number, width: number} | null} null if there is no room.
 */
export function freePlace(area, taken, heightOf) {
  const near = taken.filter((box) => meets(box, area));
  const tops = [area.top, ...near.map(({ bottom }) => bottom)].map((y) => y + GAP);
  for (const top of tops.sort((a, b) => a - b)) {
    const place = placeAt(top, area, near, heightOf);
    if (place) return place;
  }
  return null;
}

/**
 * @param {number} top
 * @param {Box} area
 * @param {Box[]} taken
 * @param {(width: number) => number} heightOf
 */
function placeAt(top, area, taken, heightOf) {
  let bottom = top;
  // Next to a box there is less width, and narrower notices are higher.
  for (let tries = 0; tries < 4; tries += 1) {
    const beside = taken.filter((box) => box.top < bottom + GAP && box.bottom > top - GAP);
    const [left, right] = widestSpan(area, beside);
    const width = Math.min(right - left, MOST);
    if (width < LEAST) return null;
    const needed = top + heightOf(width);
    if (needed > area.bottom - GAP) return null;
    if (needed <= bottom) return { left: (left + right - width) / 2, top, width };
    bottom = needed;
  }
  return null;
}

/**
 * @param {Box} area
 * @param {Box[]} taken
 * @returns {[number, number]} The widest free part from left to right.
 */
function widestSpan(area, taken) {
  /** @type {[number, number]} */
  let widest = [0, 0];
  let left = area.left + GAP;
  const end = { left: area.right, right: area.right };
  for (const box of [...taken.sort((a, b) => a.left - b.left), end]) {
    const right = box.left - GAP;
    if (right - left > widest[1] - widest[0]) widest = [left, right];
    left = Math.max(left, box.right + GAP);
  }
  return widest;
}

/**
 * @param {Box} one
 * @param {Box} other
 */
export function meets(one, other) {
  const across = one.left < other.right && other.left < one.right;
  return across && one.top < other.bottom && other.top < one.bottom;
}
