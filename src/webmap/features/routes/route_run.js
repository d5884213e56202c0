import { look, sendGoal } from "../../web/tools/goals.js";

/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('../../web/motion/report.js').RobotReport} RobotReport */

/** @typedef {'going' | 'paused' | 'halted' | 'ended'} RunState */
/** @typedef {{send: Pose} | {cancel: true} | null} Action The next action. */

/**
 * Distance within which a robot that does not report its arrival has arrived; metres.
 */
const THERE = 0.3;

/** Longest time until the gate reports a goal that it has accepted, in ms. */
const PATIENCE = 5000;

/**
 * Least time between two goals of a loop whose points are all reached already, in ms:
 * nothing else would limit the rate.
 */
const LOOP_PERIOD = 1000;

/** A loop with fewer points would send the same goal for ever. */
export const LEAST_LOOP = 2;

/**
 * Decides how one robot follows a route: the next goal, and the end.
 *
 * This class sends nothing: every method returns the next action. After a failure, a
 * STOP, or the loss of control the run halts with a reason; only an operator can
 * continue it. No goal is sent twice, except by an operator.
 */
export class RouteRun {
  /**
   * @param {Pose[]} points
   * @param {{loop?: boolean}} [options] `loop`: whether the route begins again after
   *     the last point, if it has at least {@link LEAST_LOOP}.
   */
  constructor(points, { loop = false } = {}) {
    this.points = points;
    this.loop = loop && points.length >= LEAST_LOOP;
    /** The point that the robot drives to, counted from 0. */
    this.index = 0;
    /** @type {RunState} */
    this.state = "paused";
    /** Why the run does not continue, as text. */
    this.why = "";
    this.rounds = 0;
    /** @type {string | null} The gate's goal of this run. */
    this._goal = null;
    /** @type {string | null} The gate's goal before that. */
    this._before = null;
    /** @type {number | null} Time when the gate accepted the goal. */
    this._acceptedAt = null;
  }

  /** Whether the run is active, or can be continued. */
  get live() {
    return this.state !== "ended";
  }

  /**
   * Begin, or continue to the point that was not reached.
   *
   * @param {string | null} goal The robot's present goal in the gate.
   * @returns {Action}
   */
  go(goal) {
    if (this.state === "ended" || this.state === "going") return null;
    return this._send(goal);
  }

  /**
   * Skip the point that the robot drives to.
   *
   * @param {string | null} goal The robot's present goal in the gate.
   * @returns {Action}
   */
  skip(goal) {
    if (this.state === "ended") return null;
    const going = this.state === "going";
    if (!this._next()) return going ? { cancel: true } : null;
    return going || this.state === "halted" ? this._send(goal) : null;
  }

  /** @returns {Action} */
  pause() {
    if (this.state !== "going") return null;
    this.state = "paused";
    this.why = "";
    return { cancel: true };
  }

  /** @returns {Action} */
  end() {
    const going = this.state === "going";
    this.state = "ended";
    this.why = "";
    return going ? { cancel: true } : null;
  }

  /**
   * Handle that the gate has accepted the goal.
   *
   * @param {number} now
   */
  accepted(now) {
    if (this.state === "going") this._acceptedAt = now;
  }

  /**
   * Halt, because the goal was refused, or control of the robot is not available.
   *
   * @param {string} why
   */
  halt(why) {
    if (this.state !== "going") return;
    this.state = "halted";
    this.why = why;
  }

  /**
   * Handle the gate's report while the goal waits to be sent again.
   *
   * @param {Pick<RobotReport, 'latched' | 'goal'>} report
   * @returns {null}
   */
  waits({ latched, goal }) {
    if (latched) this.halt("STOP was pressed");
    else if (goal && goal.id !== this._before) this.halt("another goal was sent");
    return null;
  }

