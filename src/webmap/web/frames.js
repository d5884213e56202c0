/** How a page draws the frames of the display, and when it answers them. */

import { VersionError } from "./wire.js";

/** Frames in a row that may fail before the page stops requesting new ones. */
const FAILURES = 3;

/** Milliseconds that drawing may take in each frame of a display with 60 Hz. */
const CHEAP = 4;

/** Milliseconds between frames until which drawing takes a quarter of the time. */
const SLOW = 50;

/** The weight of the newest frame in the mean cost, and the most of it that counts. */
const NEWEST = 0.25;
const MOST = 100;

/**
 * When the page answers what it has drawn. The server sends no more than two frames
 * without an answer, so the answers decide how often they come: drawing takes a quarter
 * of the time; or up to half of it, so that there are 20 frames a second.
 */
export class AnswerPace {
  constructor() {
    this._cost = 0;
  }

  /**
   * @param {number} took Milliseconds for which drawing a frame occupied the page.
   */
  drawn(took) {
    this._cost += (Math.min(took, MOST) - this._cost) * NEWEST;
  }

  /** Milliseconds after drawing until the answer; 0 to answer before the painting. */
  get pause() {
    const cost = this._cost;
    return cost <= CHEAP ? 0 : Math.min(3 * cost, Math.max(cost, SLOW - cost));
  }
}

/** The frames that came and are not drawn yet. */
export class Frames {
  /**
   * @param {(data: ArrayBuffer, received: number) => number} apply Draws a frame that
   *     came at this time of the page's clock, in seconds; returns its number.
   * @param {(message: object) => void} send Sends to the server.
   * @param {(error: unknown, forGood: boolean) => void} onFailure Called if a frame
   *     cannot be read, and whether the next ones could not either.
   */
  constructor(apply, send, onFailure) {
    this._apply = apply;
    this._send = send;
    this._onFailure = onFailure;
    /** @type {Array<{data: ArrayBuffer, received: number}>} */
    this._waiting = [];
    this._drawing = 0;
    this._pace = new AnswerPace();
    this._failures = 0;
  }

  /** Whether there are some. */
  get wait() {
    return this._waiting.length > 0;
  }

  /**
   * @param {ArrayBuffer} data
   * @param {number} at When it came, by `performance.now()`.
   */
  add(data, at) {
    this._waiting.push({ data, received: at / 1000 });
  }

  clear() {
    this._waiting = [];
  }

  /** Draw them before the browser paints next. */
  drawSoon() {
    this._drawing ||= requestAnimationFrame(() => this.draw());
  }

  /** Draw them, and answer the newest. */
  draw() {
    this._drawing = 0;
    const begun = performance.now();
    let newest = 0;
    for (const { data, received } of this._waiting.splice(0)) {
      newest = this._tryToApply(data, received);
      if (newest === 0) break;
    }
    if (newest === 0) return;
    const answer = () => this._send({ op: "seen", frame: newest });
    const { pause } = this._pace;
    if (pause === 0) answer();
    // A timer runs after style, layout and painting of this frame.
    setTimeout(() => {
      this._pace.drawn(performance.now() - begun);
      if (pause > 0) setTimeout(answer, pause);
    });
  }

  /**
   * @param {ArrayBuffer} data
   * @param {number} received
   * @returns {number} The number of the frame; 0 if it was not valid.
   */
  _tryToApply(data, received) {
    try {
      const number = this._apply(data, received);
      this._failures = 0;
      return number;
    } catch (error) {
      this.clear();
      this._failures += 1;
      const forGood = error instanceof VersionError || this._failures >= FAILURES;
      this._onFailure(error, forGood);
      if (!forGood) this._send({ op: "resync" });
      return 0;
    }
  }
}
