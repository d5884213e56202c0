/** A second press that comes sooner is the other half of a double click; ms. */
export const SOONEST = 400;

/** After this long the first press is forgotten; ms. */
export const LATEST = 4000;

/**
 * Decides whether something was meant: it has to be said twice, neither too fast nor
 * too slowly.
 *
 * Times are in milliseconds of one clock.
 */
export class DoublePress {
  constructor() {
    /** @type {number | null} */
    this._since = null;
    /**
     * What the first press was said of, as far as it is still there.
     * @type {readonly string[]}
     */
    this.meant = [];
  }

  /**
   * @param {number} now
   * @param {readonly string[]} [there] What a first press is said of: robots by id, or
   *     their STOPs.
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
   * Look what is there now: something that the first press was not said of takes it back.
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
