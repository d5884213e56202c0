/** The STOPs of this page: whether a gate answered, and whether the robots stopped. */

import { isLatched, linearSpeed, angularSpeed } from "./report.js";

/** @typedef {import('./report.js').RobotReport} RobotReport */

/** Means all robots. */
const ALL = "*";

/** Below these speeds a robot counts as not moving: m/s and rad/s. */
const AT_REST = { v: 0.02, w: 0.05 };

/** Above these speeds a robot that must stop does not obey: m/s and rad/s. */
const MOVES = { v: 0.05, w: 0.1 };

/** The gate answers a STOP within this time, in ms. */
export const ANSWER_PATIENCE = 300;

/** A stopped robot does not move any more after this time, in ms. */
export const STAND_PATIENCE = 1000;

/** How long a confirmed result is shown, in ms. */
const SHOWN = 5000;

/** With more results than this, only the exceptions are named. */
const FEW = 3;

/** The greatest number of exceptions that are named. */
const NAMED = 8;

const STOPPED = "stopped, confirmed by odometry";

/**
 * The result of the STOP of one robot.
 *
 * @typedef {object} Verdict
 * @property {string} robot
 * @property {string} name
 * @property {'stopping' | 'confirmed' | 'unconfirmed'} state
 * @property {string} text
 */

/** @typedef {{since: number, answered: boolean, stoppedAt: number | null}} Watch */

/**
 * Watches the results of this page's STOPs. Only odometry confirms a STOP: the gate decides
 * that, or, if an older gate does not report it, the page.
 *
 * Times are in milliseconds of one clock.
 */
export class StopResults {
  constructor() {
    /**
     * By robot; "*" for a STOP of all robots while none was known.
     * @type {Map<string, Watch>}
     */
    this._watched = new Map();
  }

  /**
   * Note that a STOP was sent.
   *
   * @param {string} robot Or "*" for all.
   * @param {ReadonlyMap<string, RobotReport>} known The known robots.
   * @param {number} now
   */
  start(robot, known, now) {
    for (const id of robot === ALL && known.size > 0 ? known.keys() : [robot]) {
      // If a STOP is active already, there may be no new report as an answer.
      const answered = known.get(id)?.latched === true;
      this._watched.set(id, { since: now, answered, stoppedAt: null });
      const report = known.get(id);
      if (answered && report) this.report(report, now);
    }
  }

  /**
   * Process a report of the gate.
   *
   * @param {RobotReport} report
   * @param {number} now
   */
  report(report, now) {
    const stopped = report.latched ?? report.state !== "driving";
    this._meet(report.robot, stopped);
    const watch = this._watched.get(report.robot);
    if (!watch) return;
    if (!stopped && watch.answered) {
      // It was reset, or an operator drives it again: this STOP is over.
      this._watched.delete(report.robot);
      return;
    }
    if (stopped) watch.answered = true;
    const atRest = report.stop ? report.stop.confirmed === true : isAtRest(report);
    if (watch.answered && atRest) watch.stoppedAt ??= now;
    else watch.stoppedAt = null;
  }

  /**
   * Watch a robot that is first reported after a STOP for all, if none was known then.
   * This ends when the gate reports a stopped robot.
   *
   * @param {string} robot
   * @param {boolean} stopped
   */
  _meet(robot, stopped) {
    const all = this._watched.get(ALL);
    if (!all) return;
    if (!this._watched.has(robot)) this._watched.set(robot, { ...all });
    if (stopped) this._watched.delete(ALL);
  }

  /**
   * Forget a robot.
   *
   * @param {string} robot
   */
  gone(robot) {
    this._watched.delete(robot);
  }

  /** Forget all results, decided or not. */
  dismiss() {
    this._watched.clear();
  }

