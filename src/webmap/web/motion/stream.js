import { NEUTRAL, isNeutral } from "./axes.js";
import { Pictures } from "./pictures.js";

/** @typedef {import('./axes.js').Axes} Axes */
/** @typedef {import('./inputs.js').Inputs} Inputs */
/** @typedef {import('./loop.js').Loop} Loop */

/** @typedef {{op: string, robot: string, [field: string]: unknown}} Command */

/**
 * The lease that drives.
 *
 * @typedef {object} Lease
 * @property {string} robot
 * @property {number} epoch
 * @property {number | null} firstNeutral The first command since the last doubt.
 * @property {number | null} seenSince Since when the gate is known to see neutral.
 * @property {number} usedAt When it moved the robot last, or was needed otherwise.
 */

/**
 * For how long neutral is streamed, counted from the gate's first acknowledgement of
 * it, before a new lease moves anything; ms. The gate asks for 200 ms of neutral as
 * it saw them; counting from the acknowledgement makes sure that it did, whatever
 * the delay on the way.
 */
export const SETTLE = 250;

/** Steps come every 50 ms; after a longer gap than this the page was not awake; ms. */
export const ASLEEP = 250;

/** A page that kept time for so long has loaded what made it late, most likely; ms. */
export const CALM = 500;

/**
 * The stream of commands under one lease: how the inputs are, or neutral.
 *
 * It is neutral until the gate has seen neutral for a stretch since the last doubt, and
 * whatever it notices itself of a page that is not attentive, a loop that is not open
 * and a picture that is too old is a doubt. Times are in milliseconds of one clock.
 */
export class Stream {
  /**
   * @param {Inputs} inputs
   * @param {Loop} loop
   * @param {number} now
   */
  constructor(inputs, loop, now) {
    this.inputs = inputs;
    this.loop = loop;
    this.pictures = new Pictures();
    /** @type {Lease | null} */
    this.lease = null;
    this._seq = 0;
    this._lookedAt = now;
    this._sleptAt = now;
    this._attentive = true;
  }

  /** Whether a press would come too early: the page gets ready for one by itself. */
  get early() {
    if (!this._attentive || this.inputs.pressed) return false;
    const now = this._lookedAt;
    const calm = now - this._sleptAt >= CALM;
    return this.loop.tick === null || !calm || !this.inputs.ready(now);
  }

  /** Whether the gate has seen enough neutral, as far as can be known here. */
  get settled() {
    const since = this.lease?.seenSince ?? null;
    return since !== null && this._lookedAt - since >= SETTLE;
  }

  /** How long a command takes to be acknowledged, in ms; null before any was. */
  get delay() {
    const { delay } = this.loop;
    return delay === null ? null : Math.max(delay, this.loop.age(this._lookedAt));
  }

  /**
   * Go out under this lease from now on.
   *
   * @param {string} robot
   * @param {number} epoch
   * @param {number} now
   */
  open(robot, epoch, now) {
    this.loop.rest();
    this.lease = { robot, epoch, firstNeutral: null, seenSince: null, usedAt: now };
  }

  /** There is no lease to go out under. */
  close() {
    this.lease = null;
    this.loop.rest();
  }

  /** Number from the start: this is another connection. */
  restart() {
    this.close();
    this._seq = 0;
  }

  /**
   * Doubt: neutral now, and nothing until the inputs were let go of and pressed anew.
   *
   * @param {number} now
   * @param {{drop?: boolean}} [how] `drop`: also forget what is held, as its release
   *     may never be heard of here.
   */
  goNeutral(now, { drop = false } = {}) {
    if (drop) this.inputs.drop(now);
    else this.inputs.block(now);
    if (!this.lease) return;
    this.lease.firstNeutral = null;
    this.lease.seenSince = null;
  }

  /**
   * Look whether the operator can be driving at all.
   *
   * @param {number} now
   * @param {boolean} attentive Whether the page is visible, has the focus, and
   *     nobody types in it.
   */
  look(now, attentive) {
    const gap = now - this._lookedAt;
    this._lookedAt = now;
    this._attentive = attentive;
    const slept = gap < 0 || gap > ASLEEP;
    if (slept) this._sleptAt = now;
    if (!attentive || slept) this.goNeutral(now, { drop: true });
    if (this.loop.tick === null || this.loop.state(now) !== "open") this.goNeutral(now);
    if (this.lease && this.pictures.blind(this.lease.robot)) this.goNeutral(now);
  }

  /**
   * @param {boolean} armed Whether the gate would take a command to move.
   * @param {number} now
   * @returns {Command[]} What goes out at this step.
   */
  step(armed, now) {
    const { lease } = this;
    if (!lease) return [];
    if (lease.firstNeutral !== null && this.loop.acknowledged(lease.firstNeutral)) {
      lease.seenSince ??= now;
    }
    const { axes } = this.inputs;
    if (!isNeutral(axes)) lease.usedAt = now;
    return [this._command(lease, armed && this.settled ? axes : NEUTRAL, now)];
  }

  /**
   * @param {number} now
   * @returns {Command[]} A last word under this lease, if there is one.
   */
  neutral(now) {
    return this.lease ? [this._command(this.lease, NEUTRAL, now)] : [];
  }

  /** Number a message, so that the gate knows the newest. */
  stamp() {
    return { seq: this._seq++, tick: this.loop.tick ?? 0 };
  }

  /**
   * @param {Lease} lease
   * @param {Readonly<Axes>} axes
   * @param {number} now
   * @returns {Command}
   */
  _command(lease, { x, y, turn }, now) {
    const { robot, epoch } = lease;
    const stamp = this.stamp();
    this.loop.sent(stamp.seq, now);
    lease.firstNeutral ??= stamp.seq;
    const video = this.pictures.age(robot);
    const picture = video === undefined ? {} : { video };
    return { op: "drive", robot, epoch, ...stamp, x, y, turn, ...picture };
  }
}
