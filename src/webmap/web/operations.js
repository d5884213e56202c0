import { fit, rotate, scale, translate } from "./view.js";

/** @typedef {import('./view.js').Matrix} Matrix */

/**
 * What an operation comes to; what it leaves alone is not there.
 *
 * @typedef {object} Outcome
 * @property {Matrix} [view]
 * @property {number} [follow] The element to follow from now on; 0 for none.
 */

/**
 * Decide what an operation of a program makes of a view. Where no point is given, the
 * middle is meant.
 *
 * @param {Matrix} view
 * @param {{width: number, height: number}} size Pixels.
 * @param {string} operation
 * @param {number[]} args
 * @returns {Outcome} Nothing for an operation that is not known here.
 */
export function operated(view, { width, height }, operation, args) {
  const [first, x = width / 2, y = height / 2] = args;
  switch (operation) {
    case "follow":
      return { follow: first };
    case "translate":
      return { view: translate(view, first, args[1]) };
    case "scale":
      return { view: scale(view, first, x, y) };
    case "rotate":
      return { view: rotate(view, first, x, y) };
    case "fit": {
      const [x0, y0, x1, y1] = args;
      return { view: fit(view, [x0, y0, x1, y1], width, height), follow: 0 };
    }
    case "set": {
      const [a, b, c, d, e, f] = args;
      return { view: { a, b, c, d, e, f }, follow: 0 };
    }
    default:
      return {};
  }
}

/**
 * The operations that came for a map: each is carried out once, and not before the map
 * has a size.
 */
export class Operations {
  constructor() {
    /** The number of the newest that came. */
    this.applied = 0;
    /** @type {Array<() => void>} */
    this._waiting = [];
  }

  /**
   * An operation came, or is known to have been carried out.
   *
   * @param {number} number Counts operations.
   * @returns {boolean} Whether it is a new one.
   */
  reach(number) {
    if (number <= this.applied) return false;
    this.applied = number;
    return true;
  }

  /**
   * @param {boolean} sized Whether the map has a size.
   * @param {() => void} operate
   */
  whenSized(sized, operate) {
    if (sized) operate();
    else this._waiting.push(operate);
  }

  /** The map has a size: do what waited for that, in order. */
  goOn() {
    for (const operate of this._waiting.splice(0)) operate();
  }
}
