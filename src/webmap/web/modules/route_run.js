import { look } from "./goal_words.js";

/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('../motion/report.js').RobotReport} RobotReport */
/** @typedef {'going' | 'paused' | 'halted' | 'ended'} RunState */
/** @typedef {{send: Pose} | {cancel: true} | null} Action What is to be done now. */

/** A robot that does not say that it is there is, when it is as near as this; metres. */
export const THERE = 0.3;

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
    if (!mine) return this._halted("this page does not have the robot any more");
    if (!goal || goal.id === this._before) {
      const late = now - this._acceptedAt > PATIENCE;
      return late ? this._halted("the goal did not leave") : null;
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
