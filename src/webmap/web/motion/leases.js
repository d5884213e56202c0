/** The leases of this page, and how they are requested. */

import { isNeutral } from "./inputs.js";
import { RefusalNote, heldByAnother, mayTake } from "./report.js";

/** @typedef {import('./commands.js').Command} Command */
/** @typedef {import('./inputs.js').Inputs} Inputs */
/** @typedef {import('./report.js').RobotReport} RobotReport */
/** @typedef {import('./commands.js').Stream} Stream */

/**
 * The leases that this page has, keeps without driving, or has released.
 *
 * Times are in milliseconds of one clock.
 */
export class Leases {
  constructor() {
    /**
     * The newest report of each robot.
     * @type {Map<string, RobotReport>}
     */
    this.robots = new Map();
    /**
     * When each lease that is kept without driving was last used.
     * @type {Map<string, number>}
     */
    this._parked = new Map();
    /**
     * The epochs of released leases: later reports of these are outdated.
     * @type {Map<string, number>}
     */
    this._given = new Map();
  }

  /**
   * @param {string} robot
   * @returns {number | null} The epoch of this page's lease on the robot.
   */
  epoch(robot) {
    const report = this.robots.get(robot);
    if (!report?.mine || this._given.get(robot) === report.epoch) return null;
    return report.epoch;
  }

  /**
   * Note that a lease was released: later reports of it are outdated.
   *
   * @param {string} robot
   * @param {number} epoch
   */
  giveBack(robot, epoch) {
    this._given.set(robot, epoch);
  }

  /**
   * Keep a lease without driving.
   *
   * @param {string} robot
   * @param {number} now
   */
  park(robot, now) {
    this._parked.set(robot, now);
  }

  /**
   * Note the use of a lease, if it is kept without driving.
   *
   * @param {string} robot
   * @param {number} now
   */
  use(robot, now) {
    if (this._parked.has(robot)) this._parked.set(robot, now);
  }

  /**
   * End keeping a lease without driving.
   *
   * @param {string} robot Or "*".
   */
  unpark(robot) {
    if (robot === "*") this._parked.clear();
    else this._parked.delete(robot);
  }

  /**
   * @param {number} now
   * @param {number} patience In ms.
   * @returns {string[]} The robots whose kept leases were not used for this time.
   */
  unused(now, patience) {
    return [...this._parked]
      .filter(([, since]) => now - since >= patience)
      .map(([robot]) => robot);
  }

  /**
   * Process a report of the gate.
   *
   * @param {RobotReport} report
   * @returns {RobotReport | undefined} The previous report.
   */
  report(report) {
    const before = this.robots.get(report.robot);
    this.robots.set(report.robot, report);
    if (!report.mine) {
      this._parked.delete(report.robot);
      this._given.delete(report.robot);
    }
    return before;
  }

  /**
   * Forget a robot that the gate does not know any more.
   *
   * @param {string} robot
   */
  gone(robot) {
    this.robots.delete(robot);
    this._parked.delete(robot);
  }

  /** Forget all leases: they ended with the connection. */
  forget() {
    this._parked.clear();
    this._given.clear();
    for (const [id, report] of this.robots) {
      this.robots.set(id, { ...report, mine: false });
    }
  }
}

/** A request for a lease without an answer is given up after this time; ms. */
export const TAKE_PATIENCE = 1500;

/**
 * Requests the lease of the chosen robot: by a press, by a button, or from its holder.
 *
 * Only a press that takes a free robot also drives it. In all other cases the inputs that
 * are pressed when the lease arrives do not move the robot. Times are in milliseconds of
 * one clock.
 */
export class LeaseRequests {
  /**
   * @param {Inputs} inputs
   * @param {Leases} leases
   * @param {Stream} stream
   */
  constructor(inputs, leases, stream) {
    this._inputs = inputs;
    this._leases = leases;
    this._stream = stream;
    /**
     * The robot that a press drives.
     * @type {string | null}
     */
    this.choice = null;
    /**
     * Why the gate refused the last request for the chosen robot.
     * @type {RefusalNote | null}
     */
    this.refusal = null;
    /**
     * The requested lease; `alive`: the press that requested it may drive the robot.
     * @type {{robot: string, since: number, alive: boolean} | null}
     */
    this._asked = null;
    /**
     * Robots of other holders that were requested.
     * @type {Set<string>}
     */
    this._requested = new Set();
  }

  /** The robot whose lease was requested for driving, until the answer arrives. */
  get robot() {
    return this._asked?.robot ?? null;
  }

  /** @param {string | null} robot The robot that a press drives now. */
  choose(robot) {
    this.choice = robot;
    this.refusal = null;
  }

