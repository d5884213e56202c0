import { onBeat } from "./tools/elements.js";

/** @typedef {import('./item.js').Item} Item */

/**
 * @typedef {object} Age
 * @property {number | null} measured Milliseconds of the display's clock; null: never.
 * @property {number} limit Seconds after which the data is stale.
 * @property {boolean} shown Whether the element shows the age as text.
 * @property {boolean | null} stale Whether the data was stale at the last update.
 */

/** With more ages than this, only every other update writes those that are not new. */
const MANY = 200;

/**
 * @param {number} seconds
 * @returns {string}
 */
function formatAge(seconds) {
  if (!Number.isFinite(seconds)) return "no data";
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 100) return `${Math.round(seconds)} s`;
  if (seconds < 6000) return `${Math.round(seconds / 60)} min`;
  return `${Math.round(seconds / 3600)} h`;
}

/** Shows the ages of data, with or without a connection to the display. */
export class Ages {
  /**
   * @param {DisplayClock} clock
   * @param {() => void} onStale Called when data became stale, or fresh again.
   */
  constructor(clock, onStale) {
    this._clock = clock;
    this._onStale = onStale;
    /** @type {Map<Item, Age>} */
    this._ages = new Map();
    /** @type {Set<Item>} */
    this._urgent = new Set();
    this._looks = 0;
    /** Ends the updates. */
    this.stop = onBeat(() => this._look());
  }

  _look() {
    this._looks++;
    this._show(this._ages.keys(), this._ages.size <= MANY || this._looks % 2 === 0);
  }

  /**
   * @param {Item} item
   * @param {number | null} measured
   */
  set(item, measured) {
    const age = this._of(item);
    age.measured = measured;
    // Stale data that becomes fresh again is updated immediately.
    if (age.stale !== false) this._urgent.add(item);
  }

  /**
   * @param {Item} item
   * @param {number} limit
   * @param {boolean} shown
   */
  limit(item, limit, shown) {
    Object.assign(this._of(item), { limit, shown });
    this._urgent.add(item);
  }

  /** @param {Item} item */
  forget(item) {
    this._ages.delete(item);
    this._urgent.delete(item);
  }

  /** Update urgent items immediately. */
  flush() {
    if (this._urgent.size === 0) return;
    this._show(this._urgent, true);
    this._urgent.clear();
  }

  /**
   * @param {Item} item
   * @returns {Age}
   */
  _of(item) {
    const known = this._ages.get(item);
    if (known) return known;
    const age = { measured: null, limit: 1, shown: false, stale: null };
    this._ages.set(item, age);
    return age;
  }

  /**
   * @param {Iterable<Item>} items
   * @param {boolean} all Whether to write ages of data that is as stale as before, too.
   */
  _show(items, all) {
    const now = this._clock.at(performance.now() / 1000);
    let changed = false;
    for (const item of items) {
      const age = this._ages.get(item);
      if (age) changed = showAge(item, age, now, all) || changed;
    }
    if (changed) this._onStale();
  }
}

/**
 * @param {Item} item
 * @param {Age} age
 * @param {number | null} now The display's clock, in seconds.
 * @param {boolean} all Whether to write it also if nothing became stale, or fresh.
 * @returns {boolean} Whether the data became stale, or fresh again.
 */
function showAge(item, age, now, all) {
  const { measured } = age;
  const known = now !== null && measured !== null;
  const seconds = known ? Math.max(0, now - measured / 1000) : Infinity;
  const stale = seconds > age.limit;
  const changed = stale !== age.stale;
  if (all || changed) {
    item.showAge(known ? seconds.toFixed(1) : "", age.shown ? formatAge(seconds) : null);
  }
  if (changed) {
    item.element.classList.toggle("stale", stale);
    item.crowd?.changed(item.element);
  }
  age.stale = stale;
  return changed;
}

/**
 * Computes the display's monotonic clock from the frames that it sends.
 *
 * A frame cannot arrive before it was sent, so the fastest frame gives the best
 * estimate. The estimate is forgotten slowly, because the two clocks drift. The delay
 * of a frame counts as age of its data.
 */
export class DisplayClock {
  constructor() {
    /** @type {number | null} Seconds by which this page's clock is ahead. */
    this._ahead = null;
    this._then = 0;
  }

  /**
   * @param {number} sent The display's clock when it sent a frame, in seconds.
   * @param {number} received This page's clock when the frame came, in seconds.
   */
  update(sent, received) {
    const ahead = received - sent;
    const drift = (received - this._then) * 1e-4;
    this._ahead = this._ahead === null ? ahead : Math.min(ahead, this._ahead + drift);
    this._then = received;
  }

  /** Forget the estimate, because another display may answer next. */
  reset() {
    this._ahead = null;
  }

  /**
   * @param {number} now This page's clock, in seconds.
   * @returns {number | null} The display's clock, in seconds; null if unknown.
   */
  at(now) {
    return this._ahead === null ? null : now - this._ahead;
  }
}
