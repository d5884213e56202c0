import { NEUTRAL, isNeutral } from "./axes.js";
import { heldByAnother, mayReach } from "./report.js";

/** @typedef {import('./axes.js').Axes} Axes */
/** @typedef {import('./hands.js').Hands} Hands */
/** @typedef {import('./loop.js').Loop} Loop */
/** @typedef {import('./report.js').RobotReport} RobotReport */

/** @typedef {{op: string, robot: string, [field: string]: unknown}} Command */

/**
 * For how long neutral is streamed, counted from the gate's first acknowledgement of
 * it, before a new lease moves anything; ms. The gate asks for 200 ms of neutral as
 * it saw them; counting from the acknowledgement makes sure that it did, whatever
 * the delay on the way.
 */
export const SETTLE = 250;

/** A take that was not answered for this long is given up; ms. */
export const TAKE_PATIENCE = 1500;

/** The oldest picture that a robot is driven by, once a camera was chosen; ms. */
export const BLIND = 1000;

/** Steps come every 50 ms; after a longer gap than this the page was not awake; ms. */
export const ASLEEP = 250;

/**
 * Decides what this page says to the gate: which lease to take, keep and give back,
 * and the axes to send with it.
 *
 * It is stepped at 20 Hz and at once when something changed, and returns the
 * messages to send. Motion needs all of: an attentive page, hands that are alive, an
 * open loop, a lease on the chosen robot, and a stretch of neutral that the gate has
 * seen since the last doubt. Times are in milliseconds of one clock.
 */
export class Pilot {
  /**
   * @param {Hands} hands
   * @param {Loop} loop
   * @param {number} now
   * @param {{releaseAfter?: number}} [options] `releaseAfter`: after this long
   *     without motion the lease is given back, in ms.
   */
  constructor(hands, loop, now, { releaseAfter = 30_000 } = {}) {
    this.hands = hands;
    this.loop = loop;
    this.releaseAfter = releaseAfter;
    /**
     * The newest report of each robot.
     * @type {Map<string, RobotReport>}
     */
    this.robots = new Map();
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
    this._seq = 0;
    this._steppedAt = now;
    /**
     * A lease that was asked for.
     * @type {{robot: string, since: number, alive: boolean} | null}
     */
    this._asked = null;
    /**
     * The lease that drives.
     * @type {{robot: string, epoch: number, firstNeutral: number | null,
     *     seenSince: number | null, movedAt: number} | null}
     */
    this._lease = null;
    /**
     * Robots that another holds and that were asked for.
     * @type {Set<string>}
     */
    this._begged = new Set();
    /**
     * When leases that serve a goal were last used.
     * @type {Map<string, number>}
     */
    this._parked = new Map();
    /**
     * Epochs that were given back, of which late reports must not be believed.
     * @type {Map<string, number>}
     */
    this._given = new Map();
    /**
     * The ages of the pictures that the operator goes by, in ms, by robot.
     * @type {Map<string, () => number>}
     */
    this.video = new Map();
  }

  /** The robot that this page drives, moving or not; null without a lease. */
  get driven() {
    return this._lease?.robot ?? null;
  }

