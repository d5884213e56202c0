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
     * What was said, "*" for all, and the robots that have not answered: with the STOP
     * that stood for each, if one did.
     * @type {Map<string, Map<string, string>>}
     */
    this._sent = new Map();
    /** Whether the STOP for all met no robot known, and none stopped was reported since. */
    this._metNone = false;
  }

  /**
   * A STOP was said.
   *
   * @param {string} robot Or "*".
   * @param {ReadonlyMap<string, RobotReport>} known The robots that there are.
   */
  sent(robot, known) {
    const meant = robot === "*" ? [...known.keys()] : [robot];
    const before = (/** @type {string} */ id) => known.get(id)?.stop?.id ?? "";
    if (robot === "*") this._metNone = known.size === 0;
    this._sent.set(robot, new Map(meant.map((id) => [id, before(id)])));
  }

  /**
   * The gate spoke of a robot.
   *
   * @param {RobotReport} report
   */
  report(report) {
    if (!isLatched(report)) {
      // It may have been told before the STOP arrived, which may never arrive: no answer.
      if (this._metNone) this._sent.get("*")?.set(report.robot, "");
      return;
    }
    this._answered(report.robot, report.stop?.id);
    if (this._metNone && this._sent.get("*")?.size === 0) this._sent.delete("*");
    this._metNone = false;
  }

  /**
   * A robot is gone.
   *
   * @param {string} robot
   */
  gone(robot) {
    this._answered(robot, undefined);
  }

  /**
   * @param {string} robot
   * @param {string | undefined} stop The STOP that stands for it. The one that stood
   *     when STOP was said here is no answer, as somebody may be resetting it.
   */
  _answered(robot, stop) {
    for (const [target, waiting] of this._sent) {
      if (!waiting.has(robot) || waiting.get(robot) === (stop ?? null)) continue;
      waiting.delete(robot);
      if (waiting.size === 0) this._sent.delete(target);
    }
  }

  /**
   * The connection is lost.
   *
   * @returns {string[]} What is to be said again.
   */
  take() {
    const again = [...this._sent.keys()];
    this._sent.clear();
    this._metNone = false;
    return again;
  }
}