  /**
   * @param {ReadonlyMap<string, RobotReport>} robots
   * @param {boolean} connected Whether messages of the gate arrive.
   * @param {number} now
   * @returns {Verdict[]}
   */
  verdicts(robots, connected, now) {
    const isOver = (/** @type {Watch} */ { stoppedAt }) => connected && stoppedAt !== null && now - stoppedAt > SHOWN;
    const watches = [...this._watched];
    // The number of confirmed robots among many is shown as long as one is missing.
    const each = watches.length <= FEW || watches.every(([, watch]) => isOver(watch));
    const verdicts = [];
    for (const [robot, watch] of watches) {
      if (robot === ALL && robots.size > 0) continue;
      if (each && isOver(watch)) this._watched.delete(robot);
      else verdicts.push(judge(robot, robots.get(robot), watch, connected, now));
    }
    return verdicts;
  }
}

/**
 * Finds robots that do not obey: they move although only zero was sent for a second.
 *
 * A robot that stopped once since then, or that got another command, obeys: it may move to
 * a goal, or another operator may drive it.
 */
export class Obedience {
  constructor() {
    /**
     * When zero was first sent to robots that moved.
     * @type {Map<string, number>}
     */
    this._zeroSince = new Map();
    /** @type {Map<string, RobotReport>} */
    this._last = new Map();
  }

  /**
   * @param {RobotReport} report
   * @param {number} now
   */
  report(report, now) {
    const before = this._last.get(report.robot);
    this._last.set(report.robot, report);
    if (!isZero(report)) this._zeroSince.delete(report.robot);
    else if (isAtRest(report)) this._zeroSince.delete(report.robot);
    else if (before && !isZero(before)) this._zeroSince.set(report.robot, now);
  }

  /**
   * Stop watching a robot that has a new goal, or is gone.
   *
   * @param {string} robot
   */
  excuse(robot) {
    this._zeroSince.delete(robot);
  }

  /**
   * @param {number} now
   * @returns {RobotReport[]} The newest report on each robot that does not obey.
   */
  disobeying(now) {
    return [...this._zeroSince]
      .filter(([robot, since]) => now - since > STAND_PATIENCE && this._moves(robot))
      .map(([robot]) => /** @type {RobotReport} */ (this._last.get(robot)));
  }

  /** @param {string} robot */
  _moves(robot) {
    const measured = this._last.get(robot)?.measured;
    if (!measured) return false;
    return linearSpeed(measured) > MOVES.v || angularSpeed(measured) > MOVES.w;
  }
}

/**
 * @param {string} robot
 * @param {RobotReport | undefined} report
 * @param {Watch} watch
 * @param {boolean} connected
 * @param {number} now
 * @returns {Verdict}
 */
function judge(robot, report, watch, connected, now) {
  const name = robot === ALL ? "All robots" : (report?.name ?? robot);
  const unsure = (/** @type {string} */ why) => ({
    robot,
    name,
    state: /** @type {const} */ ("unconfirmed"),
    text: `NOT CONFIRMED: ${why}`,
  });
  const waited = now - watch.since;
  if (!connected) return unsure("no connection to WebMap; STOP is sent again after reconnecting");
  if (!watch.answered && waited > ANSWER_PATIENCE) {
    const text = "NOT CONFIRMED: no answer from the gate";
    return { robot, name, state: "unconfirmed", text };
  }
  if (report?.stop?.confirmed === false) return unsure(report.stop.why);
  if (report?.link === "down") return unsure("no connection to the bridge");
  if (watch.stoppedAt !== null) {
    const more = [...besides(report?.stop?.why), ...(report?.hooks ?? [])];
    const parts = [STOPPED, ...more];
    return { robot, name, state: "confirmed", text: parts.join("; ") };
  }
  if (waited <= STAND_PATIENCE) {
    return { robot, name, state: "stopping", text: "stopping" };
  }
  if (!report?.measured) return unsure("no odometry");
  return unsure(`still moving at ${linearSpeed(report.measured).toFixed(2)} m/s`);
}

/**
 * Return the lines that show the results of STOPs: of many robots their number, and by
 * name only those that need a look.
 *
 * @param {Verdict[]} verdicts In the order of the names.
 * @returns {Pick<Verdict, 'state' | 'text'>[]}
 */
