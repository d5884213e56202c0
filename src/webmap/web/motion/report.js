/**
 * What the gate says of one robot.
 *
 * @typedef {object} RobotReport
 * @property {string} robot
 * @property {string} name
 * @property {'free' | 'held' | 'driving' | 'stopping' | 'stopped'} state
 * @property {{connection: string, name: string} | null} holder
 * @property {boolean} mine Whether this page's connection holds the lease.
 * @property {number | null} epoch
 * @property {boolean} armed Whether a command to move would be taken now.
 * @property {number} v The speed in force, in m/s.
 * @property {number} w The turning speed in force, in rad/s.
 * @property {string[]} why What limits the speed.
 * @property {'up' | 'down'} link
 * @property {number[]} sent Velocity that was written: x, y in m/s, turn in rad/s.
 * @property {number[] | null} echoed
 * @property {number[] | null} measured
 * @property {boolean} armable
 * @property {string | null} reason Why it cannot be driven.
 */

/** @param {RobotReport} report */
export function heldByAnother(report) {
  return report.holder !== null && !report.mine;
}

/** @param {RobotReport} report */
export function heldByProgram(report) {
  return report.holder?.connection === "program" || report.holder?.name === "program";
}

/**
 * @param {RobotReport} report
 * @returns {boolean} Whether a press may ask for the lease without asking a person.
 */
export function mayReach(report) {
  return report.armable && (!heldByAnother(report) || heldByProgram(report));
}
