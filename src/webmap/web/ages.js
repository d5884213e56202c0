/** @typedef {import('./item.js').Item} Item */

/**
 * @typedef {object} Age
 * @property {number | null} measured Milliseconds of the display's clock; null: never.
 * @property {number} limit Seconds after which the data counts as old.
 * @property {boolean} shown Whether the age is the element's text.
 * @property {boolean | null} stale Whether it was old when last looked at.
 */

/** Milliseconds between two looks. */
const PERIOD = 250;

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

/** Counts how old things are, whether the display is there or not. */
export class Ages {
  /**
   * @param {DisplayClock} clock
   * @param {() => void} onStale Called when something became old, or fresh again.
   */
  constructor(clock, onStale) {
    this._clock = clock;
    this._onStale = onStale;
    /** @type {Map<Item, Age>} */
    this._ages = new Map();
    /** @type {Set<Item>} */
    this._urgent = new Set();
    this._timer = setInterval(() => this._show(this._ages.keys()), PERIOD);
  }

  /**
   * @param {Item} item
   * @param {number | null} measured
   */
  set(item, measured) {
    const age = this._of(item);
    age.measured = measured;
    // What looks old and is fresh again is not kept waiting.
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

  /** Show at once what cannot wait for the next look. */
  flush() {
    if (this._urgent.size === 0) return;
    this._show(this._urgent);
    this._urgent.clear();
  }

  stop() {
    clearInterval(this._timer);
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

  /** @param {Iterable<Item>} items */
  _show(items) {
    const now = this._clock.at(performance.now() / 1000);
    let changed = false;
    for (const item of items) {
      const age = this._ages.get(item);
      if (age) changed = showAge(item, age, now) || changed;
    }
    if (changed) this._onStale();
  }
}

/**
 * @param {Item} item
 * @param {Age} age
 * @param {number | null} now The display's clock, in seconds.
 * @returns {boolean} Whether it became old, or fresh again.
 */
function showAge(item, age, now) {
  const { measured } = age;
  const known = now !== null && measured !== null;
  const seconds = known ? Math.max(0, now - measured / 1000) : Infinity;
  item.showAge(known ? seconds.toFixed(1) : "", age.shown ? formatAge(seconds) : null);
  const stale = seconds > age.limit;
  const changed = stale !== age.stale;
  if (changed) item.element.classList.toggle("stale", stale);
  age.stale = stale;
  return changed;
}

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
