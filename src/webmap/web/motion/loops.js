import { Loop } from "./loop.js";

/** @typedef {import('./report.js').RobotReport} RobotReport */

/**
 * The loops from this page to the gates: the display's own gate, and the gates of agents.
 *
 * Each gate sends its own ticks, and acknowledges the commands to its robots. Their reports
 * tell which gate each robot has. Times are in milliseconds of the caller's clock.
 */
export class Loops {
  constructor() {
    /** The loop to the display's own gate. */
    this.own = new Loop();
    /**
     * The loop to the gate of each agent.
     * @type {Map<string, Loop>}
     */
    this._agents = new Map();
    /**
     * The loop to the gate of each robot.
     * @type {Map<string, Loop>}
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
   * @returns {Loop} The loop to the robot's gate; to the display's own if that is unknown.
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
      loop = new Loop();
      loop.pause = this.own.pause;
      loop.open(now);
      this._agents.set(gate, loop);
    }
    return loop;
  }
}
