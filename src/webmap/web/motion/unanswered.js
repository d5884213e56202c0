import { isLatched } from "./report.js";

/** @typedef {import('./report.js').RobotReport} RobotReport */

/**
 * The STOPs of this page that no gate has answered yet.
 *
 * A connection may be dead long before that shows: what left through it may not have
 * arrived. So each is kept until the gate says that its robots are stopped, and is said
 * again on the next connection if that does not come; a stop that comes late, or twice,
 * is still a stop.
 */
export class Unanswered {
  constructor() {
    /**
     * What was said, "*" for all, and the robots that are not known to be stopped.
     * @type {Map<string, Set<string>>}
     */
    this._said = new Map();
  }

  /**
   * A STOP was said.
   *
   * @param {string} robot Or "*".
   * @param {ReadonlyMap<string, RobotReport>} known The robots that there are.
   */
  said(robot, known) {
    const meant = robot === "*" ? [...known.keys()] : [robot];
    const standing = [...known.values()].filter(isLatched).map((each) => each.robot);
    this._said.set(robot, new Set(meant.filter((id) => !standing.includes(id))));
    this._forgetAnswered(known.size > 0);
  }

  /**
   * The gate spoke of a robot.
   *
   * @param {RobotReport} report
   */
  report(report) {
    if (isLatched(report)) this.gone(report.robot);
    else this._forgetAnswered(true);
  }

  /**
   * A robot is stopped, or gone.
   *
   * @param {string} robot
   */
  gone(robot) {
    for (const waiting of this._said.values()) waiting.delete(robot);
    this._forgetAnswered(true);
  }

  /**
   * The connection is lost.
   *
   * @returns {string[]} What is to be said again.
   */
  take() {
    const again = [...this._said.keys()];
    this._said.clear();
    return again;
  }

  /** @param {boolean} robotsKnown A STOP for all that met none known is not answered. */
  _forgetAnswered(robotsKnown) {
    if (!robotsKnown) return;
    for (const [robot, waiting] of this._said) {
      if (waiting.size === 0) this._said.delete(robot);
    }
  }
}
