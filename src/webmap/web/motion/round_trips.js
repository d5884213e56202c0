/** The time of a command to a gate and back, by ticks and acknowledgements. */

/** @typedef {import('./report.js').RobotReport} RobotReport */

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
export class RoundTrip {
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

/**
 * The loops from this page to the gates: the display's own gate, and the gates of agents.
 *
 * Each gate sends its own ticks, and acknowledges the commands to its robots. Their reports
 * know the gate of each robot. Times are in milliseconds of the caller's clock.
 */
export class RoundTrips {
  constructor() {
    /** The loop to the display's own gate. */
    this.own = new RoundTrip();
    /**
     * The loop to the gate of each agent.
     * @type {Map<string, RoundTrip>}
     */
    this._agents = new Map();
    /**
     * The loop to the gate of each robot.
     * @type {Map<string, RoundTrip>}
     */
    this._robots = new Map();
  }

  /**
   * Start again, for a connection that has just opened. Agents and robots are forgotten.
   *
   * @param {number} now
   */
  open(now) {
    this.own.open(now);
    this._agents.clear();
    this._robots.clear();
  }

  /**
   * Expect ticks as often as the hello of the display's own gate states.
   *
   * @param {number} ticks Ticks a second.
   */
  greeted(ticks) {
    for (const loop of [this.own, ...this._agents.values()]) loop.pause = 1000 / ticks;
  }

  /**
   * Process a tick.
   *
   * @param {{tick: number, ack: number, gate?: string}} message
   * @param {number} now
   */
  receive({ tick, ack, gate }, now) {
    this._to(gate, now).receive(tick, ack, now);
  }

  /**
   * Process a report of a gate.
   *
   * @param {RobotReport} report
   * @param {number} now
   */
  report({ robot, gate }, now) {
    this._robots.set(robot, this._to(gate, now));
  }

  /**
   * Forget a robot that its gate does not know any more.
   *
   * @param {string} robot
   */
  gone(robot) {
    this._robots.delete(robot);
  }

  /**
   * @param {string | null} robot
   * @returns {RoundTrip} The loop to the robot's gate; to the display's own if that is unknown.
   */
  of(robot) {
    return this._robots.get(robot ?? "") ?? this.own;
  }

  /**
   * @param {string | undefined} gate The agent's name; none for the display's own gate.
   * @param {number} now
   */
  _to(gate, now) {
    if (!gate) return this.own;
    let loop = this._agents.get(gate);
    if (!loop) {
      loop = new RoundTrip();
      loop.pause = this.own.pause;
      loop.open(now);
      this._agents.set(gate, loop);
    }
    return loop;
  }
}
