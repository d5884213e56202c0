/** Older than this, and what comes back no longer says that a command arrives; ms. */
export const LATE = 300;

/** No tick for this long and the connection is given up; ms. */
export const LOST = 500;

/** How many commands may wait for their acknowledgement at once. */
const REMEMBERED = 256;

/**
 * The loop from this page to the gate and back: is it alive, and how old is it?
 *
 * The gate ticks at 20 Hz and says in each tick which command of ours it accepted
 * last. `WebSocket.bufferedAmount` stays 0 through a stall of seconds; these two do
 * not. Times are in milliseconds of one clock that the caller reads.
 */
export class Loop {
  constructor() {
    /**
     * The newest tick, to be echoed in every command; null before the first.
     * @type {number | null}
     */
    this.tick = null;
    /**
     * How long the newest acknowledgement took to come back, in ms.
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
   * Start anew, for a connection that opened at this moment.
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
   * Take a tick.
   *
   * @param {number} tick
   * @param {number} ack The newest command of ours that was accepted, or -1.
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
   * Expect the acknowledgement of a command that was sent at this moment.
   *
   * @param {number} seq
   * @param {number} now
   */
  sent(seq, now) {
    // Beyond this many the oldest one has said all that there is to say.
    if (this._waiting.size < REMEMBERED) this._waiting.set(seq, now);
  }

  /** Stop measuring: nothing is being sent any more. */
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
   * @returns {number} For how long the oldest command waits to be acknowledged, in
   *     ms; 0 when none does.
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
    const silence = now - this._tickAt;
    // A clock that was set back would hide a silence for as long as it lost.
    if (silence > LOST || silence < 0) return "lost";
    return silence > LATE || this.age(now) > LATE ? "late" : "open";
  }
}
