import { STANDING, speedAlong } from "./figures.js";
import { angularSpeed } from "./report.js";

/** @typedef {import('./axes.js').Axes} Axes */
/** @typedef {import('./report.js').RobotReport} RobotReport */

/** Turning slower than this a robot is as good as standing; rad/s. */
const TURNS = 0.05;

/** A robot that has not moved by then does so for another reason; ms. */
const PATIENCE = 3000;

/**
 * Measures how long it takes from the first command to move until odometry says that the
 * robot moves: all of the way there, the robot itself, and the way back.
 *
 * Times are in milliseconds of one clock.
 */
export class Onset {
  constructor() {
    /**
     * How long it took the last time.
     * @type {Map<string, number>}
     */
    this._delays = new Map();
    /** @type {Map<string, boolean>} */
    this._moves = new Map();
    /**
     * The command whose motion is waited for.
     * @type {{robot: string, since: number} | null}
     */
    this._waiting = null;
    /** Whether the last command asked for motion. */
    this._asked = false;
  }

  /**
   * A command was sent.
   *
   * @param {string} robot
   * @param {boolean} moving Whether it asks for motion.
   * @param {number} now
   */
  sent(robot, moving, now) {
    const first = moving && !this._asked;
    this._asked = moving;
    if (!moving) this._waiting = null;
    // Of a robot that moves already it cannot be told what moves it.
    else if (first && !this._moves.get(robot)) this._waiting = { robot, since: now };
  }

  /**
   * @param {RobotReport} report
   * @param {number} now
   */
  report({ robot, measured }, now) {
    const speed = Math.abs(speedAlong(measured) ?? 0);
    const moves = speed > STANDING || angularSpeed(measured ?? []) > TURNS;
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
   * @returns {number | null} In ms; null before it moved for the first time.
   */
  delay(robot) {
    return this._delays.get(robot) ?? null;
  }
}
