import { isTested } from "./figures.js";
import { heldByAnother, isLatched, rolls, linearSpeed } from "./report.js";
import { stopWords } from "./stopping.js";

/** @typedef {import('./asking.js').Request} Request */
/** @typedef {import('./pilot.js').Pilot} Pilot */
/** @typedef {import('./report.js').RobotReport} RobotReport */
/** @typedef {import('./stopping.js').Verdict} Verdict */

/**
 * How it stands with driving a robot from this page, to be shown as words, a shape and
 * a colour: the state names all three.
 *
 * @typedef {'none' | 'connecting' | 'lost' | 'late' | 'fixed' | 'held' | 'free' |
 *     'taking' | 'ready' | 'hands-off' | 'driving' | 'stopping' | 'stopped' |
 *     'unconfirmed'} State
 */

/** @typedef {{state: State, title: string, detail: string}} Description */

/** @typedef {import('../drive.js').Drive['status']} Status */

const KEYS = "W A S D or the arrows";

/**
 * Say what there is to drive with.
 *
 * @param {{touch: boolean, stick: boolean, gamepad: boolean}} what `touch`: whether
 *     fingers are the pointer, so that there may be no keys.
 */
export function inputsOf({ touch, stick, gamepad }) {
  const pad = gamepad ? ", or LB and the left stick of the gamepad" : "";
  if (touch && stick) return `the stick${pad}`;
  return `${stick ? "W A S D, the arrows or the stick" : KEYS}${pad}`;
}

/**
 * Say how it stands.
 *
 * @param {Status} status
 * @param {string | null} robot The robot that is selected where this is shown.
 * @param {RobotReport | null} report The gate's word on it.
 * @param {boolean} active Whether the page's keys belong to that map.
 * @param {{verdict?: Verdict, request?: Request, inputs?: string}} [more] What became
 *     of a STOP for it that was said here, who asks for it, and what there is to drive
 *     with.
 * @returns {Description}
 */
export function describe(status, robot, report, active, more = {}) {
  const link = ofLink(status);
  if (link) return link;
  const said = ofRobot(status, robot, report, active, more);
  const { other_writer: other, hooks = [] } = report ?? {};
  if (!other && hooks.length === 0) return said;
  // Whatever else there is to say: who else moves it, and that its STOP is not what it
  // was made to be.
  const words = [said.detail, other ?? "", ...hooks].filter(Boolean).map(sentence);
  return say(said.state, said.title, words.join(" "));
}

/**
 * @param {Status} status
 * @param {string | null} robot
 * @param {RobotReport | null} report
 * @param {boolean} active
 * @param {{verdict?: Verdict, request?: Request, inputs?: string}} more
 */
function ofRobot(status, robot, report, active, more) {
  const { verdict, request, inputs = KEYS } = more;
  if (verdict?.state === "unconfirmed" && !(report && isLatched(report))) {
    return say("unconfirmed", "STOP NOT CONFIRMED", reasonOf(verdict));
  }
  if (robot === null) {
    return say("none", "No robot selected", "Click on one to drive it.");
  }
  if (report === null) return say("fixed", "Not drivable", "It has no velocity topic.");
  if (isLatched(report)) return ofStopped(status, report);
  if (report.changing) {
    return say("taking", "Handing over", "It is brought to a standstill first.");
  }
  if (heldByAnother(report)) return ofOther(status, report, request);
  if (!active) {
    return say("free", "Not driven here", "Click on this map to drive from it.");
  }
  if (status.driven === robot) return ofMine(status, report, inputs);
  return ofFree(status, report, inputs);
}

/**
 * Say how fast the robot may go, and why not faster.
 *
 * @param {RobotReport} report
 */
export function capOf(report) {
  const turn = `${digits(report.w)} rad/s`;
  const why = report.why.length > 0 ? `: ${report.why.join(", ")}` : "";
  return `Up to ${digits(report.v)} m/s, ${turn}${why}`;
}

/**
 * Say how fast the robot moves, as odometry has it.
 *
 * @param {RobotReport} report
 */
