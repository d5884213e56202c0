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
export class Twice {
  constructor() {
    /** @type {number | null} */
    this._since = null;
  }

  /**
   * @param {number} now
   * @returns {boolean} Whether this is a deliberate second press.
   */
  press(now) {
    if (!this.waiting(now)) {
      this._since = now;
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

  /** Forget the first press. */
  forget() {
    this._since = null;
  }
}
