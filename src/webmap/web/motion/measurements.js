/** Speeds, distances and delays of a robot, as numbers and as texts. */

import { linearSpeed, angularSpeed } from "./report.js";

/** @typedef {import('./inputs.js').Axes} Axes */
/** @typedef {import('./report.js').RobotReport} RobotReport */

/** Shown instead of an unknown value. */
const UNKNOWN = "unknown";

/**
 * @typedef {object} Figure
 * @property {string} name
 * @property {'motion' | 'time'} kind
 * @property {string} text
 * @property {string} [more] The part that is hidden where there is no room.
 * @property {string} [title] An explanation of the value.
 */

/** Below this speed a robot counts as not moving, and has no halo; m/s. */
export const AT_REST = 0.02;

/** Assumed if an older gate does not report it: seconds, m/s². */
const ASSUMED = { reaction: 1, brake: 0.5 };

/**
 * @param {readonly number[] | null | undefined} velocity
 * @returns {number | null} In m/s, in any direction, negative for backwards; null if
 *     unknown.
 */
export function speedAlong(velocity) {
  if (!velocity) return null;
  const speed = linearSpeed(velocity);
  return Number.isFinite(speed) ? Math.sign(velocity[0] || 1) * speed : null;
}

/**
 * @param {RobotReport} report
 * @returns {number} Its speed, in m/s, from the best source that there is: measured, else
 *     echoed, else sent.
 */
export function speedNow({ measured, echoed, sent }) {
  return Math.abs(speedAlong(measured) ?? speedAlong(echoed) ?? speedAlong(sent) ?? 0);
}

/**
 * Return the longest distance that a robot may still move until it has stopped.
 *
 * @param {RobotReport} report
 * @returns {number | null} Metres from its centre; null if it does not move, or if no
 *     operator has control.
 */
export function stoppingDistance(report) {
  const speed = speedNow(report);
  if (report.state === "free" || speed < AT_REST) return null;
  const { reaction = ASSUMED.reaction, brake = ASSUMED.brake } = report;
  const distance = speed * reaction + speed ** 2 / (2 * brake);
  return Number.isFinite(distance) ? distance : null;
}

/**
 * Return the velocity as it was sent, as the robot's ROS echoed it, and as it was measured.
 *
 * @param {RobotReport} report
 * @returns {Figure[]}
 */
export function motions({ sent, echoed, measured }) {
  const text = (/** @type {readonly number[] | null} */ velocity) => {
    const speed = speedAlong(velocity);
    if (speed === null || !velocity) return { text: UNKNOWN, more: "" };
    return { text: `${signed(speed)} m/s`, more: `, ${signed(velocity[2])} rad/s` };
  };
  return [
    { name: "Sent", kind: "motion", ...text(sent) },
    { name: "Arrived", kind: "motion", ...text(echoed) },
    { name: "Measured", kind: "motion", ...text(measured) },
  ];
}

/**
 * Return the delays and the stopping distance.
 *
 * @param {RobotReport} report
 * @param {number | null} loop Time of a command to the gate and back, in ms.
 * @param {number | null} motion Time from the last press to motion, in ms.
 * @returns {Figure[]}
 */
export function timings(report, loop, motion) {
  const age = report.age ?? loop;
  const distance = stoppingDistance(report);
  const atRest = report.measured !== null && speedNow(report) < AT_REST;
  return [
    {
      name: "Round trip",
      kind: "time",
      text: duration(age),
      title: "From this page to the robot's bridge and back: 95 % of commands take less. "
        + `From this page to WebMap and back: ${duration(loop)}.`,
    },
    { name: "Command to motion", kind: "time", text: duration(motion) },
    {
      name: "Stopping distance",
      kind: "time",
      text: distance === null ? (atRest ? "not moving" : UNKNOWN) : `${distance.toFixed(2)} m`,
    },
  ];
}

/**
 * Return the command timeout of the base, as text.
 *
 * @param {RobotReport} report
 * @returns {string} "" if an older gate does not report it.
 */
export function ownStop({ stop_time, stop_source, stop_date, why }) {
  if (stop_time === undefined) return "";
  const tested = `tested ${stop_date ?? ""}`.trim();
  if (stop_time === null && stop_source === "tested") {
    return `Command timeout of the base: none (${tested}).`;
  }
  // Otherwise the reasons of the speed limit contain it already.
  const failed = why.some((reason) => reason.startsWith("stop test failed"));
  if (stop_time === null) return failed ? "" : "Command timeout of the base: unknown.";
  const how = stop_source === "tested" ? tested : "stated";
  return `Command timeout of the base: ${stop_time.toFixed(2)} s (${how}).`;
}

/**
 * Return the progress of the stop test, or why it failed, as text.
 *
 * @param {RobotReport} report
 * @returns {string} "" if {@link ownStop} contains everything.
 */
export function stopTestText({ test, holder }) {
  if (!test || test.state === "done") return "";
  // What ended the test, such as a STOP, may be over when control has ended.
  return test.state === "failed" && !holder ? "" : `Stop test: ${test.text}`;
}

/**
 * @param {RobotReport} report
 * @returns {boolean} Whether a stop test moves the robot, or waits for it to stop.
 */
export function isTested({ test }) {
  return test?.state === "creeping" || test?.state === "waiting";
}

/** @param {number | null} ms */
function duration(ms) {
  return ms === null ? UNKNOWN : `${Math.round(ms)} ms`;
}

/** @param {number} value */
export function signed(value) {
  const text = Math.abs(value).toFixed(2);
  return value < 0 && Number(text) !== 0 ? `-${text}` : text;
}

/** Below this turn rate a robot counts as not moving; rad/s. */
const TURNS = 0.05;

/** A robot that moves later than this moves for another reason; ms. */
const PATIENCE = 3000;

/**
 * Measures the time from the first command to move until odometry shows motion: the path
 * to the robot, the robot itself, and the path back.
 *
 * Times are in milliseconds of one clock.
 */
export class MotionDelay {
  constructor() {
    /**
     * The last measured time, by robot.
     * @type {Map<string, number>}
     */
    this._delays = new Map();
    /** @type {Map<string, boolean>} */
    this._moves = new Map();
    /**
     * The command that has not caused motion yet.
     * @type {{robot: string, since: number} | null}
     */
    this._waiting = null;
    /** Whether the last command requested motion. */
    this._asked = false;
  }

  /**
   * A command was sent.
   *
   * @param {string} robot
   * @param {boolean} moving Whether it requests motion.
   * @param {number} now
   */
  sent(robot, moving, now) {
    const first = moving && !this._asked;
    this._asked = moving;
    if (!moving) this._waiting = null;
    // If a robot moves already, the cause of its motion is unknown.
    else if (first && !this._moves.get(robot)) this._waiting = { robot, since: now };
  }

  /**
   * @param {RobotReport} report
   * @param {number} now
   */
  report({ robot, measured }, now) {
    const speed = Math.abs(speedAlong(measured) ?? 0);
    const moves = speed > AT_REST || angularSpeed(measured ?? []) > TURNS;
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
   * @returns {number | null} In ms; null before the first motion.
   */
  delay(robot) {
    return this._delays.get(robot) ?? null;
  }
}
