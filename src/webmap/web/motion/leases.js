/** @typedef {import('./report.js').RobotReport} RobotReport */

/**
 * Which leases this page has, which of them it keeps without driving, and which it gave
 * back.
 *
 * Times are in milliseconds of one clock.
 */
export class Leases {
  constructor() {
    /**
     * The newest report of each robot.
     * @type {Map<string, RobotReport>}
     */
    this.robots = new Map();
    /**
     * When leases that serve a goal were last used.
     * @type {Map<string, number>}
     */
    this._parked = new Map();
    /**
     * Epochs that were given back, of which late reports must not be believed.
     * @type {Map<string, number>}
     */
    this._given = new Map();
  }

  /**
   * @param {string} robot
   * @returns {number | null} The epoch of this page's lease on the robot.
   */
  epoch(robot) {
    const report = this.robots.get(robot);
    if (!report?.mine || this._given.get(robot) === report.epoch) return null;
    return report.epoch;
  }

  /**
   * A lease was given back: whatever is said of it still is old.
   *
   * @param {string} robot
   * @param {number} epoch
   */
  giveBack(robot, epoch) {
    this._given.set(robot, epoch);
  }

  /**
   * Keep a lease without driving.
   *
   * @param {string} robot
   * @param {number} now
   */
  park(robot, now) {
    this._parked.set(robot, now);
  }

  /**
   * A lease is needed still, if it is one that is kept without driving.
   *
   * @param {string} robot
   * @param {number} now
   */
  use(robot, now) {
    if (this._parked.has(robot)) this._parked.set(robot, now);
  }

  /**
   * A lease is not kept without driving any more.
   *
   * @param {string} robot Or "*".
   */
  unpark(robot) {
    if (robot === "*") this._parked.clear();
    else this._parked.delete(robot);
  }

  /**
   * @param {number} now
   * @param {number} patience In ms.
   * @returns {string[]} Whose leases are kept and were not used for so long.
   */
  unused(now, patience) {
    return [...this._parked]
      .filter(([, since]) => now - since >= patience)
      .map(([robot]) => robot);
  }

  /**
   * Take what the gate says of a robot.
   *
   * @param {RobotReport} report
   * @returns {RobotReport | undefined} What it said before.
   */
  report(report) {
    const before = this.robots.get(report.robot);
    this.robots.set(report.robot, report);
    if (!report.mine) {
      this._parked.delete(report.robot);
      this._given.delete(report.robot);
    }
    return before;
  }

  /**
   * Forget a robot that the gate does not know any more.
   *
   * @param {string} robot
   */
  gone(robot) {
    this.robots.delete(robot);
    this._parked.delete(robot);
  }

  /** All leases ended with the connection. */
  forget() {
    this._parked.clear();
    this._given.clear();
    for (const [id, report] of this.robots) {
      this.robots.set(id, { ...report, mine: false });
    }
  }
}
