/**
 * Tells the display's monotonic clock from the frames that it sends.
 *
 * A frame cannot come before it was sent, so of all frames the one that came quickest
 * tells best; that one is forgotten slowly, since two clocks drift. Whatever a frame
 * was late counts as age of what is in it.
 */
export class DisplayClock {
  constructor() {
    /** @type {number | null} Seconds that this page's clock is ahead. */
    this._ahead = null;
    this._then = 0;
  }

  /**
   * @param {number} sent The display's clock when it sent a frame, in seconds.
   * @param {number} received This page's clock when the frame came, in seconds.
   */
  hear(sent, received) {
    const ahead = received - sent;
    const drift = (received - this._then) * 1e-4;
    this._ahead = this._ahead === null ? ahead : Math.min(ahead, this._ahead + drift);
    this._then = received;
  }

  /** Forget what was heard, because another display may answer next. */
  reset() {
    this._ahead = null;
  }

  /**
   * @param {number} now This page's clock, in seconds.
   * @returns {number | null} The display's clock, in seconds; null if never heard.
   */
  at(now) {
    return this._ahead === null ? null : now - this._ahead;
  }
}
