/** Milliseconds after which a load that never tells its end holds up the next no more. */
const PATIENCE = 5000;

/**
 * Has an image load one address at a time: the newest, once the one before is there.
 *
 * A browser gives up a load for the next. An image that changes more quickly than it
 * loads would never be drawn; so it shows fewer of its versions, but each whole.
 */
export class Loading {
  /** @param {SVGImageElement | HTMLImageElement} element */
  constructor(element) {
    this._element = element;
    this._busy = false;
    /** @type {[string, string] | null} The attribute and address to load next. */
    this._next = null;
    this._patience = 0;
    element.addEventListener("load", () => this._done());
    element.addEventListener("error", () => this._done());
  }

  /**
   * @param {string} name The attribute that holds the address.
   * @param {string} address
   */
  show(name, address) {
    if (this._busy) this._next = [name, address];
    else this._load(name, address);
  }

  /** Load nothing more: the address was taken away. */
  cancel() {
    this._next = null;
    this._done();
  }

  /**
   * @param {string} name
   * @param {string} address
   */
  _load(name, address) {
    // The same address again is no new load, and would tell no end.
    if (this._element.getAttribute(name) === address) return;
    this._busy = true;
    this._patience = window.setTimeout(() => this._done(), PATIENCE);
    this._element.setAttribute(name, address);
  }

  _done() {
    window.clearTimeout(this._patience);
    this._busy = false;
    const next = this._next;
    this._next = null;
    if (next) this._load(...next);
  }
}
