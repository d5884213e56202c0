/** The commands of this page: the stream of the inputs, and single goals and poses. */

import { NEUTRAL, isNeutral } from "./inputs.js";
import { TAKE_PATIENCE } from "./leases.js";

/** @typedef {import('./inputs.js').Axes} Axes */
/** @typedef {import('./inputs.js').Inputs} Inputs */
/** @typedef {import('./round_trips.js').RoundTrip} RoundTrip */
/** @typedef {import('./round_trips.js').RoundTrips} RoundTrips */
/** @typedef {import('./pilot.js').Pilot} Pilot */

/** @typedef {{op: string, robot: string, [field: string]: unknown}} Command */

/**
 * The lease that drives.
 *
 * @typedef {object} Lease
 * @property {string} robot
 * @property {number} epoch
 * @property {RoundTrip} loop The loop to the gate of the robot.
 * @property {number | null} firstNeutral The first command since `goNeutral`.
 * @property {number | null} seenSince Since when the gate acknowledges neutral commands.
 * @property {number} usedAt When it was last used, for motion or otherwise.
 */

/**
 * How long a new lease sends neutral before it may move a robot, from the gate's first
 * acknowledgement; ms. The gate requires 200 ms of neutral commands. Because the time
 * begins with the acknowledgement, the delay of the connection does not shorten it.
 */
export const SETTLE = 250;

/** Steps come every 50 ms; after a longer gap the page was frozen or too busy; ms. */
export const ASLEEP = 250;

/** After this time without such a gap the page has probably finished loading; ms. */
export const CALM = 500;

/**
 * The stream of commands under one lease: the state of the inputs, or neutral.
 *
 * It is neutral until the gate has received neutral for {@link SETTLE} ms. It becomes
 * neutral again when the page is not attentive, the loop to the robot's gate is not open,
 * or the camera picture is too old. Times are in milliseconds of one clock.
 */
export class Stream {
  /**
   * @param {Inputs} inputs
   * @param {RoundTrips} loops
   * @param {number} now
   */
  constructor(inputs, loops, now) {
    this.inputs = inputs;
    this.loops = loops;
    this.pictures = new PictureAges();
    /** @type {Lease | null} */
    this.lease = null;
    this._seq = 0;
    this._lookedAt = now;
    this._sleptAt = now;
    this._attentive = true;
  }

  /**
   * @param {string | null} robot The robot that a press drives.
   * @returns {boolean} Whether a press would be too early. The page becomes ready without
   *     any input.
   */
  early(robot) {
    if (!this._attentive || this.inputs.pressed) return false;
    const now = this._lookedAt;
    const calm = now - this._sleptAt >= CALM;
    return this._loop(robot).tick === null || !calm || !this.inputs.ready(now);
  }

  /** Whether the gate has received enough neutral, by its acknowledgements. */
  get settled() {
    const since = this.lease?.seenSince ?? null;
    return since !== null && this._lookedAt - since >= SETTLE;
  }

  /** How long an acknowledgement takes, in ms; null before the first. */
  get delay() {
    const loop = this.lease?.loop;
    if (!loop || loop.delay === null) return null;
    return Math.max(loop.delay, loop.age(this._lookedAt));
  }

  /**
   * Send commands under this lease.
   *
   * @param {string} robot
   * @param {number} epoch
   * @param {number} now
   */
  open(robot, epoch, now) {
    this.close();
    const loop = this.loops.of(robot);
    this.lease = { robot, epoch, loop, firstNeutral: null, seenSince: null, usedAt: now };
  }

  /** Stop sending: there is no lease. */
  close() {
    this.lease?.loop.rest();
    this.lease = null;
  }

  /** Start the numbers again, for another connection. */
  restart() {
    this.close();
    this._seq = 0;
  }

  /**
   * Go neutral now; inputs have no effect until they are released and pressed again.
   *
   * @param {number} now
   * @param {{drop?: boolean, frozen?: boolean}} [how] `drop`: also forget the pressed
   *     inputs, because this page may not receive their release. `frozen`: because the
   *     page was frozen.
   */
  goNeutral(now, { drop = false, frozen = false } = {}) {
    if (drop) this.inputs.drop(now, { frozen });
    else this.inputs.block(now);
    if (!this.lease) return;
    this.lease.firstNeutral = null;
    this.lease.seenSince = null;
  }

  /**
   * Go neutral if the operator cannot be driving.
   *
   * @param {number} now
   * @param {boolean} attentive Whether the page is visible, has the focus, and no
   *     text field has it.
   * @param {string | null} robot The robot that a press drives.
   */
  look(now, attentive, robot) {
    const gap = now - this._lookedAt;
    this._lookedAt = now;
    this._attentive = attentive;
    const slept = gap < 0 || gap > ASLEEP;
    if (slept) this._sleptAt = now;
    if (!attentive || slept) this.goNeutral(now, { drop: true, frozen: slept });
    const loop = this._loop(robot);
    if (loop.tick === null || loop.state(now) !== "open") this.goNeutral(now);
    if (this.lease && this.pictures.blind(this.lease.robot)) this.goNeutral(now);
  }

  /**
   * @param {boolean} armed Whether the gate accepts a command to move.
   * @param {number} now
   * @returns {Command[]} The commands to send at this step.
   */
  step(armed, now) {
    const { lease } = this;
    if (!lease) return [];
    if (lease.firstNeutral !== null && lease.loop.acknowledged(lease.firstNeutral)) {
      lease.seenSince ??= now;
    }
    const { axes } = this.inputs;
    if (!isNeutral(axes)) lease.usedAt = now;
    return [this._command(lease, armed && this.settled ? axes : NEUTRAL, now)];
  }

