/** How long a failure that was dismissed is not shown again, in milliseconds. */
const SILENCE = 60_000;

/** Sentences for the viewer, in a corner of the page; text, whatever is in it. */
export class Notices {
  constructor() {
    /** @type {HTMLElement | null} */
    this._box = null;
    /** @type {Map<string, HTMLElement>} */
    this._shown = new Map();
    /** When each failure was dismissed. @type {Map<string, number>} */
    this._dismissed = new Map();
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
    this._shown.get(key)?.remove();
    this._shown.delete(key);
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

  /** A page full of failures tells no more than its newest. */
  _limit() {
    const failures = [...this._shown].filter(([, notice]) =>
      notice.classList.contains("alert"),
    );
    for (const [key] of failures.slice(0, -5)) this.hide(key);
  }
}
