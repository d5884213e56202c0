import { heldByAnother, isLatched } from "./report.js";

/** @typedef {import('./report.js').RobotReport} RobotReport */

/** How long a note is shown whose cause no report shows, in ms. */
const SHOWN = 10_000;

/**
 * @param {RobotReport} report
 * @returns {string} What prevents this page from taking control now; "" if nothing does.
 */
function obstacle(report) {
  if (isLatched(report)) return `STOP ${report.stop?.id}`;
  if (report.changing) return "handover";
  if (heldByAnother(report)) return `control of ${report.holder?.connection}`;
  return report.armable ? "" : "barred";
}

/**
 * A refusal of the gate, as text for the operator of a robot.
 *
 * Its cause is the first obstacle that a report shows at the refusal or later: a STOP, a
 * handover, the control of another operator, or a reason against driving. The note ends
 * when that obstacle is gone or is another one. A note without such a cause, and one of a
 * request that was denied, ends after 10 s. Times are in milliseconds of one clock.
 */
export class Note {
  /**
   * @param {string} text
   * @param {string} what The refused operation.
   * @param {number} now
   */
  constructor(text, what, now) {
    this.text = text;
    this.what = what;
    this._since = now;
    this._cause = "";
  }

  /**
   * @param {RobotReport | undefined} report The newest report on the robot.
   * @param {number} now
   * @returns {boolean} Whether the note has ended.
   */
  isOver(report, now) {
    const found = report ? obstacle(report) : "";
    this._cause ||= found;
    if (this._cause !== found) return true;
    const brief = this._cause === "" || this.what === "ask";
    return brief && now - this._since > SHOWN;
  }
}