  /**
   * Request a lease by a button, not by a press of a drive input.
   *
   * @param {string} robot
   * @param {number} now
   * @returns {Command[]}
   */
  take(robot, now) {
    if (robot === this.choice) {
      this._asked = { robot, since: now, alive: false };
      this.refusal = null;
    }
    return [{ op: "take", robot }];
  }

  /**
   * Request a robot from its holder.
   *
   * @param {string} robot
   * @returns {Command[]}
   */
  ask(robot) {
    this._requested.add(robot);
    if (robot === this.choice) this.refusal = null;
    return [{ op: "ask", robot }];
  }

  /** @param {string} robot The robot whose STOP the operator resets; or "*". */
  reset(robot) {
    if (robot === "*" || robot === this.choice) this.refusal = null;
  }

  /**
   * Send commands under the lease of the chosen robot, if this page has it.
   *
   * @param {number} now
   * @returns {boolean} Whether it has it.
   */
  use(now) {
    const { choice } = this;
    const epoch = choice === null ? null : this._leases.epoch(choice);
    if (choice === null || epoch === null) return false;
    if (this._stream.lease === null) this._open(choice, epoch, now);
    return true;
  }

  /**
   * Request the lease if an input is pressed and there is none.
   *
   * @param {number} now
   * @returns {Command[]}
   */
  step(now) {
    const { choice } = this;
    this._look(now);
    if (this._asked) {
      if (now - this._asked.since > TAKE_PATIENCE) {
        this.refusal = new RefusalNote("no answer from the gate", "take", now);
        this._giveUp(now);
      }
      return [];
    }
    if (this._stream.lease || !choice || isNeutral(this._inputs.axes)) return [];
    if (this.use(now)) return [];
    const report = this._leases.robots.get(choice);
    if (!report || !mayTake(report)) {
      this._inputs.block(now);
      return [];
    }
    this.refusal = null;
    this._asked = { robot: choice, since: now, alive: !heldByAnother(report) };
    return [{ op: "take", robot: choice }];
  }

  /**
   * Process a report of the gate: this page or another may have the lease now.
   *
   * @param {RobotReport} report
   * @param {RobotReport | undefined} before The previous report.
   * @param {number} now
   */
  report(report, before, now) {
    const { robot } = report;
    const epoch = this._leases.epoch(robot);
    if (robot === this.choice) this._look(now);
    const asked = this._asked?.robot === robot ? this._asked : null;
    const handed = epoch !== null && this._requested.delete(robot);
    if (asked && epoch !== null) {
      this._asked = null;
      // Taken over, or not taken by a press: the pressed inputs must not move it.
      if (!asked.alive || (before && heldByAnother(before))) this._inputs.block(now);
      this._open(robot, epoch, now);
    } else if (asked && asked.alive && heldByAnother(report)) {
      this._giveUp(now);
    } else if (handed) {
      this._handed(robot, epoch, now);
    } else if (epoch !== null && before && !before.mine && robot !== this.robot) {
      // For a goal, perhaps of the program in this page's name. Unused, it is released.
      if (this._inputs.pressed) this._inputs.block(now);
      this._leases.park(robot, now);
    }
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
    if (what === "ask" && robot !== null) this._requested.delete(robot);
    if (robot !== this.choice) return;
    // The tool that sent a goal or a pose shows why.
    if (what === "goal" || what === "locate") return;
    // A command that arrived after the end of its lease needs no message.
    if (what === "drive" && !this._stream.lease) return;
    this.refusal = new RefusalNote(why, what, now);
    this._look(now);
    if (what === "take" && this._asked?.robot === robot) this._giveUp(now);
    if (what === "drive") this._stream.goNeutral(now);
  }

  /** Stop waiting for the requested lease. */
  end() {
    this._asked = null;
  }

  /** @param {string} robot A robot that the gate does not know any more. */
  gone(robot) {
    this._requested.delete(robot);
  }

  /** Forget all requests: the connection ended. */
  forget() {
    this._asked = null;
    this._requested.clear();
  }

  /** @param {number} now End the note about a refusal with its cause. */
  _look(now) {
    const report = this._leases.robots.get(this.choice ?? "");
    if (this.refusal?.isOver(report, now)) this.refusal = null;
  }

  /**
   * The holder handed a robot over: inputs that are pressed now must not move it.
   *
   * @param {string} robot
   * @param {number} epoch
   * @param {number} now
   */
  _handed(robot, epoch, now) {
    if (this._inputs.pressed) this._inputs.block(now);
    if (robot === this.choice) this._open(robot, epoch, now);
    // The operator has chosen another robot; unused, this lease is released later.
    else this._leases.park(robot, now);
  }

  /**
   * @param {string} robot
   * @param {number} epoch
   * @param {number} now
   */
  _open(robot, epoch, now) {
    this._leases.unpark(robot);
    this._stream.open(robot, epoch, now);
  }

  /** @param {number} now */
  _giveUp(now) {
    this._asked = null;
    this._inputs.block(now);
  }
}