  /** Whether the gate has seen enough neutral to let a press through. */
  get settled() {
    const lease = this._lease;
    if (lease === null || lease.seenSince === null) return false;
    return (
      this.robots.get(lease.robot)?.armed !== false &&
      this._steppedAt - lease.seenSince >= SETTLE
    );
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

  /** Whether the picture that the operator goes by is too old to drive by (S16). */
  get blind() {
    return this._lease !== null && (this._pictureAge(this._lease.robot) ?? 0) > BLIND;
  }

  /**
   * @param {string} robot
   * @returns {number | undefined} In whole ms; undefined if no camera was chosen.
   */
  _pictureAge(robot) {
    const age = this.video.get(robot)?.();
    return age === undefined ? undefined : Math.round(Math.min(Math.max(age, 0), 1e9));
  }

  /** What the operator should know of the chosen robot and of the hands. */
  get status() {
    const waited = this.loop.age(this._steppedAt);
    return {
      choice: this.choice,
      report: this.choice === null ? null : (this.robots.get(this.choice) ?? null),
      driven: this.driven,
      taking: this._asked !== null,
      settled: this.settled,
      pressed: this.hands.pressed,
      dead: this.hands.dead,
      axes: this.hands.axes,
      refusal: this.refusal,
      refused: this.refused,
      delay: this.loop.delay === null ? null : Math.max(this.loop.delay, waited),
    };
  }

  /**
   * Choose the robot that a press drives. The one driven until now is let go of,
   * and what is held at this moment does nothing to the new one.
   *
   * @param {string | null} robot
   * @param {number} now
   * @returns {Command[]}
   */
  choose(robot, now) {
    if (robot === this.choice) return [];
    const messages = this.letGo(now);
    this.choice = robot;
    this.refusal = null;
    if (this.hands.pressed) this.hands.kill(now);
    return messages;
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
    this._begged.add(robot);
    if (robot === this.choice) this.refusal = null;
    return [{ op: "ask", robot }];
  }

  /**
   * Hand a robot to the one who asks for it, neutral first.
   *
   * The lease is kept until the gate says that it is another's, as the one who asks may
   * be gone by now.
   *
   * @param {string} robot
   * @param {number} now
   * @returns {Command[]}
   */
  grant(robot, now) {
    if (robot !== this._lease?.robot) return [{ op: "grant", robot }];
    this.doubt(now);
    return [this._drive(NEUTRAL, now), { op: "grant", robot }];
  }

  /**
   * Give a lease back, neutral first.
   *
   * @param {string} robot
   * @param {number} now
   * @returns {Command[]}
   */
  release(robot, now) {
    if (robot === this._lease?.robot || robot === this._asked?.robot) {
      return this.letGo(now);
    }
    const epoch = this.epoch(robot);
    this._parked.delete(robot);
    if (epoch === null) return [];
    this._given.set(robot, epoch);
    return [{ op: "release", robot }];
  }

  /**
   * Let go of the robot that is driven or about to be, neutral first.
   *
   * @param {number} now
   * @returns {Command[]}
   */
  letGo(now) {
    const robot = this._lease?.robot ?? this._asked?.robot;
    if (robot === undefined) return [];
    /** @type {Command[]} */
    const messages = this._lease ? [this._drive(NEUTRAL, now)] : [];
    if (this._lease) this._given.set(robot, this._lease.epoch);
    if (this.hands.pressed) this.hands.kill(now);
    this._asked = null;
    this._drop();
    return [...messages, { op: "release", robot }];
  }

  /**
   * Say where a robot should go, or where it is. Its lease is kept, and given back when
   * it is not used.
   *
   * @param {'goal' | 'locate'} op
   * @param {string} robot
   * @param {{x: number, y: number, yaw: number}} pose Metres and radians.
   * @param {number} now
   */
  place(op, robot, pose, now) {
    if (robot !== this.driven) this._parked.set(robot, now);
    const { seq, tick } = this._stamp();
    return { op, robot, epoch: this.epoch(robot), seq, tick, ...pose };
  }

  /**
   * Note that the lease of a robot that goes somewhere is used still.
   *
   * @param {string} robot
   * @param {number} now
   */
  keep(robot, now) {
    if (this._parked.has(robot)) this._parked.set(robot, now);
    if (this._lease?.robot === robot) this._lease.movedAt = now;
  }

  /**
   * Doubt: neutral now, and nothing until the inputs were let go of and pressed anew.
   *
   * @param {number} now
   * @param {{drop?: boolean}} [how] `drop`: also forget what is held, as its release
   *     may never be heard of here.
   */
  doubt(now, { drop = false } = {}) {
    if (drop) this.hands.drop(now);
    else this.hands.kill(now);
    this._unsettle();
  }

  /**
   * STOP was said: the leases of that robot, or of all, are over by that.
   *
   * @param {string} robot Or "*".
   * @param {number} now
   */
  stopped(robot, now) {
    this.hands.kill(now);
    this._unsettle();
    if (robot === "*") this._parked.clear();
    this._parked.delete(robot);
    if (robot !== "*" && robot !== this._lease?.robot && robot !== this._asked?.robot) {
      return;
    }
    if (this._lease) this._given.set(this._lease.robot, this._lease.epoch);
    this._asked = null;
    this._drop();
  }

  /**
   * A STOP is being ended by hand: what is held at this moment means nothing.
   *
   * @param {string} robot Or "*".
   * @param {number} now
   */
  reset(robot, now) {
    if (robot === "*" || robot === this.choice) this.refusal = null;
    this.hands.kill(now);
  }

  /** Forget all leases: they ended with the connection. */
  disconnect() {
    this._asked = null;
    this._drop();
    this._parked.clear();
    this._given.clear();
    this._begged.clear();
    this._seq = 0;
    for (const [id, report] of this.robots) {
      this.robots.set(id, { ...report, mine: false });
    }
  }

  /**
   * Take what the gate says of a robot.
   *
   * @param {RobotReport} report
   * @param {number} now
   */
  report(report, now) {
    const before = this.robots.get(report.robot);
    this.robots.set(report.robot, report);
    if (!report.mine) {
      this._parked.delete(report.robot);
      this._given.delete(report.robot);
    }
    const epoch = this.epoch(report.robot);
    if (this._lease?.robot === report.robot && this._lease.epoch !== epoch) {
      this._drop();
      this.doubt(now);
    } else if (this._lease?.robot === report.robot && before?.armed && !report.armed) {
      // The gate saw a reason to stop that we did not.
      this.doubt(now);
    }
    if (epoch !== null && this._begged.delete(report.robot)) this._handed(report, now);
    if (this._asked?.robot !== report.robot) return;
    if (epoch !== null) this._granted(epoch, before, now);
    else if (heldByAnother(report) && this._asked.alive) this._giveUp(now);
  }

  /**
   * Forget a robot that the gate does not know any more.
   *
   * @param {string} robot
   * @param {number} now
   */
  gone(robot, now) {
    this.robots.delete(robot);
    this._begged.delete(robot);
    this._parked.delete(robot);
    if (robot !== this._lease?.robot && robot !== this._asked?.robot) return;
    this._asked = null;
    this._drop();
    this.doubt(now);
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
    if (what === "ask" && robot !== null) this._begged.delete(robot);
    if (robot !== this.choice) return;
    // A command that met the end of its lease on the way is no news.
    if (what === "drive" && !this._lease) return;
    this.refusal = why;
    this.refused = what;
    if (what === "take" && this._asked?.robot === robot) this._giveUp(now);
    if (what === "drive") this.doubt(now);
  }

  /**
   * Decide what to send now.
   *
   * @param {number} now
   * @param {boolean} attentive Whether the page is visible, has the focus, and
   *     nobody types in it.
   * @returns {Command[]}
   */
  step(now, attentive) {
    const gap = now - this._steppedAt;
    this._steppedAt = now;
    if (!attentive || gap < 0 || gap > ASLEEP) this.doubt(now, { drop: true });
    if (this.loop.tick === null || this.loop.state(now) !== "open") this.doubt(now);
    if (this.blind) this.doubt(now);
    return [...this._reach(now), ...this._stream(now), ...this._tidy(now)];
  }

  /**
   * A press reaches for a lease where there is none.
   *
   * @param {number} now
   * @returns {Command[]}
   */
  _reach(now) {
    if (this._asked) {
      if (now - this._asked.since > TAKE_PATIENCE) {
        this.refusal = "no answer";
        this._giveUp(now);
      }
      return [];
    }
    if (this._lease || !this.choice || isNeutral(this.hands.axes)) return [];
    const report = this.robots.get(this.choice);
    const epoch = this.epoch(this.choice);
    if (epoch !== null) {
      this._open(this.choice, epoch, now);
      return [];
    }
    if (!report || !mayReach(report)) {
      this.hands.kill(now);
      return [];
    }
    this.refusal = null;
    this._asked = { robot: this.choice, since: now, alive: !heldByAnother(report) };
    return [{ op: "take", robot: this.choice }];
  }

  /**
   * @param {number} now
   * @returns {Command[]}
   */
  _stream(now) {
    const lease = this._lease;
    if (!lease) return [];
    if (lease.firstNeutral !== null && this.loop.acknowledged(lease.firstNeutral)) {
      lease.seenSince ??= now;
    }
    const axes = this.settled ? this.hands.axes : NEUTRAL;
    if (!isNeutral(this.hands.axes)) lease.movedAt = now;
    return [this._drive(axes, now)];
  }

  /**
   * Give back what has not been used for a while.
   *
   * @param {number} now
   * @returns {Command[]}
   */
  _tidy(now) {
    /** @type {Command[]} */
    const messages = [];
    const unused = this._lease ? now - this._lease.movedAt : 0;
    if (unused >= this.releaseAfter) messages.push(...this.letGo(now));
    for (const [robot, since] of this._parked) {
      if (now - since >= this.releaseAfter) messages.push(...this.release(robot, now));
    }
    return messages;
  }

  /**
   * @param {Readonly<Axes>} axes
   * @param {number} now
   * @returns {Command}
   */
  _drive(axes, now) {
    const lease = /** @type {NonNullable<typeof this._lease>} */ (this._lease);
    const stamp = this._stamp();
    this.loop.sent(stamp.seq, now);
    lease.firstNeutral ??= stamp.seq;
    const { x, y, turn } = axes;
    const video = this._pictureAge(lease.robot);
    return {
      op: "drive",
      robot: lease.robot,
      epoch: lease.epoch,
      ...stamp,
      x,
      y,
      turn,
      ...(video === undefined ? {} : { video }),
    };
  }

  /**
   * A robot came that was asked for some time ago: what is held now was not meant for it.
   *
   * @param {RobotReport} report
   * @param {number} now
   */
  _handed({ robot, epoch }, now) {
    if (this._asked?.robot === robot) return;
    if (this.hands.pressed) this.hands.kill(now);
    if (robot === this.choice && epoch !== null) this._open(robot, epoch, now);
    // The operator has turned to another one; it is given back unless they return.
    else this._parked.set(robot, now);
  }

  /**
   * @param {number} epoch
   * @param {RobotReport | undefined} before
   * @param {number} now
   */
  _granted(epoch, before, now) {
    const asked = /** @type {NonNullable<typeof this._asked>} */ (this._asked);
    this._asked = null;
    // Taken over, or not taken by a press: what is held now was meant for nothing.
    if (!asked.alive || (before && heldByAnother(before))) this.hands.kill(now);
    this._open(asked.robot, epoch, now);
  }

  /**
   * @param {string} robot
   * @param {number} epoch
   * @param {number} now
   */
  _open(robot, epoch, now) {
    this.loop.rest();
    this._parked.delete(robot);
    this._lease = { robot, epoch, firstNeutral: null, seenSince: null, movedAt: now };
  }

  /** Number a message, so that the gate knows the newest. */
  _stamp() {
    return { seq: this._seq++, tick: this.loop.tick ?? 0 };
  }

  _drop() {
    this._lease = null;
    this.loop.rest();
  }

  _unsettle() {
    if (!this._lease) return;
    this._lease.firstNeutral = null;
    this._lease.seenSince = null;
  }

  /** @param {number} now */
  _giveUp(now) {
    this._asked = null;
    this.hands.kill(now);
  }
}
