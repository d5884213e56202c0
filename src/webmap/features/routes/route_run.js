import { look, sendGoal } from "../../web/tools/goal_words.js";

/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('../../web/motion/report.js').RobotReport} RobotReport */

/** @typedef {'going' | 'paused' | 'halted' | 'ended'} RunState */
/** @typedef {{send: Pose} | {cancel: true} | null} Action What is to be done now. */

/** A robot that does not say that it is there is, when it is as near as this; metres. */
const THERE = 0.3;

/** For how long the gate may take to tell of a goal that it accepted, in ms. */
const PATIENCE = 5000;

/**
 * A loop whose points are all reached already sends a goal as seldom as this, in ms:
 * nothing else would hold it back.
 */
const LOOP_PERIOD = 1000;

/** With fewer points a loop would send the same goal for ever. */
export const LEAST_LOOP = 2;

/**
 * Decides how one robot goes along a route: which goal is next, and when it ends.
 *
 * Sends nothing by itself: every method returns what is to be done. After a failure, a
 * STOP, or when the lease is gone it halts and says why; only a person lets it go on. No
 * goal is sent twice but by a person.
 */
export class RouteRun {
  /**
   * @param {Pose[]} points
   * @param {{loop?: boolean}} [options] `loop`: whether it begins anew after the last
   *     point, if there are {@link LEAST_LOOP} at least.
   */
  constructor(points, { loop = false } = {}) {
    this.points = points;
    this.loop = loop && points.length >= LEAST_LOOP;
    /** The point that it goes to, counted from 0. */
    this.index = 0;
    /** @type {RunState} */
    this.state = "paused";
    /** Why it does not go on, in words. */
    this.why = "";
    this.rounds = 0;
    /** @type {string | null} The goal that the gate has of it. */
    this._goal = null;
    /** @type {string | null} What the gate had before. */
    this._before = null;
    /** @type {number | null} When the gate accepted it. */
    this._acceptedAt = null;
  }

  /** Whether it goes, or may go on. */
  get live() {
    return this.state !== "ended";
  }

  /**
   * Begin, or go on to the point that was not reached.
   *
   * @param {string | null} goal The goal that the gate has of the robot now.
   * @returns {Action}
   */
  go(goal) {
    if (this.state === "ended" || this.state === "going") return null;
    return this._send(goal);
  }

  /**
   * Leave out the point that it goes to.
   *
   * @param {string | null} goal The goal that the gate has of the robot now.
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
   * The gate has accepted the goal that was to be sent.
   *
   * @param {number} now
   */
  accepted(now) {
    if (this.state === "going") this._acceptedAt = now;
  }

  /**
   * The goal was not taken, or the robot cannot be had.
   *
   * @param {string} why
   */
  halt(why) {
    if (this.state !== "going") return;
    this.state = "halted";
    this.why = why;
  }

  /**
   * Take what the gate says of the robot while the goal waits to be offered again.
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
   * Take what the gate says of the robot.
   *
   * @param {Pick<RobotReport, 'mine' | 'latched' | 'goal'>} report
   * @param {number | null} away How far the robot is from its point, in metres.
   * @param {number} now
   * @returns {Action}
   */
  report({ mine, latched, goal }, away, now) {
    // Until the gate has accepted the goal the lease may be on its way.
    if (this.state !== "going" || this._acceptedAt === null) return null;
    if (latched) return this._halted("STOP was pressed");
    if (!mine) return this._halted("this page has no control of the robot any more");
    if (!goal || goal.id === this._before) {
      const late = now - this._acceptedAt > PATIENCE;
      return late ? this._halted("the goal was not sent") : null;
    }
    this._goal ??= goal.id;
    if (goal.id !== this._goal) return this._halted("another goal was sent");
    const since = now - this._acceptedAt;
    if (goal.state === "reached") return this._arrived(goal.id, since);
    if (look(goal).over || goal.state === "cancelling") {
      const what = goal.state === "failed" ? "failed" : "its goal was cancelled";
      return this._halted(goal.why ? `${what}: ${goal.why}` : what);
    }
    const silent = goal.way === "topic" && away !== null && away < THERE;
    return silent ? this._arrived(goal.id, since) : null;
  }

  /** @param {string} why @returns {null} */
  _halted(why) {
    this.halt(why);
    return null;
  }

  /** @param {string} goal @param {number} since How old it is. @returns {Action} */
  _arrived(goal, since) {
    // The next look at the robot finds it here still.
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
 * @property {Pose | null} order Where it is to be sent, until the gate has accepted that.
 * @property {boolean} busy Whether the gate is being asked, and has not answered.
 */

/** The robots that are on routes: does what their runs decide, and tells them the news. */
export class RouteRobots {
  /**
   * @param {Drive} drive
   * @param {(robot: string) => Pose | null} poseOf
   * @param {() => void} changed
   * @param {Map<string, {name: string, run: RouteRun}>} [runs] Those of the tool before.
   */
  constructor(drive, poseOf, changed, runs = new Map()) {
    this._drive = drive;
    this._poseOf = poseOf;
    this._changed = changed;
    /** @type {Map<string, Going>} */
    this._going = new Map();
    for (const [robot, { name, run }] of runs) {
      // A display that was started anew may call another robot so.
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
   * Nobody is left to send the next goals; those under way stay as they are.
   *
   * @returns {Map<string, {name: string, run: RouteRun}>} Who may go on by others of its
   *     kind: what was being sent is not sent again by itself.
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
    if (going) this._perform(robot, going, going.run[what](this._goalOf(robot)));
  }

  /** Look where the robots are. */
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
    // Not after a pause and another order, nor on another run.
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
   * A goal has left this page.
   *
   * @param {string} robot
   */
  _left(robot) {
    const { run, order, busy } = this._going.get(robot) ?? {};
    if (!run || !order) return;
    if (!busy) run.halt("another goal was sent");
    // Called off while the lease was taken for it: the cancel was sent before it.
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
    const told = { ...report, mine: this._drive.holds(robot) };
    const now = performance.now();
    this._perform(robot, going, going.order ? run.waits(told) : run.report(told, away, now));
  }

  /** @param {string} robot */
  _goalOf(robot) {
    return this._drive.robots.get(robot)?.goal?.id ?? null;
  }
}

/** A map that is not there again by then is another one, in ms. */
export const KEPT_FOR = 5000;

/**
 * What a tool for routes leaves behind: its points, and who goes along what.
 *
 * @typedef {object} Route
 * @property {Pose[]} points
 * @property {boolean} loop
 * @property {boolean} open Whether its panel was unfolded.
 * @property {Map<string, {name: string, run: RouteRun}>} runs By robot.
 */

/** @type {Map<number, {route: Route, at: number}>} */
const kept = new Map();

/**
 * Keep a route for the tool that comes next on the same map: when the link of the page
 * breaks, everything on it is drawn anew, and this tool is taken away with it.
 *
 * @param {number} map
 * @param {Route} route
 * @param {number} now
 */
export function keepRoute(map, route, now) {
  kept.set(map, { route, at: now });
}

/**
 * @param {number} map
 * @param {number} now
 * @returns {Route | null} What was kept a moment ago; it is kept no longer.
 */
export function keptRoute(map, now) {
  const { route, at } = kept.get(map) ?? { route: null, at: 0 };
  kept.delete(map);
  return route !== null && now - at < KEPT_FOR ? route : null;
}
