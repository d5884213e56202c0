/** @typedef {import('./view.js').Point} Point */

/** Pixels that nobody sees. */
const UNSEEN = 0.01;

/** Keeps an element of the world at one place of the screen. */
export class Following {
  constructor() {
    /** The element, or 0. */
    this.id = 0;
    /** @type {Point | null} Where on the screen it stays. */
    this._place = null;
  }

  /** @param {number} id The element to follow, or 0. */
  start(id) {
    this.id = id;
    this._place = null;
  }

  /** @param {Point | null} place Where the element is, to stay there. */
  settle(place) {
    this._place = this.id ? place : null;
  }

  /**
   * @param {Point | null} place Where the element is now.
   * @returns {Point | null} By how much the view is to be shifted, if it is.
   */
  shift(place) {
    if (!place || !this.id) return null;
    this._place ??= place;
    const [x, y] = [this._place.x - place.x, this._place.y - place.y];
    return Math.hypot(x, y) < UNSEEN ? null : { x, y };
  }
}
