/** @typedef {import('./report.js').RobotReport} RobotReport */

/**
 * The leases that this page has, keeps without driving, or has released.
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
     * When each lease that is kept without driving was last used.
     * @type {Map<string, number>}
     */
    this._parked = new Map();
    /**
     * The epochs of released leases: later reports of these are outdated.
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
   * Note that a lease was released: later reports of it are outdated.
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
   * Note the use of a lease, if it is kept without driving.
   *
   * @param {string} robot
   * @param {number} now
   */
  use(robot, now) {
    if (this._parked.has(robot)) this._parked.set(robot, now);
  }

  /**
   * End keeping a lease without driving.
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
   * @returns {string[]} The robots whose kept leases were not used for this time.
   */
  unused(now, patience) {
    return [...this._parked]
      .filter(([, since]) => now - since >= patience)
      .map(([robot]) => robot);
  }

  /**
   * Process a report of the gate.
   *
   * @param {RobotReport} report
   * @returns {RobotReport | undefined} The previous report.
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

  /** Forget all leases: they ended with the connection. */
  forget() {
    this._parked.clear();
    this._given.clear();
    for (const [id, report] of this.robots) {
      this.robots.set(id, { ...report, mine: false });
    }
  }
}
