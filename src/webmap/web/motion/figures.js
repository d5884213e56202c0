import { linearSpeed } from "./report.js";

/** What stands where a figure would. */
const UNKNOWN = "unknown";

/** @typedef {import('./report.js').RobotReport} RobotReport */

/**
 * @typedef {object} Figure
 * @property {string} name
 * @property {'motion' | 'time'} kind
 * @property {string} text
 * @property {string} [more] What there may be no room for.
 * @property {string} [title] What the figure is made of.
 */

/** Slower than this a robot is as good as standing, and has no halo; m/s. */
export const STANDING = 0.02;

/** What is assumed where an older gate does not say it: seconds, m/s². */
const ASSUMED = { reaction: 1, brake: 0.5 };

/**
 * @param {readonly number[] | null | undefined} velocity
 * @returns {number | null} In m/s, whatever the direction, below zero for backwards; null
 *     when it is not known.
 */
export function speedAlong(velocity) {
  if (!velocity) return null;
  const speed = linearSpeed(velocity);
  return Number.isFinite(speed) ? Math.sign(velocity[0] || 1) * speed : null;
}

/**
 * @param {RobotReport} report
 * @returns {number} How fast it moves, in m/s, by the best word that there is: what was
 *     measured, else what its ROS said back, else what was sent.
 */
export function speedNow({ measured, echoed, sent }) {
  return Math.abs(speedAlong(measured) ?? speedAlong(echoed) ?? speedAlong(sent) ?? 0);
}

/**
 * Say how far a robot goes at most from now until it stands.
 *
 * @param {RobotReport} report
 * @returns {number | null} Metres from its middle; null when it stands, or when nobody
 *     drives it from here.
 */
export function stoppingDistance(report) {
  const speed = speedNow(report);
  if (report.state === "free" || speed < STANDING) return null;
  const { reaction = ASSUMED.reaction, brake = ASSUMED.brake } = report;
  const distance = speed * reaction + speed ** 2 / (2 * brake);
  return Number.isFinite(distance) ? distance : null;
}

/**
 * Say one motion three times: as it was sent, as the robot's ROS said it back, and as it
 * was measured.
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
    { name: "Echoed", kind: "motion", ...text(echoed) },
    { name: "Measured", kind: "motion", ...text(measured) },
  ];
}

/**
 * Say how long things take, and how the robot would stop.
 *
 * @param {RobotReport} report
 * @param {number | null} loop How long commands take to the gate and back, in ms.
 * @param {number | null} motion How long from the last press to motion, in ms.
 * @returns {Figure[]}
 */
export function timings(report, loop, motion) {
  const age = report.age ?? loop;
  const distance = stoppingDistance(report);
  const stands = report.measured !== null && speedNow(report) < STANDING;
  return [
    {
      name: "Round trip",
      kind: "time",
      text: duration(age),
      title: "From your input to the robot's bridge and back: 95 % of commands take less. "
        + `Round trip from this page to WebMap: ${duration(loop)}.`,
    },
    { name: "Command to motion", kind: "time", text: duration(motion) },
    {
      name: "Stopping distance",
      kind: "time",
      text: distance === null ? (stands ? "not moving" : UNKNOWN) : `${distance.toFixed(2)} m`,
    },
  ];
}

/**
 * Say within what time the robot stops when nothing tells it to.
 *
 * @param {RobotReport} report
 * @returns {string} "" when an older gate does not say.
 */
export function ownStop({ stop_time, stop_source, stop_date, why }) {
  if (stop_time === undefined) return "";
  const tested = `tested ${stop_date ?? ""}`.trim();
  if (stop_time === null && stop_source === "tested") {
    return `Command timeout of the base: none (${tested}).`;
  }
  // Else what limits the speed says it already.
  const failed = why.some((reason) => reason.startsWith("stop test failed"));
  if (stop_time === null) return failed ? "" : "Command timeout of the base: unknown.";
  const how = stop_source === "tested" ? tested : "stated";
  return `Command timeout of the base: ${stop_time.toFixed(2)} s (${how}).`;
}

/**
 * Say how the test of its own stopping goes, or why it failed.
 *
 * @param {RobotReport} report
 * @returns {string} "" when there is nothing to say that {@link ownStop} does not.
 */
export function testWords({ test }) {
  return test && test.state !== "done" ? `Stop test: ${test.text}` : "";
}

/**
 * @param {RobotReport} report
 * @returns {boolean} Whether the robot is left to itself just now to see if it stops.
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
  return value < 0 && Number(text) !== 0 ? `\u2212${text}` : text;
}
