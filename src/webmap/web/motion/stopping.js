import { isLatched, linearSpeed, angularSpeed } from "./report.js";

/** @typedef {import('./report.js').RobotReport} RobotReport */

/** Stands for all robots. */
const ALL = "*";

/** Slower than this a robot stands: m/s and rad/s. */
const STANDS = { v: 0.02, w: 0.05 };

/** Faster than this a robot that was told to stop does not obey: m/s and rad/s. */
const MOVES = { v: 0.05, w: 0.1 };

/** The gate has answered a STOP by then, in ms. */
export const ANSWER_PATIENCE = 300;

/** A robot that was stopped stands by then, in ms. */
export const STAND_PATIENCE = 1000;

/** How long a verdict that is good is shown, in ms. */
const SHOWN = 5000;

/**
 * What became of the STOP of one robot.
 *
 * @typedef {object} Verdict
 * @property {string} robot
 * @property {string} name
 * @property {'stopping' | 'confirmed' | 'unconfirmed'} state
 * @property {string} text
 */

/** @typedef {{since: number, answered: boolean, stoodAt: number | null}} Watch */

/**
 * Watches what becomes of the STOPs of this page, by what odometry says and by nothing
 * else: the gate says what it makes of that, and where it does not, the page looks.
 *
 * Times are in milliseconds of one clock.
 */
export class Stopping {
  constructor() {
    /**
     * By robot; with that of all if no robot was known to be stopped by it.
     * @type {Map<string, Watch>}
     */
    this._watched = new Map();
  }

  /**
   * A STOP was sent.
   *
   * @param {string} robot Or "*" for all.
   * @param {ReadonlyMap<string, RobotReport>} known The robots that there are.
   * @param {number} now
   */
  start(robot, known, now) {
    for (const id of robot === ALL && known.size > 0 ? known.keys() : [robot]) {
      // Where a STOP stands already there may be no news to answer with.
      const answered = known.get(id)?.latched === true;
      this._watched.set(id, { since: now, answered, stoodAt: null });
      const report = known.get(id);
      if (answered && report) this.report(report, now);
    }
  }

  /**
   * The gate spoke of a robot.
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
      // It was reset, or somebody drives it again; that is another story.
      this._watched.delete(report.robot);
      return;
    }
    if (stopped) watch.answered = true;
    const stood = report.stop ? report.stop.confirmed === true : stands(report);
    if (watch.answered && stood) watch.stoodAt ??= now;
    else watch.stoodAt = null;
  }

  /**
   * Watch a robot that is heard of after a STOP for all that met none. Others will be,
   * until the gate says of one that it is stopped.
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

  /** Forget all that is settled or was seen. */
  dismiss() {
    this._watched.clear();
  }

  /**
   * @param {ReadonlyMap<string, RobotReport>} robots
   * @param {boolean} connected Whether the gate can be heard.
   * @param {number} now
   * @returns {Verdict[]}
   */
  verdicts(robots, connected, now) {
    const verdicts = [];
    for (const [robot, watch] of this._watched) {
      if (robot === ALL && robots.size > 0) continue;
      const settled = watch.stoodAt !== null && connected;
      if (settled && now - Number(watch.stoodAt) > SHOWN) this._watched.delete(robot);
      else verdicts.push(judge(robot, robots.get(robot), watch, connected, now));
    }
    return verdicts;
  }
}

/**
 * Tells which robots move although they were given zero for a second: not obeying.
 *
 * A robot that stood once after its zero, or was given something else since, obeys: it
 * may be on its way to a goal, or somebody else's to drive.
 */
export class Obedience {
  constructor() {
    /**
     * When robots that moved were given zero.
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
    else if (stands(report)) this._zeroSince.delete(report.robot);
    else if (before && !isZero(before)) this._zeroSince.set(report.robot, now);
  }

  /**
   * A robot was told to go somewhere by itself, or is gone.
   *
   * @param {string} robot
   */
  excuse(robot) {
    this._zeroSince.delete(robot);
  }

  /**
   * @param {number} now
   * @returns {RobotReport[]} The newest word on each robot that does not obey.
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
    const text = "STOP NOT CONFIRMED: no answer from the gate";
    return { robot, name, state: "unconfirmed", text };
  }
  if (report?.stop?.confirmed === false) return unsure(report.stop.why);
  if (report?.link === "down") return unsure("no connection to the robot");
  if (watch.stoodAt !== null) {
    const more = [...besides(report?.stop?.why), ...(report?.hooks ?? [])];
    const words = ["stopped, confirmed by odometry", ...more];
    return { robot, name, state: "confirmed", text: words.join("; ") };
  }
  if (waited <= STAND_PATIENCE) {
    return { robot, name, state: "stopping", text: "stopping" };
  }
  if (!report?.measured) return unsure("no odometry");
  return unsure(`still moving at ${linearSpeed(report.measured).toFixed(2)} m/s`);
}

/**
 * Say of a robot for which a STOP stands what became of that.
 *
 * @param {RobotReport} report
 * @returns {{confirmed: boolean | null, text: string}} In words for a person; `confirmed`
 *     is null while it is not known.
 */
export function stopWords({ stop }) {
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
 * @param {string} [why] What the gate says of a STOP.
 * @returns {string[]} What it says besides whether the robot stands: that the disk does
 *     not have the STOP.
 */
function besides(why = "") {
  return why.split("; ").slice(1);
}

/**
 * Say which STOPs stand.
 *
 * @param {Iterable<RobotReport>} reports
 * @returns {string} "" when none does.
 */
export function standingStops(reports) {
  const stopped = [...reports].filter(isLatched);
  if (stopped.length === 0) return "";
  const doubtful = stopped.filter(({ stop }) => stop?.confirmed === false).length;
  const one = stopped.length === 1;
  const who = one ? stopped[0].name : `${stopped.length} robots`;
  const doubt = one ? "NOT CONFIRMED" : `${doubtful} NOT CONFIRMED`;
  const unhooked = stopped.filter(({ hooks }) => hooks?.length).map(({ name }) => name);
  const hooks = unhooked.length ? ` Stop hooks failed: ${unhooked.join(", ")}.` : "";
  const doubts = doubtful ? `, ${doubt}` : "";
  return `STOP active: ${who}${doubts}.${hooks}`;
}

/** @param {RobotReport} report */
function stands({ measured }) {
  if (!measured) return false;
  return linearSpeed(measured) < STANDS.v && angularSpeed(measured) < STANDS.w;
}

/** @param {RobotReport} report */
function isZero({ sent }) {
  return sent.every((value) => value === 0);
}
