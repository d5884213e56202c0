/** @typedef {import('./item.js').Item} Item */

/** Everything that is drawn as dots, and when it must be drawn again. */
export class Dots {
  constructor() {
    /** @type {Set<Item>} */
    this._all = new Set();
    /** @type {Set<Item>} Those with new points. */
    this._undrawn = new Set();
    this._restyled = false;
  }

  /**
   * @param {Item} item
   * @param {number} unit Metres in one unit of `points`.
   * @param {Int16Array} points
   */
  set(item, unit, points) {
    item.setDots(unit, points);
    this._all.add(item);
    this._undrawn.add(item);
  }

  /** @param {Item} item */
  forget(item) {
    this._all.delete(item);
    this._undrawn.delete(item);
  }

  /** Styles may give other sizes now. */
  restyle() {
    this._restyled = true;
  }

  draw() {
    // All sizes are read before anything is drawn: styles are worked out once.
    for (const item of this._restyled ? this._all : this._undrawn) {
      if (!this._restyled && item.knowsDotSize) continue;
      if (item.readDotSize()) this._undrawn.add(item);
    }
    this._restyled = false;
    for (const item of this._undrawn) item.drawDots();
    this._undrawn.clear();
  }
}
