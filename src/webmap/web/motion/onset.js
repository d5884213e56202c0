import { AT_REST, speedAlong } from "./figures.js";
import { angularSpeed } from "./report.js";

/** @typedef {import('./axes.js').Axes} Axes */
/** @typedef {import('./report.js').RobotReport} RobotReport */

/** Below this turn rate a robot counts as not moving; rad/s. */
const TURNS = 0.05;

/** A robot that moves later than this moves for another reason; ms. */
const PATIENCE = 3000;

/**
 * Measures the time from the first command to move until odometry shows motion: the path
 * to the robot, the robot itself, and the path back.
 *
 * Times are in milliseconds of one clock.
 */
export class Onset {
  constructor() {
    /**
     * The last measured time, by robot.
     * @type {Map<string, number>}
     */
    this._delays = new Map();
    /** @type {Map<string, boolean>} */
    this._moves = new Map();
    /**
     * The command that has not caused motion yet.
     * @type {{robot: string, since: number} | null}
     */
    this._waiting = null;
    /** Whether the last command requested motion. */
    this._asked = false;
  }

  /**
   * A command was sent.
   *
   * @param {string} robot
   * @param {boolean} moving Whether it requests motion.
   * @param {number} now
   */
  sent(robot, moving, now) {
    const first = moving && !this._asked;
    this._asked = moving;
    if (!moving) this._waiting = null;
    // If a robot moves already, the cause of its motion is unknown.
    else if (first && !this._moves.get(robot)) this._waiting = { robot, since: now };
  }

  /**
   * @param {RobotReport} report
   * @param {number} now
   */
  report({ robot, measured }, now) {
    const speed = Math.abs(speedAlong(measured) ?? 0);
    const moves = speed > AT_REST || angularSpeed(measured ?? []) > TURNS;
    this._moves.set(robot, moves);
    if (!moves || this._waiting?.robot !== robot) return;
    const delay = now - this._waiting.since;
    if (delay <= PATIENCE) this._delays.set(robot, delay);
    this._waiting = null;
  }

  /** @param {string} robot */
  gone(robot) {
    this._delays.delete(robot);
    this._moves.delete(robot);
  }

  /**
   * @param {string} robot
   * @returns {number | null} In ms; null before the first motion.
   */
  delay(robot) {
    return this._delays.get(robot) ?? null;
  }
}