export function speedOf({ measured }) {
  if (!measured) return "No speed known";
  return `${linearSpeed(measured).toFixed(2)} m/s, ${measured[2].toFixed(2)} rad/s`;
}

/** @param {Status} status */
function ofLink({ link }) {
  if (link === "connecting") return say("connecting", "Getting ready", "Connecting.");
  if (link === "lost") {
    return say(
      "lost",
      "Connection lost",
      "Nothing can be driven from here. Trying again.",
    );
  }
  if (link === "late") {
    return say(
      "late",
      "Too slow",
      "Commands take longer than 0.3 s, so none moves a robot.",
    );
  }
  return null;
}

/**
 * @param {Status} status
 * @param {RobotReport} report
 */
function ofStopped(status, report) {
  const { confirmed, text } = stopWords(report);
  const detail = text || report.reason || "";
  // That commands are refused now is no news.
  const refused = status.refused === "reset" ? status.refusal : null;
  const refusal = refused ? ` ${sentence(refused)}` : "";
  if (confirmed === false) return say("unconfirmed", "STOP", `${detail}${refusal}`);
  return say("stopped", "Stopped", `${detail}${refusal}`);
}

/** @param {Verdict} verdict */
function reasonOf({ text }) {
  return sentence(text.replace(/^.*NOT CONFIRMED: /, ""));
}

/**
 * @param {Status} status
 * @param {RobotReport} report
 * @param {Request} [request]
 */
function ofOther(status, report, request) {
  const who = report.holder?.name || report.holder?.connection || "somebody else";
  const words = [];
  if (report.state === "driving") words.push("It is being driven.");
  if (request && request.by === status.connection) {
    words.push(`You asked for it: yours in ${request.left} s, unless ${who} keeps it.`);
  } else if (request) words.push(`${request.who} asks for it.`);
  else if (status.refusal) words.push(sentence(status.refusal));
  return say("held", `Held by ${who}`, words.join(" "));
}

/**
 * @param {Status} status
 * @param {RobotReport} report
 * @param {string} inputs
 */
function ofMine(status, report, inputs) {
  if (isTested(report)) return say("driving", "Testing its stop", "Touch nothing.");
  if (report.state === "driving") return say("driving", "Driving", speedOf(report));
  if (report.reason) return say("fixed", "Cannot move", sentence(report.reason));
  if (status.pressed && status.dead) return handsOff();
  if (report.state === "stopping") return say("stopping", "Stopping", speedOf(report));
  if (rolls(report)) return rolling(report);
  if (!status.settled || status.early) return gettingReady();
  return say("ready", "Ready", `Hold ${inputs}. Space stops.`);
}

/**
 * @param {Status} status
 * @param {RobotReport} report
 * @param {string} inputs
 */
function ofFree(status, report, inputs) {
  if (status.taking) return gettingReady();
  if (!report.armable) {
    return say(
      "fixed",
      "Cannot be driven",
      sentence(report.reason ?? "no reason given"),
    );
  }
  if (report.state === "stopping") return say("stopping", "Stopping", speedOf(report));
  if (rolls(report)) return rolling(report);
  if (status.refusal) return say("free", "Free", sentence(status.refusal));
  if (status.pressed && status.dead) return handsOff();
  if (status.early) return gettingReady();
  return say("free", "Free", `Hold ${inputs} to drive.`);
}

/** @param {RobotReport} report */
function rolling(report) {
  return say("stopping", "Still moving", speedOf(report));
}

function gettingReady() {
  return say("taking", "Getting ready", "");
}

function handsOff() {
  return say("hands-off", "Let go, then press again", "What is held now does nothing.");
}

/**
 * @param {State} state
 * @param {string} title
 * @param {string} detail
 * @returns {Description}
 */
function say(state, title, detail) {
  return { state, title, detail };
}

/** @param {string} text */
function sentence(text) {
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}${text.endsWith(".") ? "" : "."}`;
}

/** @param {number} value */
function digits(value) {
  return Number.isFinite(value) ? value.toFixed(2) : "any";
}