  /**
   * Handle the gate's report.
   *
   * @param {Pick<RobotReport, 'mine' | 'latched' | 'goal'>} report
   * @param {number | null} away Distance from the robot to its point, in metres.
   * @param {number} now
   * @returns {Action}
   */
  report({ mine, latched, goal }, away, now) {
    // Until the gate has accepted the goal, control may not be granted yet.
    if (this.state !== "going" || this._acceptedAt === null) return null;
    if (latched) return this._halted("STOP was pressed");
    if (!mine) return this._halted("this page no longer has control of the robot");
    if (!goal || goal.id === this._before) {
      const late = now - this._acceptedAt > PATIENCE;
      return late ? this._halted("the goal was not sent") : null;
    }
    this._goal ??= goal.id;
    if (goal.id !== this._goal) return this._halted("another goal was sent");
    const since = now - this._acceptedAt;
    if (goal.state === "reached") return this._arrived(goal.id, since);
    if (look(goal).over || goal.state === "cancelling") {
      const what = goal.state === "failed" ? "the goal failed" : "the goal was cancelled";
      return this._halted(goal.why ? `${what}: ${goal.why}` : what);
    }
    if (goal.state === "unknown") {
      return this._halted(`the state of the goal is unknown: ${goal.why}`);
    }
    const silent = goal.method === "topic" && away !== null && away < THERE;
    return silent ? this._arrived(goal.id, since) : null;
  }

  /** @param {string} why @returns {null} */
  _halted(why) {
    this.halt(why);
    return null;
  }

  /** @param {string} goal @param {number} since Age in ms. @returns {Action} */
  _arrived(goal, since) {
    // The robot is still here at the next call.
    if (this.loop && since < LOOP_PERIOD) return null;
    return this._next() ? this._send(goal) : null;
  }

  /** @returns {boolean} Whether there is a next point. */
  _next() {
    this.index += 1;
    if (this.index < this.points.length) return true;
    this.index = 0;
    this.rounds += 1;
    if (this.loop) return true;
    this.state = "ended";
    this.why = "";
    return false;
  }

  /** @param {string | null} goal @returns {Action} */
  _send(goal) {
    this.state = "going";
    this.why = "";
    this._before = goal;
    this._goal = this._acceptedAt = null;
    return { send: this.points[this.index] };
  }
}

/** @typedef {Pick<import('../../web/drive.js').Drive,
 *     'goal' | 'cancel' | 'keep' | 'holds' | 'robots' | 'on'>} Drive */

/**
 * A robot on its route.
 *
 * @typedef {object} Going
 * @property {RouteRun} run
 * @property {Pose | null} order The goal to send, until the gate has accepted it.
 * @property {boolean} busy Whether a request to the gate is unanswered.
 */

/**
 * The robots on routes: executes the actions of their runs, and reports events to the
 * runs.
 */
export class RouteRobots {
  /**
   * @param {Drive} drive
   * @param {(robot: string) => Pose | null} poseOf
   * @param {() => void} changed
   * @param {Map<string, {name: string, run: RouteRun}>} [runs] The runs of the previous
   *     tool.
   */
  constructor(drive, poseOf, changed, runs = new Map()) {
    this._drive = drive;
    this._poseOf = poseOf;
    this._changed = changed;
    /** @type {Map<string, Going>} */
    this._going = new Map();
    for (const [robot, { name, run }] of runs) {
      // A restarted display may use the same id for another robot.
      if (drive.robots.get(robot)?.name !== name) continue;
      this._going.set(robot, { run, order: null, busy: false });
    }
    this._offs = [
      drive.on("robot", ({ robot }) => this._look(robot)),
      drive.on("step", () => this._keep()),
      drive.on("stop", (robot) => this._stopped(robot)),
      drive.on("goal", (robot) => this._left(robot)),
    ];
  }

  /**
   * End the sending of further goals; robots continue to their present goals.
   *
   * @returns {Map<string, {name: string, run: RouteRun}>} The runs that another
   *     instance may continue; a goal that was being sent is not sent again
   *     automatically.
   */
  destroy() {
    const runs = new Map();
    for (const [robot, { run, order }] of this._going) {
      if (order !== null) run.halt("the map was drawn again");
      const name = this._drive.robots.get(robot)?.name;
      if (name !== undefined && run.live) runs.set(robot, { name, run });
    }
    this._going.clear();
    for (const off of this._offs) off();
    return runs;
  }

  /** @param {string | null} robot */
  of(robot) {
    return robot === null ? undefined : this._going.get(robot);
  }

  /** @param {string} robot @param {Pose[]} points @param {{loop: boolean}} options */
  begin(robot, points, options) {
    const run = new RouteRun(points, options);
    this._going.set(robot, { run, order: null, busy: false });
    this.act(robot, "go");
  }