export function linesOf(verdicts) {
  const line = (/** @type {Verdict} */ { name, state, text }) => ({
    state,
    text: `${name}: ${text}`,
  });
  if (verdicts.length <= FEW) return verdicts.map(line);
  const of = (/** @type {Verdict['state']} */ state) =>
    verdicts.filter((verdict) => verdict.state === state);
  const [confirmed, unconfirmed] = [of("confirmed"), of("unconfirmed")];
  /** @type {Verdict['state']} */
  const settled = confirmed.length > 0 ? "confirmed" : "unconfirmed";
  const first = {
    state: of("stopping").length > 0 ? /** @type {const} */ ("stopping") : settled,
    text: `${confirmed.length} of ${verdicts.length} stopped, confirmed`,
  };
  const remarks = confirmed.filter(({ text }) => text !== STOPPED);
  const exceptions = [...unconfirmed, ...remarks];
  const named = exceptions.slice(0, NAMED).map(line);
  const more = exceptions.length - named.length;
  if (more === 0) return [first, ...named];
  const rest = unconfirmed.length - NAMED;
  if (rest <= 0) return [first, ...named, { state: "confirmed", text: `${more} more` }];
  const last = `${more} more, ${rest} NOT CONFIRMED`;
  return [first, ...named, { state: "unconfirmed", text: last }];
}

/**
 * Return the result of a robot's active STOP, as text.
 *
 * @param {RobotReport} report
 * @returns {{confirmed: boolean | null, text: string}} `confirmed` is null while it
 *     is unknown.
 */
export function stopText({ stop }) {
  if (!stop) return { confirmed: null, text: "" };
  const by = stop.by ? `By ${stop.by}` : "";
  const more = besides(stop.why);
  const what = {
    true: ["confirmed by odometry", ...more].join("; "),
    false: stop.why,
    null: ["waiting for odometry to confirm", ...more].join("; "),
  }[`${stop.confirmed}`];
  const text = [by, what].filter(Boolean).join(stop.confirmed === false ? ": " : ", ");
  return { confirmed: stop.confirmed, text: `${text[0].toUpperCase()}${text.slice(1)}.` };
}

/**
 * @param {string} [why] The gate's text about a STOP.
 * @returns {string[]} Its parts that are not about motion: that the STOP is not stored on
 *     the disk.
 */
function besides(why = "") {
  return why.split("; ").slice(1);
}

/**
 * Return the active STOPs, as text.
 *
 * @param {Iterable<RobotReport>} reports
 * @returns {string} "" if there is none.
 */
export function standingStops(reports) {
  const stopped = [...reports].filter(isLatched);
  if (stopped.length === 0) return "";
  const unconfirmed = stopped.filter(({ stop }) => stop?.confirmed === false).length;
  const one = stopped.length === 1;
  const who = one ? stopped[0].name : `${stopped.length} robots`;
  const result = one ? "NOT CONFIRMED" : `${unconfirmed} NOT CONFIRMED`;
  const unhooked = stopped.filter(({ hooks }) => hooks?.length).map(({ name }) => name);
  const hooks = unhooked.length ? ` Stop hooks failed: ${unhooked.join(", ")}.` : "";
  const results = unconfirmed ? `, ${result}` : "";
  return `STOP active: ${who}${results}.${hooks}`;
}

/** @param {RobotReport} report */
function isAtRest({ measured }) {
  if (!measured) return false;
  return linearSpeed(measured) < AT_REST.v && angularSpeed(measured) < AT_REST.w;
}

/** @param {RobotReport} report */
function isZero({ sent }) {
  return sent.every((value) => value === 0);
}

/**
 * The STOPs of this page that the gate has not answered yet.
 *
 * A connection may be dead for a while before the page notices, so a sent STOP may not
 * have arrived. Each STOP is kept until the gate reports its robots as stopped. If that
 * does not happen, it is sent again on the next connection: a late or repeated stop is
 * still a stop.
 */
export class UnansweredStops {
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
