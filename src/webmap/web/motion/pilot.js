import { TAKE_PATIENCE, LeaseRequests, Leases } from "./leases.js";
import { Stream } from "./commands.js";

/** @typedef {import('./inputs.js').Inputs} Inputs */
/** @typedef {import('./round_trips.js').RoundTrips} RoundTrips */
/** @typedef {import('./report.js').RobotReport} RobotReport */
/** @typedef {import('./commands.js').Command} Command */

/** The time between two renewals of a lease, in ms. */
const RENEW = 10_000;

/**
 * Decides what this page sends to the gate: which lease to take, keep and release, and
 * the axes to send with it.
 *
 * It is called at 20 Hz and after every change, and returns the messages to send. A robot
 * moves only with: an attentive page, inputs that are not blocked, an open loop to its
 * gate, a lease on the chosen robot, and neutral commands that the gate has received for a
 * while since {@link Pilot#goNeutral}. Times are in milliseconds of one clock.
 */
export class Pilot {
  /**
   * @param {Inputs} inputs
   * @param {RoundTrips} loops
   * @param {number} now
   * @param {{releaseAfter?: number}} [options] `releaseAfter`: the lease is
   *     released after this time without motion, in ms.
   */
  constructor(inputs, loops, now, { releaseAfter = 30_000 } = {}) {
    this.inputs = inputs;
    this.releaseAfter = releaseAfter;
    this._stream = new Stream(inputs, loops, now);
    this._leases = new Leases();
    /**
     * When each lease was last renewed.
     * @type {Map<string, number>}
     */
    this._renewed = new Map();
    this._requests = new LeaseRequests(inputs, this._leases, this._stream);
    /**
     * The stop test to begin when the gate has received neutral commands for a while.
     * @type {{robot: string, since: number} | null}
     */
    this._test = null;
  }

  /** The newest report of each robot. */
  get robots() {
    return this._leases.robots;
  }

  /** The ages of the camera pictures that the operator drives by. */
  get pictures() {
    return this._stream.pictures;
  }

  /** The robot that this page drives, moving or not; null without a lease. */
  get driven() {
    return this._stream.lease?.robot ?? null;
  }

  /** Whether the gate has received enough neutral commands to accept a press. */
  get settled() {
    return this._armed && this._stream.settled;
  }

  /** Whether the gate lets the driven robot move, by its last report. */
  get _armed() {
    const { driven } = this;
    return driven !== null && this.robots.get(driven)?.armed !== false;
  }

  /** The state of the chosen robot and of the inputs, for the operator. */
  get status() {
    const { choice, refusal, robot } = this._requests;
    return {
      choice,
      report: choice === null ? null : (this.robots.get(choice) ?? null),
      driven: this.driven,
      taking: robot !== null,
      settled: this.settled,
      early: this._stream.early(choice),
      pressed: this.inputs.pressed,
      blocked: this.inputs.blocked,
      frozen: this.inputs.frozen,
      axes: this.inputs.axes,
      refusal: refusal?.text ?? null,
      refused: refusal?.what ?? "",
      delay: this._stream.delay,
    };
  }

  /**
   * @param {string} robot
   * @returns {number | null} The epoch of this page's lease on the robot.
   */
  epoch(robot) {
    return this._leases.epoch(robot);
  }

  /**
   * Choose the robot that a press drives. The lease of the previous robot is released,
   * and inputs that are pressed now do not move the new one.
   *
   * @param {string | null} robot
   * @param {number} now
   * @returns {Command[]}
   */
  choose(robot, now) {
    if (robot === this._requests.choice) return [];
    const messages = this.letGo(now);
    this._requests.choose(robot);
    if (this.inputs.pressed) this.inputs.block(now);
    return messages;
  }

  /**
   * Request a lease by a button, not by a press of a drive input.
   *
   * @param {string} robot
   * @param {number} now
   */
  take(robot, now) {
    return this._requests.take(robot, now);
  }

  /**
   * Request a robot from its holder.
   *
   * @param {string} robot
   */
  ask(robot) {
    return this._requests.ask(robot);
  }

  /**
   * Hand a robot over to the requester, neutral first.
   *
   * The lease is kept until the gate reports another holder, because the requester may be
   * gone.
   *
   * @param {string} robot
   * @param {number} now
   * @returns {Command[]}
   */
  grant(robot, now) {
    const grant = { op: "grant", robot };
    if (robot !== this.driven) return [grant];
    this.goNeutral(now);
    return [...this._stream.neutral(now), grant];
  }

  /**
   * Release a lease, neutral first.
   *
   * @param {string} robot
   * @param {number} now
   * @returns {Command[]}
   */
  release(robot, now) {
    if (this._concerns(robot)) return this.letGo(now);
    const epoch = this.epoch(robot);
    this._leases.unpark(robot);
    if (epoch === null) return [];
    this._leases.giveBack(robot, epoch);
    return [{ op: "release", robot }];
  }

  /**
   * Release the robot that is driven or requested, neutral first.
   *
   * @param {number} now
   * @returns {Command[]}
   */
  letGo(now) {
    const robot = this.driven ?? this._requests.robot;
    if (robot === null) return [];
    const last = this._stream.neutral(now);
    if (this.inputs.pressed) this.inputs.block(now);
    this._end();
    return [...last, { op: "release", robot }];
  }