  /** @param {string} robot @param {'go' | 'pause' | 'skip' | 'end'} what */
  act(robot, what) {
    const going = this._going.get(robot);
    const goal = this._drive.robots.get(robot)?.goal?.id ?? null;
    if (going) this._perform(robot, going, going.run[what](goal));
  }

  /** Update the positions of the robots. */
  look() {
    for (const robot of this._going.keys()) this._look(robot);
  }

  /** @param {string} robot @param {Going} going @param {Action} action */
  _perform(robot, going, action) {
    if (action && "send" in action) void this._send(robot, going, action.send);
    else if (action) this._drive.cancel(robot);
    this._changed();
  }

  /** @param {string} robot @param {Going} going @param {Pose} pose */
  async _send(robot, going, pose) {
    const { run } = going;
    const order = { ...pose };
    going.order = order;
    // Not after a pause and another goal, nor for another run.
    const wanted = () =>
      run.state === "going" && going.order === order && this._going.get(robot) === going;
    try {
      const accepted = await sendGoal(() => this._offer(robot, going, order), wanted);
      const given = this._going.get(robot) !== going;
      if (accepted && given && run.state !== "going") this._drive.cancel(robot);
      else if (accepted) run.accepted(performance.now());
    } catch (error) {
      run.halt(error instanceof Error ? error.message : String(error));
    }
    if (going.order === order) going.order = null;
    this._look(robot);
    this._changed();
  }

  /** @param {string} robot @param {Going} going @param {Pose} order */
  async _offer(robot, going, order) {
    going.busy = true;
    try {
      await this._drive.goal(robot, order);
    } finally {
      going.busy = false;
      this._changed();
    }
  }

  /**
   * Handle that this page has sent a goal.
   *
   * @param {string} robot
   */
  _left(robot) {
    const { run, order, busy } = this._going.get(robot) ?? {};
    if (!run || !order) return;
    if (!busy) run.halt("another goal was sent");
    // Canceled while control was being taken for it: the cancel was sent before the
    // goal.
    else if (run.state !== "going") this._drive.cancel(robot);
  }

  /** @param {string} stopped */
  _stopped(stopped) {
    for (const [robot, { run }] of this._going) {
      if (stopped === "*" || stopped === robot) run.halt("STOP was pressed");
    }
    this._changed();
  }

  _keep() {
    for (const [robot, { run }] of this._going) {
      if (run.state === "going") this._drive.keep(robot);
    }
  }

  /** @param {string} robot */
  _look(robot) {
    const going = this._going.get(robot);
    if (!going || going.busy || going.run.state !== "going") return;
    const { run } = going;
    const report = this._drive.robots.get(robot);
    if (!report) {
      run.halt("the robot is gone");
      return;
    }
    const at = this._poseOf(robot);
    const point = run.points[run.index];
    const away = at && Math.hypot(at.x - point.x, at.y - point.y);
    const shown = { ...report, mine: this._drive.holds(robot) };
    const now = performance.now();
    this._perform(robot, going, going.order ? run.waits(shown) : run.report(shown, away, now));
  }
}

/** A map that does not return within this time is another map; ms. */
export const KEPT_FOR = 5000;

/**
 * The state that a route tool leaves behind: its points, and the robots' runs.
 *
 * @typedef {object} Route
 * @property {Pose[]} points
 * @property {boolean} loop
 * @property {boolean} open Whether the panel was unfolded.
 * @property {Map<string, {name: string, run: RouteRun}>} runs By robot.
 */

/** @type {Map<number, {route: Route, at: number}>} */
const kept = new Map();

/**
 * Keep a route for the next tool on the same map: when the page's connection is lost,
 * the whole page content is drawn again, and this tool is removed.
 *
 * @param {number} map
 * @param {Route} route
 * @param {number} now
 */
export function storeRoute(map, route, now) {
  kept.set(map, { route, at: now });
}

/**
 * @param {number} map
 * @param {number} now
 * @returns {Route | null} The route that was kept a moment ago; it is no longer kept
 *     afterwards.
 */
export function takeStoredRoute(map, now) {
  const { route, at } = kept.get(map) ?? { route: null, at: 0 };
  kept.delete(map);
  return route !== null && now - at < KEPT_FOR ? route : null;
}
