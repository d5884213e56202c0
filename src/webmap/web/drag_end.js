/** Milliseconds for which the click that ends a drag may keep us waiting. */
const CLICK_PATIENCE = 500;

/**
 * Tells the click with which the browser ends a drag from one that somebody meant.
 *
 * Times are in milliseconds of one clock.
 */
export class DragEnd {
  constructor() {
    this._at = -Infinity;
  }

  /** @param {number} now A drag ended. */
  note(now) {
    this._at = now;
  }

  /** Something was pressed: the next click is its own. */
  forget() {
    this._at = -Infinity;
  }

  /**
   * @param {number} detail Of the click: how many there were in a row; 0 from a key.
   * @param {number} now
   * @returns {boolean} Whether the click is the end of a drag, and means nothing.
   */
  swallows(detail, now) {
    const waited = now - this._at;
    this.forget();
    // A click without a pointer comes from a key and ends no drag.
    return detail !== 0 && waited <= CLICK_PATIENCE;
  }
}
