/** What a gate reports of a robot, and what it refuses. */

import { SEEN } from "../constants.js";

/**
 * The gate's report on one robot.
 *
 * @typedef {object} RobotReport
 * @property {string} robot
 * @property {string} [gate] The agent whose gate has it; none for the display's own gate.
 * @property {string} name
 * @property {'free' | 'held' | 'driving' | 'stopping' | 'stopped'} state
 * @property {string} doing The state as the page shows it: a name of `WORDS`.
 * @property {{connection: string, name: string, identity?: Identity} | null} holder
 * @property {boolean} mine Whether this page's connection holds the lease.
 * @property {number | null} epoch
 * @property {boolean} armed Whether the gate accepts a command to move now.
 * @property {number} v The speed limit, in m/s.
 * @property {number} w The turn limit, in rad/s.
 * @property {string[]} why What limits the speed.
 * @property {'up' | 'down'} link
 * @property {number[]} sent The velocity that was sent: x, y in m/s, turn in rad/s, then
 *     z in m/s, and rx, ry in rad/s.
 * @property {number[] | null} echoed
 * @property {number[] | null} measured
 * @property {boolean} armable
 * @property {string | null} reason Why it cannot be driven.
 *
 * Older gates do not report the following.
 *
 * @property {boolean} [latched] Whether a STOP is active, until it is reset.
 * @property {StopResult | null} [stop] The result of that STOP.
 * @property {Asker | null} [asker] Who requests control.
 * @property {boolean} [changing] Whether a handover waits until the robot has stopped.
 * @property {string | null} [alarm] Why the robot counts as not obeying.
 * @property {string | null} [other_writer] A sentence if another program publishes
 *     velocities to the robot, and on which topic.
 * @property {number | null} [stop_time] The command timeout of the base, in seconds.
 * @property {'stated' | 'tested' | null} [stop_source] The source of `stop_time`.
 * @property {string | null} [stop_date] When it was tested, as in 2026-11-21.
 * @property {number} [reaction] The longest time from an input to the robot, in seconds.
 * @property {number} [brake] The deceleration, in m/s², if known.
 * @property {number | null} [age] The age of commands when they arrive at the gate, in ms.
 * @property {StopTest | null} [test] The progress of the stop test.
 * @property {string | null} [method] How goals are sent to it; null if that is impossible.
 * @property {boolean} [cancels] Whether goals can be cancelled.
 * @property {boolean} [locates] Whether its pose can be set.
 * @property {GoalReport | null} [goal] The state of its newest goal.
 * @property {string[]} [hooks] The stop hooks that failed, and why.
 * @property {{every: number | null, by: string, at: number | null} | null} [check] The
 *     last check before driving.
 * @property {boolean} [looks] Whether the person may not drive it, only look and stop it.
 */

/**
 * Whose page it is. Names may be equal, and they may change.
 *
 * @typedef {{person: string, page?: string}} Identity
 *
 * @typedef {Identity & {name: string}} You This page: its person and the name that others
 *     see.
 */

/**
 * @typedef {object} GoalReport
 * @property {string} id
 * @property {number} x Metres.
 * @property {number} y Metres.
 * @property {number} yaw Radians.
 * @property {string} by The connection that sent it.
 * @property {string} method
 * @property {'sent' | 'accepted' | 'under way' | 'cancelling' | 'unknown' | 'reached'
 *     | 'failed' | 'cancelled'} state
 * @property {string} why
 * @property {number | null} left Metres to go.
 * @property {number | null} time Seconds under way.
 * @property {number | null} eta Seconds to go.
 * @property {number | null} recoveries
 */

/**
 * @typedef {object} StopResult
 * @property {string} by Who pressed STOP.
 * @property {boolean | null} confirmed Whether odometry confirms that the robot has
 *     stopped; null until that is decided.
 * @property {string} why Why it is not confirmed.
 * @property {string} [id] Its identity, for a reset. Each press has its own.
 * @property {Identity} [identity] That of the person.
 */

/**
 * @typedef {object} Asker
 * @property {string} connection
 * @property {string} name
 * @property {number} left Seconds until the robot is handed over unless the holder
 *     keeps it, counted from the report.
 * @property {Identity} [identity] That of the person.
 */

/** @typedef {{state: 'creeping' | 'waiting' | 'done' | 'failed', text: string}} StopTest */

/**
 * @param {readonly number[]} velocity As a report has it.
 * @returns {number} Metres per second, whatever the direction.
 */
export function linearSpeed([x, y, , z = 0]) {
  return Math.hypot(x, y, z);
}

/**
 * @param {readonly number[]} velocity As a report has it.
 * @returns {number} Radians per second, whatever the axis.
 */
export function angularSpeed([, , turn = 0, , rx = 0, ry = 0]) {
  return Math.hypot(turn, rx, ry);
}

/**
 * Name the person of this page "you" in a report: no other page may be called so.
 *
 * @param {RobotReport} report Changed.
 * @param {You} you
 */
export function nameYou(report, you) {
  if (!you.person) return;
  for (const who of [report.holder, report.asker]) {
    if (who?.identity?.person === you.person) who.name = "your other page";
  }
  const { stop, goal } = report;
  if (stop?.identity?.person === you.person) {
    stop.by = stop.identity.page === you.page ? "you" : "you, on another page";
  }
  if (report.reason) report.reason = textForYou(report.reason, you);
  if (goal) goal.why = textForYou(goal.why, you);
}

/**
 * @param {string} text A text of the gate, which is the same for all pages.
 * @param {You} you
 */
export function textForYou(text, { name }) {
  if (!name) return text;
  return text
    .replaceAll(`${name} has control`, "your other page has control")
    .replaceAll(`by ${name}`, "by you");
}

/** @param {RobotReport} report */
export function heldByAnother(report) {
  return report.holder !== null && !report.mine;
}

/**
 * @param {RobotReport} report
 * @returns {boolean} Whether the program of this display has control, or that of another.
 */
export function heldByProgram(report) {
  return /(^|\/)program$/.test(report.holder?.connection ?? "");
}

/** @param {RobotReport} report */
export function isLatched(report) {
  return report.latched ?? report.state === "stopped";
}

/** @param {GoalReport} goal */
export function isOver({ state }) {
  return ["reached", "failed", "cancelled"].includes(state);
}

/**
 * @param {RobotReport} report
 * @returns {string} The STOP of a robot in one text. Another press of STOP makes another
 *     text.
 */
export function stopKey({ robot, stop }) {
  return JSON.stringify([robot, stop?.id ?? ""]);
}

/**
 * @param {string} key Of {@link stopKey}.
 * @returns {[robot: string, stop: string]} The robot, and the identity of its STOP.
 */
export function stopOf(key) {
  return JSON.parse(key);
}

/**
 * @param {RobotReport} report
 * @returns {boolean} Whether a press may take the lease without a request to a person.
 */
export function mayTake(report) {
  if (isLatched(report) || report.looks) return false;
  return report.armable && (!heldByAnother(report) || heldByProgram(report));
}

/** States of the gate that say less than the activity that the display finds. */
const OPEN = new Set(["free", "barred", "down", "moving", "other"]);

/**
 * Return what the driving panel shows of a robot: the gate's state while an operator or
 * a STOP has the robot, else the activity that the display finds (`state_of` in Python).
 *
 * @param {RobotReport} report
 * @param {string} seen The activity that the display shows.
 * @returns {string} A name of `WORDS`.
 */
export function doingOf({ doing }, seen) {
  return OPEN.has(doing) && SEEN.includes(seen) ? seen : doing;
}

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
export class RefusalNote {
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
