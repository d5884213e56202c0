import { isNeutral } from "./axes.js";
import { heldByAnother, mayTake } from "./report.js";

/** @typedef {import('./inputs.js').Inputs} Inputs */
/** @typedef {import('./leases.js').Leases} Leases */
/** @typedef {import('./report.js').RobotReport} RobotReport */
/** @typedef {import('./stream.js').Command} Command */
/** @typedef {import('./stream.js').Stream} Stream */

/** A take that was not answered for this long is given up; ms. */
export const TAKE_PATIENCE = 1500;

/**
 * How this page comes by the lease of the robot that was chosen: by a press, by name, or
 * from a holder who was asked for it.
 *
 * Only a press that took a free robot goes on to drive it; in all other cases what is
 * held when the lease comes was not meant for that. Times are in milliseconds of one
 * clock.
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
     * Why the gate refused the last thing that was asked for the chosen robot.
     * @type {string | null}
     */
    this.refusal = null;
    /** What it was that was refused. */
    this.refused = "";
    /**
     * A lease that was asked for; `alive`: the press that did may drive by it.
     * @type {{robot: string, since: number, alive: boolean} | null}
     */
    this._asked = null;
    /**
     * Robots that another holds and that were asked for.
     * @type {Set<string>}
     */
    this._requested = new Set();
  }

  /** The robot whose lease was asked for to drive it, while that is not answered. */
  get robot() {
    return this._asked?.robot ?? null;
  }

  /** @param {string | null} robot The robot that a press drives from now on. */
  choose(robot) {
    this.choice = robot;
    this.refusal = null;
  }

  /**
   * Ask for a lease by name rather than by a press.
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
   * Ask the holder for a robot.
   *
   * @param {string} robot
   * @returns {Command[]}
   */
  ask(robot) {
    this._requested.add(robot);
    if (robot === this.choice) this.refusal = null;
    return [{ op: "ask", robot }];
  }

  /** @param {string} robot Whose STOP is being ended; or "*". */
  reset(robot) {
    if (robot === "*" || robot === this.choice) this.refusal = null;
  }

  /**
   * A press reaches for a lease where there is none.
   *
   * @param {number} now
   * @returns {Command[]}
   */
  step(now) {
    const { choice } = this;
    if (this._asked) {
      if (now - this._asked.since > TAKE_PATIENCE) {
        this.refusal = "no answer";
        this._giveUp(now);
      }
      return [];
    }
    if (this._stream.lease || !choice || isNeutral(this._inputs.axes)) return [];
    const report = this._leases.robots.get(choice);
    const epoch = this._leases.epoch(choice);
    if (epoch !== null) {
      this._open(choice, epoch, now);
      return [];
    }
    if (!report || !mayTake(report)) {
      this._inputs.block(now);
      return [];
    }
    this.refusal = null;
    this._asked = { robot: choice, since: now, alive: !heldByAnother(report) };
    return [{ op: "take", robot: choice }];
  }

  /**
   * The gate spoke of a robot: its lease may have come, or be another's.
   *
   * @param {RobotReport} report
   * @param {RobotReport | undefined} before What it said before.
   * @param {number} now
   */
  report(report, before, now) {
    const { robot } = report;
    const epoch = this._leases.epoch(robot);
    const asked = this._asked?.robot === robot ? this._asked : null;
    const handed = epoch !== null && this._requested.delete(robot);
    if (asked && epoch !== null) {
      this._asked = null;
      // Taken over, or not taken by a press: what is held now was meant for nothing.
      if (!asked.alive || (before && heldByAnother(before))) this._inputs.block(now);
      this._open(robot, epoch, now);
    } else if (asked && asked.alive && heldByAnother(report)) {
      this._giveUp(now);
    } else if (handed) {
      this._handed(robot, epoch, now);
    }
  }

  /**
   * Take the gate's refusal.
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
    // A command that met the end of its lease on the way is no news.
    if (what === "drive" && !this._stream.lease) return;
    this.refusal = why;
    this.refused = what;
    if (what === "take" && this._asked?.robot === robot) this._giveUp(now);
    if (what === "drive") this._stream.goNeutral(now);
  }

  /** Wait no more for the lease that was asked for. */
  end() {
    this._asked = null;
  }

  /** @param {string} robot The gate does not know it any more. */
  gone(robot) {
    this._requested.delete(robot);
  }

  /** Nothing is answered any more: the connection ended. */
  forget() {
    this._asked = null;
    this._requested.clear();
  }

  /**
   * A robot came that was asked for some time ago: what is held now was not meant for it.
   *
   * @param {string} robot
   * @param {number} epoch
   * @param {number} now
   */
  _handed(robot, epoch, now) {
    if (this._inputs.pressed) this._inputs.block(now);
    if (robot === this.choice) this._open(robot, epoch, now);
    // The operator has turned to another one; it is given back unless they return.
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