  /**
   * @param {number} now
   * @returns {Command[]} A neutral command under this lease, if there is one.
   */
  neutral(now) {
    return this.lease ? [this._command(this.lease, NEUTRAL, now)] : [];
  }

  /**
   * Number a message, so that the robot's gate knows the newest.
   *
   * @param {string} robot
   */
  stamp(robot) {
    return { seq: this._seq++, tick: this.loops.of(robot).tick ?? 0 };
  }

  /**
   * @param {string | null} robot
   * @returns {RoundTrip} The loop to the gate of the driven robot; without a lease, to that of
   *     this robot.
   */
  _loop(robot) {
    return this.lease?.loop ?? this.loops.of(robot);
  }

  /**
   * @param {Lease} lease
   * @param {Readonly<Axes>} axes
   * @param {number} now
   * @returns {Command}
   */
  _command(lease, { x, y, turn }, now) {
    const { robot, epoch } = lease;
    const stamp = this.stamp(robot);
    lease.loop.sent(stamp.seq, now);
    lease.firstNeutral ??= stamp.seq;
    const video = this.pictures.age(robot);
    const picture = video === undefined ? {} : { video };
    return { op: "drive", robot, epoch, ...stamp, x, y, turn, ...picture };
  }
}

/** The oldest camera picture that an operator may drive by; ms. */
export const BLIND = 1000;

/**
 * The ages of the camera pictures that the operator drives by, for each robot.
 */
export class PictureAges {
  constructor() {
    /** @type {Map<string, () => number>} */
    this._ages = new Map();
  }

  /**
   * @param {string} robot
   * @param {() => number} age Age of the picture that is shown now, in ms.
   * @returns {() => void} Ends this.
   */
  goBy(robot, age) {
    this._ages.set(robot, age);
    return () => {
      if (this._ages.get(robot) === age) this._ages.delete(robot);
    };
  }

  /**
   * @param {string} robot
   * @returns {number | undefined} In whole ms; undefined if no camera was chosen.
   */
  age(robot) {
    const age = this._ages.get(robot)?.();
    return age === undefined ? undefined : Math.round(Math.min(Math.max(age, 0), 1e9));
  }

  /**
   * @param {string} robot
   * @returns {boolean} Whether the picture is too old to drive by (S16).
   */
  blind(robot) {
    return (this.age(robot) ?? 0) > BLIND;
  }
}

/**
 * An operation that the gate has not answered yet.
 *
 * @typedef {object} PendingOperation
 * @property {string} robot
 * @property {string} what
 * @property {number} since
 * @property {() => boolean} reached Whether the gate has accepted it.
 * @property {(problem: string | null) => void} end
 */

/**
 * Sends goals and sets poses: takes the lease of a free robot for that, and waits for the
 * gate's answer.
 *
 * Times are in milliseconds of one clock.
 */
export class PoseCommands {
  /**
   * @param {Pilot} pilot
   * @param {RoundTrips} loops
   * @param {(commands: Command[]) => void} send
   * @param {() => number} clock
   */
  constructor(pilot, loops, send, clock) {
    this._pilot = pilot;
    this._loops = loops;
    this._send = send;
    this._clock = clock;
    /** @type {Set<PendingOperation>} */
    this._pending = new Set();
  }

  /**
   * @param {'goal' | 'locate'} op
   * @param {string} robot
   * @param {{x: number, y: number, yaw: number}} pose Metres and radians.
   * @returns {Promise<boolean>} Whether the lease was taken for this.
   * @throws {Error} When the gate refuses it or does not answer.
   */
  async place(op, robot, { x, y, yaw }) {
    if (![x, y, yaw].every(Number.isFinite)) {
      throw new Error(`A ${op} needs finite numbers, got ${x}, ${y}, ${yaw}.`);
    }
    const taken = this._pilot.epoch(robot) === null;
    if (taken) {
      this._send([{ op: "take", robot }]);
      await this._until(robot, "take", () => this._pilot.epoch(robot) !== null);
    }
    const command = this._pilot.place(op, robot, { x, y, yaw }, this._clock());
    const loop = this._loops.of(robot);
    this._send([command]);
    try {
      await this._until(robot, op, () => loop.acknowledged(command.seq));
    } catch (error) {
      if (taken) this._send(this._pilot.release(robot, this._clock()));
      throw error;
    }
    return taken;
  }

  /**
   * Process a refusal of the gate.
   *
   * @param {string | null} robot
   * @param {string} what
   * @param {string} why
   */
  refused(robot, what, why) {
    for (const operation of this._pending) {
      if (operation.robot === robot && operation.what === what) operation.end(why);
    }
  }

  /** @param {number} now */
  step(now) {
    for (const operation of this._pending) {
      if (operation.reached()) operation.end(null);
      else if (now - operation.since > TAKE_PATIENCE) operation.end("no answer from the gate");
    }
  }

  /**
   * @param {string} robot
   * @param {string} what
   * @param {() => boolean} reached
   * @returns {Promise<void>}
   */
  _until(robot, what, reached) {
    return new Promise((resolve, reject) => {
      /** @type {PendingOperation} */
      const operation = {
        robot,
        what,
        since: this._clock(),
        reached,
        end: (problem) => {
          this._pending.delete(operation);
          if (problem === null) resolve();
          else reject(new Error(problem));
        },
      };
      this._pending.add(operation);
    });
  }
}
