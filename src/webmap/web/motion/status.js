import { isTested, signed, speedAlong } from "./measurements.js";
import { doingOf, heldByAnother, isLatched } from "./report.js";
import { WORDS } from "../constants.js";
import { stopText } from "./stops.js";

/** @typedef {import('./session.js').Request} Request */
/** @typedef {import('./pilot.js').Pilot} Pilot */
/** @typedef {import('./report.js').RobotReport} RobotReport */
/** @typedef {import('./stops.js').Verdict} Verdict */

/**
 * The state of driving a robot from this page. A page shows it as text, a shape and a
 * colour, all three by this name. Every page has the same text for what a robot is doing.
 *
 * @typedef {'none' | 'connecting' | 'lost' | 'late' | 'fixed' | 'held' | 'free' |
 *     'taking' | 'ready' | 'hands-off' | 'driving' | 'blocked' | 'moving' |
 *     'stopping' | 'stopped' | 'unconfirmed'} State
 */

/**
 * `least`: whether the detail is only a hint or velocities, no reason. `warns`: whether it
 * names another program, or stop hooks that failed.
 *
 * @typedef {{state: State, title: string, detail: string, least?: boolean,
 *     warns?: boolean}} Description
 */

/**
 * @typedef {object} More
 * @property {Verdict} [verdict] The result of a STOP of this page.
 * @property {Request} [request] The request for control of the robot.
 * @property {string} [inputs] The available inputs, as text.
 * @property {Seen} [seen] What the display shows of the robot.
 */

/**
 * What the display shows of a robot, as attributes of its element in the scene.
 *
 * @typedef {object} Seen
 * @property {string} [state] The worst of the activity and the conditions.
 * @property {string} [activity] A name of `WORDS`, if that is not `state`.
 * @property {string} [conditions] Names of `WORDS`, with spaces between them.
 * @property {string} [since] When the last pose of a robot came that is gone.
 * @property {string} [program] The words for another program that moves it.
 */

/** @typedef {import('../drive.js').Drive['status']} Status */

const KEYS = "W A S D or the arrow keys";

/**
 * Return the available inputs, as text.
 *
 * @param {{touch: boolean, stick: boolean, gamepad: string}} what `touch`: whether
 *     the pointer is a finger, so that there may be no keyboard. `gamepad`: what is held
 *     and moved on a gamepad; empty without one.
 */
export function inputsOf({ touch, stick, gamepad }) {
  const pad = gamepad ? `, or ${gamepad} of the gamepad` : "";
  if (touch && stick) return `the stick${pad}`;
  return `${stick ? "W A S D, the arrow keys or the stick" : KEYS}${pad}`;
}

/**
 * Describe the state of driving a robot from this page.
 *
 * @param {Status} status
 * @param {string | null} robot The robot that is selected where this is shown.
 * @param {RobotReport | null} report The gate's report on it.
 * @param {boolean} active Whether the page's inputs belong to that map.
 * @param {More} [more]
 * @returns {Description}
 */
export function describe(status, robot, report, active, more = {}) {
  const link = ofLink(status, report);
  if (link) return link;
  const state = ofRobot(status, robot, report, active, more);
  const { other_writer: other, hooks = [] } = report ?? {};
  if (!other && hooks.length === 0) return state;
  // In every state: another program that moves the robot, and failed stop hooks.
  const words = [state.detail, other ?? "", ...hooks].filter(Boolean).map(sentence);
  return { ...state, detail: words.join(" "), least: false, warns: true };
}

/**
 * @param {Status} status
 * @param {string | null} robot
 * @param {RobotReport | null} report
 * @param {boolean} active
 * @param {More} more
 */
function ofRobot(status, robot, report, active, more) {
  const { verdict, inputs = KEYS, seen = {} } = more;
  const activity = seen.activity ?? seen.state ?? "";
  if (verdict?.state === "unconfirmed" && !(report && isLatched(report))) {
    return description("unconfirmed", WORDS.unconfirmed, reasonOf(verdict));
  }
  if (robot === null) {
    return hint("none", "No robot selected", "Select a robot to drive it.");
  }
  if (report === null) {
    const title = stateText(activity in WORDS ? activity : "watched", null, seen);
    return description("fixed", title, "This robot has no velocity topic.");
  }
  const name = doingOf(report, activity);
  const title = stateText(name, report, seen);
  if (isLatched(report)) return ofStopped(title, status, report);
  if (name === "changing") {
    return description("taking", title, "The robot stops first.");
  }
  if (heldByAnother(report)) return ofOther(title, status, report, more.request);
  if (!active) {
    return hint("free", "Map not active", "Click this map to drive from it.");
  }
  const driven = status.driven === robot;
  const kept = driven ? ofInputs(status, report, title) : ofTaking(status, report, title);
  if (kept) return kept;
  const ready = status.settled && !status.early;
  if (name === "held" && driven && !ready) return gettingReady();
  return ofDoing(name, title, report, inputs);
}

