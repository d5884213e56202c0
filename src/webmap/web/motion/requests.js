/** @typedef {import('./report.js').RobotReport} RobotReport */

/**
 * A request for control of a robot.
 *
 * @typedef {object} Request
 * @property {string} robot
 * @property {string} name The robot's.
 * @property {string} by The connection of the requester.
 * @property {string} who The name of the requester.
 * @property {boolean} mine Whether this page's connection has control.
 * @property {number} left Whole seconds until control is handed over automatically.
 */

/**
 * Counts down the time that holders have to answer, from the gate's last report.
 *
 * Times are in milliseconds of one clock.
 */
export class Requests {
  constructor() {
    /** @type {Map<string, {report: RobotReport, ends: number}>} */
    this._requests = new Map();
  }

  /**
   * @param {RobotReport} report
   * @param {number} now
   */
  report(report, now) {
    if (!report.asker) this._requests.delete(report.robot);
    else {
      const ends = now + 1000 * report.asker.left;
      this._requests.set(report.robot, { report, ends });
    }
  }

  /** @param {string} robot */
  gone(robot) {
    this._requests.delete(robot);
  }

  /** Forget all: the gate will report the requests again. */
  forget() {
    this._requests.clear();
  }

  /**
   * @param {number} now
   * @returns {Request[]}
   */
  requests(now) {
    return [...this._requests.values()].map(({ report, ends }) => {
      const asker = /** @type {import('./report.js').Asker} */ (report.asker);
      return {
        robot: report.robot,
        name: report.name,
        by: asker.connection,
        who: asker.name || asker.connection,
        mine: report.mine,
        left: Math.max(0, Math.ceil((ends - now) / 1000)),
      };
    });
  }
}