  /**
   * Return the command that sends a goal or sets a pose. The lease is kept, and released
   * when it is unused.
   *
   * @param {'goal' | 'locate'} op
   * @param {string} robot
   * @param {{x: number, y: number, yaw: number}} pose Metres and radians.
   * @param {number} now
   */
  place(op, robot, pose, now) {
    if (robot !== this.driven) this._leases.park(robot, now);
    const { seq, tick } = this._stream.stamp(robot);
    return { op, robot, epoch: this.epoch(robot), seq, tick, ...pose };
  }

  /**
   * Renew the lease of a robot that has a goal.
   *
   * @param {string} robot
   * @param {number} now
   * @returns {Command[]}
   */
  keep(robot, now) {
    this._leases.use(robot, now);
    const { lease } = this._stream;
    if (lease?.robot === robot) lease.usedAt = now;
    const epoch = this.epoch(robot);
    const since = now - (this._renewed.get(robot) ?? -Infinity);
    if (epoch === null || since < RENEW) return [];
    this._renewed.set(robot, now);
    return [{ op: "renew", robot, epoch }];
  }

  /**
   * Begin a stop test as soon as the gate has received neutral commands for a while. A page
   * that took control for a goal has sent none until now.
   *
   * @param {string} robot
   * @param {number} now
   */
  stopTest(robot, now) {
    this.goNeutral(now);
    if (robot === this._requests.choice) this._requests.use(now);
    this._test = { robot, since: now };
  }

  /**
   * @param {number} now
   * @returns {Command[]}
   */
  _beginTest(now) {
    if (this._test === null) return [];
    const { robot, since } = this._test;
    const held = this.inputs.pressed;
    const ready = this.driven === robot && this.settled;
    if (!held && !ready && now - since < TAKE_PATIENCE) return [];
    this._test = null;
    if (!held) return [{ op: "stop-test", robot }];
    this.refuse(robot, "stop-test", "release all inputs first", now);
    return [];
  }

  /**
   * Go neutral now; inputs have no effect until they are released and pressed again.
   *
   * @param {number} now
   * @param {{drop?: boolean}} [how] `drop`: also forget the pressed inputs,
   *     because this page may not receive their release.
   */
  goNeutral(now, how) {
    this._test = null;
    this._stream.goNeutral(now, how);
  }

  /**
   * STOP was pressed: it ends the leases of that robot, or of all.
   *
   * @param {string} robot Or "*".
   * @param {number} now
   */
  stopped(robot, now) {
    this.goNeutral(now);
    this._leases.unpark(robot);
    if (robot === "*" || this._concerns(robot)) this._end();
  }

  /**
   * The operator resets a STOP: inputs that are pressed now have no effect.
   *
   * @param {string} robot Or "*".
   * @param {number} now
   */
  reset(robot, now) {
    this._requests.reset(robot);
    this.inputs.block(now);
  }

  /** Forget all leases: they ended with the connection. */
  disconnect() {
    this._requests.forget();
    this._leases.forget();
    this._stream.restart();
  }

  /**
   * Process a report of the gate.
   *
   * @param {RobotReport} report
   * @param {number} now
   */
  report(report, now) {
    const { robot, armed } = report;
    const before = this._leases.report(report);
    const { lease } = this._stream;
    if (lease?.robot === robot) {
      const lost = lease.epoch !== this.epoch(robot);
      if (lost) this._stream.close();
      // If the gate disarms, it has a reason to stop that this page does not know.
      if (lost || (before?.armed && !armed)) this.goNeutral(now);
    }
    this._requests.report(report, before, now);
  }

  /**
   * Forget a robot that the gate does not know any more.
   *
   * @param {string} robot
   * @param {number} now
   */
  gone(robot, now) {
    this._leases.gone(robot);
    this._requests.gone(robot);
    if (!this._concerns(robot)) return;
    this._requests.end();
    this._stream.close();
    this.goNeutral(now);
  }

  /**
   * Process a refusal of the gate.
   *
   * @param {string | null} robot
   * @param {string} what
   * @param {string} why
   * @param {number} now
   */
  refuse(robot, what, why, now) {
    this._requests.refuse(robot, what, why, now);
  }

  /**
   * Decide what to send now.
   *
   * @param {number} now
   * @param {boolean} attentive Whether the page is visible, has the focus, and no
   *     text field has it.
   * @returns {Command[]}
   */
  step(now, attentive) {
    this._stream.look(now, attentive, this._requests.choice);
    const reached = this._requests.step(now);
    const commands = [...reached, ...this._stream.step(this._armed, now)];
    return [...commands, ...this._beginTest(now), ...this._tidy(now)];
  }

  /**
   * Release leases that were not used for a while.
   *
   * @param {number} now
   * @returns {Command[]}
   */
  _tidy(now) {
    const { lease } = this._stream;
    const idle = lease !== null && now - lease.usedAt >= this.releaseAfter;
    const driven = idle ? this.letGo(now) : [];
    const parked = this._leases.unused(now, this.releaseAfter);
    return [...driven, ...parked.flatMap((robot) => this.release(robot, now))];
  }

  /** End driving or the request for it: reports of that lease are outdated. */
  _end() {
    const { lease } = this._stream;
    if (lease) this._leases.giveBack(lease.robot, lease.epoch);
    this._requests.end();
    this._stream.close();
    this._test = null;
  }

  /**
   * @param {string} robot
   * @returns {boolean} Whether this page drives the robot or has requested it.
   */
  _concerns(robot) {
    return robot === this.driven || robot === this._requests.robot;
  }
}