/**
 * Return the text of an activity with that of the conditions, for this page.
 *
 * @param {string} name The activity, or a worse state of the gate: of `WORDS`.
 * @param {RobotReport | null} report
 * @param {Seen} seen
 */
function stateText(name, report, seen) {
  // The gate reports a blocked robot in place of a driven one.
  const activity = name === "blocked" ? "driven" : name;
  const names = [...(name === activity ? [] : [name]), ...(seen.conditions ?? "").split(" ")];
  const conditions = [...new Set(names)].filter((each) => each in WORDS && each !== activity);
  const texts = conditions.map((each) => wordsOf(each, report, seen));
  const besides = texts.map((text) => ` · ${text.charAt(0).toLowerCase()}${text.slice(1)}`);
  return wordsOf(activity, report, seen) + besides.join("");
}

/**
 * @param {string} name
 * @param {RobotReport | null} report
 * @param {Seen} seen
 */
function wordsOf(name, report, { since = "", program = "another program" }) {
  /** @type {Readonly<Record<string, string>>} */
  const words = WORDS;
  const text = (report?.mine && words[`${name}_by_you`]) || words[name];
  const holder = report?.holder;
  const who = holder?.name || holder?.connection || "Another operator";
  /** @type {Record<string, string>} */
  const values = { who, since, program };
  return begun(text.replace(/\{(\w+)\}/, (_, key) => values[key]));
}

/**
 * Return the speed limits and their reasons, as two texts.
 *
 * @param {RobotReport} report
 * @param {string} [more] Another reason.
 */
export function capOf({ v, w, why }, more = "") {
  const reasons = [...why, more].filter(Boolean).join(", ");
  return {
    why: `Speed limit: ${reasons || "no reason given"}`,
    cap: `at most ${limit(v, "m/s")}, ${limit(w, "rad/s")}`,
  };
}

/**
 * Return the speed of the robot by odometry, as text.
 *
 * @param {RobotReport} report
 */
export function speedOf({ measured }) {
  if (!measured) return "Speed unknown";
  return velocityText(measured);
}

/**
 * @param {readonly number[]} velocity As a report has it.
 * @returns {string} Backwards and clockwise are negative.
 */
function velocityText(velocity) {
  return `${signed(speedAlong(velocity) ?? 0)} m/s, ${signed(velocity[2])} rad/s`;
}

/**
 * @param {Status} status
 * @param {RobotReport | null} report
 */
function ofLink({ link }, report) {
  if (link === "connecting") return description("connecting", "Preparing input", "Connecting.");
  if (link === "lost") {
    return description(
      "lost",
      "No connection to WebMap",
      "No robot can be driven from this page. Reconnecting…",
    );
  }
  if (link === "late") {
    return description(
      "late",
      "Slow connection",
      "Command too old (over 300 ms): ignored",
    );
  }
  // As soon as the display counts the agent as lost, the report has the reason.
  if (link === "silent" && report?.link !== "down") {
    return description("late", `No answer from the agent ${report?.gate}`, "Commands are ignored.");
  }
  return null;
}

/**
 * @param {string} title
 * @param {Status} status
 * @param {RobotReport} report
 */
function ofStopped(title, status, report) {
  const { confirmed, text } = stopText(report);
  const detail = text || report.reason || "";
  // A refusal of other commands needs no message here.
  const refused = status.refused === "reset" ? status.refusal : null;
  const refusal = refused ? ` ${sentence(refused)}` : "";
  const state = confirmed === false ? "unconfirmed" : "stopped";
  return description(state, title, `${detail}${refusal}`);
}

/** @param {Verdict} verdict */
function reasonOf({ text }) {
  return sentence(text.replace(/^.*NOT CONFIRMED: /, ""));
}

/**
 * @param {string} title
 * @param {Status} status
 * @param {RobotReport} report
 * @param {Request} [request]
 */
