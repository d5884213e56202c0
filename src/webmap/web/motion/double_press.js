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
