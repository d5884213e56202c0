/** If an answer is older than this, commands may not arrive in time; ms. */
export const LATE = 300;

/** Without a tick for this time the connection is given up; ms. */
export const LOST = 500;

/** The time between two ticks to a page that may drive; ms. */
export const PAUSE = 50;

/** The most commands that may wait for an acknowledgement. */
const REMEMBERED = 256;

/**
 * Measures the loop from this page to the gate and back.
 *
 * The gate sends ticks at 20 Hz, or at 2 Hz to a page that may not drive, each with the
 * number of the last command of this page that it accepted. These show a stall;
 * `WebSocket.bufferedAmount` stays 0 during a stall of seconds. Times are in milliseconds
 * of the caller's clock.
 */
export class Loop {
  constructor() {
    /** Milliseconds between two ticks. */
    this.pause = PAUSE;
    /**
     * The newest tick, which every command contains; null before the first.
     * @type {number | null}
     */
    this.tick = null;
    /**
     * The time from the newest acknowledged command to its acknowledgement, in ms.
     * @type {number | null}
     */
    this.delay = null;
    this._tickAt = -Infinity;
    this._acked = -1;
    /**
     * When each command that is not acknowledged yet was sent, oldest first.
     * @type {Map<number, number>}
     */
    this._waiting = new Map();
  }

  /**
   * Start again, for a connection that has just opened.
   *
   * @param {number} now
   */
  open(now) {
    this.tick = null;
    this._tickAt = now;
    this._acked = -1;
    this.rest();
  }

  /**
   * Process a tick.
   *
   * @param {number} tick
   * @param {number} ack The newest accepted command of this page, or -1.
   * @param {number} now
   */
  receive(tick, ack, now) {
    this.tick = tick;
    this._tickAt = now;
    if (ack <= this._acked) return;
    this._acked = ack;
    for (const [seq, sentAt] of this._waiting) {
      if (seq > ack) break;
      this.delay = now - sentAt;
      this._waiting.delete(seq);
    }
  }

  /**
   * Expect the acknowledgement of a command that was sent now.
   *
   * @param {number} seq
   * @param {number} now
   */
  sent(seq, now) {
    // With so many, the oldest already shows that the loop is late.
    if (this._waiting.size < REMEMBERED) this._waiting.set(seq, now);
  }

  /** Stop measuring: no more commands are sent. */
  rest() {
    this._waiting.clear();
    this.delay = null;
  }

  /**
   * @param {number} seq
   * @returns {boolean} Whether the gate has accepted this command or a later one.
   */
  acknowledged(seq) {
    return this._acked >= seq;
  }

  /**
   * @param {number} now
   * @returns {number} How long the oldest command has waited for its acknowledgement, in
   *     ms; 0 if there is none.
   */
  age(now) {
    const [oldest] = this._waiting.values();
    return oldest === undefined ? 0 : now - oldest;
  }

  /**
   * @param {number} now
   * @returns {'open' | 'late' | 'lost'}
   */
  state(now) {
    // A clock that was set back would hide a silence.
    if (now < this._tickAt) return "lost";
    const silence = now - this._tickAt - (this.pause - PAUSE);
    if (silence > LOST) return "lost";
    return silence > LATE || this.age(now) > LATE ? "late" : "open";
  }
}