function ofOther(title, status, report, request) {
  const who = report.holder?.name || report.holder?.connection || "Another operator";
  const words = title.includes(who.slice(1)) ? [] : [begun(`${who} has control.`)];
  if (request && request.by === status.connection) {
    words.push(`Control requested: handed over in ${request.left} s unless ${who} refuses.`);
  } else if (request) words.push(begun(`${request.who} requests control.`));
  else if (status.refusal) words.push(sentence(status.refusal));
  return description("held", title, words.join(" "));
}

/**
 * Describe why the inputs of this page do not move the robot that it controls.
 *
 * @param {Status} status
 * @param {RobotReport} report
 * @param {string} title
 * @returns {Description | null} null if they move it.
 */
function ofInputs(status, report, title) {
  if (isTested(report)) return description("driving", "Stop test running", "Do not touch any input.");
  if (report.state === "driving") return null;
  if (report.reason) return description("fixed", title, sentence(report.reason));
  if (status.refusal && status.refused === "stop-test") {
    return description("ready", title, sentence(status.refusal));
  }
  return isBlocked(status) ? inputBlocked() : null;
}

/**
 * Describe why a press does not take a robot.
 *
 * @param {Status} status
 * @param {RobotReport} report
 * @param {string} title
 * @returns {Description | null} null if it takes it.
 */
function ofTaking(status, report, title) {
  if (status.taking) return gettingReady();
  if (report.state === "stopping" && report.link === "up") return null;
  if (!report.armable) {
    return description("fixed", title, sentence(report.reason ?? "no reason given"));
  }
  if (status.frozen && isBlocked(status)) return inputBlocked();
  if (status.refusal) return description("free", title, sentence(status.refusal));
  if (isBlocked(status)) return inputBlocked();
  return status.early ? gettingReady() : null;
}

/**
 * Describe what the robot is doing.
 *
 * @param {string} name Of `WORDS`.
 * @param {string} title
 * @param {RobotReport} report
 * @param {string} inputs
 * @returns {Description}
 */
function ofDoing(name, title, report, inputs) {
  switch (name) {
    case "blocked": {
      const sent = `Sent: ${velocityText(report.sent)}.`;
      return hint("blocked", title, `${sent} Measured: ${speedOf(report)}.`);
    }
    case "driven":
      return hint("driving", title, speedOf(report));
    case "stopping":
    case "settling":
      return hint("stopping", title, speedOf(report));
    case "disobeying":
    case "unreachable":
    case "moving":
    case "other":
      return hint("moving", title, report.measured ? speedOf(report) : "");
    case "navigating":
    case "navigating_held":
      return hint("moving", title, `To drive, hold ${inputs}. This cancels the goal.`);
  }
  if (name !== "held") return hint("free", title, `Hold ${inputs} to drive.`);
  return hint("ready", title, `Hold ${inputs} to drive. Press Space for STOP.`);
}

function gettingReady() {
  return description("taking", "Preparing input", "");
}

/** @param {Status} status */
function isBlocked({ pressed, frozen, blocked }) {
  return (pressed || frozen) && blocked;
}

function inputBlocked() {
  return description("hands-off", "Input blocked: release all keys, then press again", "");
}

/**
 * @param {State} state
 * @param {string} title
 * @param {string} detail
 * @returns {Description}
 */
function description(state, title, detail) {
  return { state, title, detail };
}

/**
 * @param {State} state
 * @param {string} title
 * @param {string} detail No reason.
 * @returns {Description}
 */
function hint(state, title, detail) {
  return { state, title, detail, least: true };
}

/**
 * Return a text of the gate as a sentence. A name at the beginning, such as a URL or a
 * topic, keeps its small letter.
 *
 * @param {string} text
 */
export function sentence(text) {
  const [first] = text.split(/[.,:;]*(?:\s|$)/, 1);
  const start = /[\d/_:.]/.test(first) ? text.charAt(0) : text.charAt(0).toUpperCase();
  return `${start}${text.slice(1)}${text.endsWith(".") ? "" : "."}`;
}

/** @param {string} text Returned with a capital letter at its beginning. */
export function begun(text) {
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}`;
}

/**
 * @param {number} value
 * @param {string} unit
 */
function limit(value, unit) {
  return Number.isFinite(value) ? `${value.toFixed(2)} ${unit}` : "not set";
}
