import { isLatched } from "./report.js";

/** @typedef {import('./report.js').RobotReport} RobotReport */

/**
 * The STOPs of this page that the gate has not answered yet.
 *
 * A connection may be dead for a while before the page notices, so a sent STOP may not
 * have arrived. Each STOP is kept until the gate reports its robots as stopped. If that
 * does not happen, it is sent again on the next connection: a late or repeated stop is
 * still a stop.
 */
export class Unanswered {
  constructor() {
    /**
     * For each STOP, "*" for all: the robots without an answer, each with the id of the
     * STOP that was active before, or "".
     * @type {Map<string, Map<string, string>>}
     */
    this._sent = new Map();
    /** Whether no robot was known at the STOP for all, and none was reported stopped since. */
    this._metNone = false;
  }

  /**
   * Note that a STOP was sent.
   *
   * @param {string} robot Or "*".
   * @param {ReadonlyMap<string, RobotReport>} known The known robots.
   */
  sent(robot, known) {
    const meant = robot === "*" ? [...known.keys()] : [robot];
    const before = (/** @type {string} */ id) => known.get(id)?.stop?.id ?? "";
    if (robot === "*") this._metNone = known.size === 0;
    this._sent.set(robot, new Map(meant.map((id) => [id, before(id)])));
  }

  /**
   * Process a report of the gate.
   *
   * @param {RobotReport} report
   */
  report(report) {
    if (!isLatched(report)) {
      // This report may be older than the arrival of the STOP: it is no answer.
      if (this._metNone) this._sent.get("*")?.set(report.robot, "");
      return;
    }
    this._answered(report.robot, report.stop?.id);
    if (this._metNone && this._sent.get("*")?.size === 0) this._sent.delete("*");
    this._metNone = false;
  }

  /**
   * Forget a robot that is gone.
   *
   * @param {string} robot
   */
  gone(robot) {
    this._answered(robot, undefined);
  }

  /**
   * @param {string} robot
   * @param {string | undefined} stop The STOP that is active for it. The one that was
   *     active before is no answer, because another operator may be resetting it.
   */
  _answered(robot, stop) {
    for (const [target, waiting] of this._sent) {
      if (!waiting.has(robot) || waiting.get(robot) === (stop ?? null)) continue;
      waiting.delete(robot);
      if (waiting.size === 0) this._sent.delete(target);
    }
  }

  /**
   * Note that the connection is lost.
   *
   * @returns {string[]} The STOPs to send again.
   */
  take() {
    const again = [...this._sent.keys()];
    this._sent.clear();
    this._metNone = false;
    return again;
  }
}
