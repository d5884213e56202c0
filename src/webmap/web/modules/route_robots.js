import { RouteRun } from "./route_run.js";
import { sendGoal } from "./send_goal.js";

/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('./route_run.js').Action} Action */
/** @typedef {Pick<import('../drive.js').Drive,
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
      if (order !== null) run.halt("the map was drawn anew");
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
