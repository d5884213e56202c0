/** How long a failure that was dismissed is not shown again, in milliseconds. */
const SILENCE = 60_000;
/** How long what was mended is still shown: it can be read, and does not flicker. */
const LINGER = 2000;
/** How many failures are shown; the others are counted. */
const SHOWN = 3;
/** How many failures are kept at all. */
const KEPT = 50;

/** Sentences for the viewer, in a corner of the page; text, whatever is in it. */
export class Notices {
  constructor() {
    /** @type {HTMLElement | null} */
    this._box = null;
    this._others = document.createElement("div");
    this._others.className = "webmap-notice others";
    /** @type {Map<string, HTMLElement>} */
    this._shown = new Map();
    /** When each failure was dismissed. @type {Map<string, number>} */
    this._dismissed = new Map();
    /** What was mended and goes soon. @type {Map<string, number>} */
    this._leaving = new Map();
  }

  /**
   * Show a failure until it is dismissed; the same one is shown once, and not again
   * in the minute after it was dismissed.
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
   * Show what fails until it is mended, in place of what was said of it before; never
   * again once it was dismissed. The server gives it another number when it fails anew
   * long after it was mended.
   *
   * @param {number} number
   * @param {string} text Empty if it is mended.
   */
  problem(number, text) {
    const key = problemKey(number);
    if (!text) {
      this._leave(key);
      return;
    }
    this._stay(key);
    if (!this._dismissed.has(key)) this.show(key, text, "alert");
  }

  /** Take back every problem that is not told again soon. */
  doubtProblems() {
    for (const key of this._shown.keys()) if (isProblem(key)) this._leave(key);
  }

  /**
   * Show a state until {@link hide}.
   *
   * @param {string} key
   * @param {string} text
   * @param {"status" | "alert"} [role]
   */
  show(key, text, role = "status") {
    const known = this._shown.get(key);
    if (known) {
      const words = known.firstElementChild;
      if (words && words.textContent !== text) words.textContent = text;
      return;
    }
    const notice = document.createElement("div");
    notice.className = `webmap-notice ${role}`;
    notice.setAttribute("role", role);
    const words = document.createElement("span");
    words.textContent = text;
    notice.append(words);
    if (role === "alert") notice.append(this._dismisser(key));
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

  /** @param {string} key */
  _leave(key) {
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
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "×";
    button.setAttribute("aria-label", "Dismiss");
    button.addEventListener("click", () => {
      this._dismissed.set(key, performance.now());
      this.hide(key);
    });
    return button;
  }

  _open() {
    if (!this._box?.isConnected) {
      this._box = document.createElement("div");
      this._box.className = "webmap-notices";
      document.body.append(this._box);
    }
    return this._box;
  }

  /** A page full of failures tells no more than its newest, and how many there are. */
  _limit() {
    const failures = [...this._shown].filter(([, notice]) =>
      notice.classList.contains("alert"),
    );
    for (const [key] of failures.splice(0, failures.length - KEPT)) {
      this._shown.get(key)?.remove();
      this._shown.delete(key);
    }
    const others = Math.max(0, failures.length - SHOWN);
    failures.forEach(([, notice], index) => (notice.hidden = index < others));
    if (others > 0) this._open().append(this._others);
    else this._others.remove();
    this._others.textContent = `and ${others} more`;
  }
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
