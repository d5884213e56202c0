/**
 * The page's decisions about motion, without sockets and timers: from inputs and messages
 * to commands and events.
 *
 * This folder decides what the page sends to the gate. Open this file first, then
 * `pilot.js` and `stream.js`. The devices are read in `../inputs`.
 */

import { Requests } from "./requests.js";
import { Inputs } from "./inputs.js";
import { Loops } from "./loops.js";
import { Onset } from "./onset.js";
import { Pilot } from "./pilot.js";
import { isOver } from "./report.js";
import { Stopping } from "./stopping.js";
import { Unanswered } from "./unanswered.js";

/** @typedef {import('./drive_events.js').DriveEvent} DriveEvent */
/** @typedef {import('./drive_events.js').LinkState} LinkState */
/** @typedef {import('./stream.js').Command} Command */

/**
 * The state that this page shares with the gates, across all its connections.
 *
 * Leases, numbers and ticks belong to one connection. The inputs, and a STOP that was not
 * sent, do not. A session processes the gates' messages and returns what to send and which
 * events to emit. Times are in milliseconds of one clock.
 */
export class Session {
  /**
   * @param {number} now
   * @param {{releaseAfter?: number}} options See {@link Pilot}.
   */
  constructor(now, options) {
    this.inputs = new Inputs(now);
    this.loops = new Loops();
    this.pilot = new Pilot(this.inputs, this.loops, now, options);
    this.stopping = new Stopping();
    this.requests = new Requests();
    this.onset = new Onset();
    /**
     * This connection's name at the gate; null while there is none.
     * @type {string | null}
     */
    this.connection = null;
    /** @type {LinkState} */
    this.state = "connecting";
    this._unanswered = new Unanswered();
    /**
     * STOPs to send first on the next connection.
     * @type {Set<string>}
     */
    this._unsent = new Set();
    /**
     * Robots that this page sent goals to, each with the goal that was reported before.
     * @type {Map<string, string | undefined>}
     */
    this._sentTo = new Map();
  }

  /** Whether this page has control of any robot, or a goal moves one that it sent a goal to. */
  get drives() {
    return this.pilot.status.taking || [...this.pilot.robots.keys()].some((id) => this.moves(id));
  }

  /**
   * @param {string} robot
   * @returns {boolean} Whether this page has control of the robot, or sent a goal to it that is
   *     not over, also before the gate reports the goal.
   */
  moves(robot) {
    const { mine = false, goal = null } = this.pilot.robots.get(robot) ?? {};
    if (mine || !this._sentTo.has(robot)) return mine;
    return !goal || !isOver(goal) || goal.id === this._sentTo.get(robot);
  }

  /**
   * Return the results of this page's STOPs.
   *
   * @param {number} now
   */
  verdicts(now) {
    const connected = this.state === "open" || this.state === "late";
    return this.stopping.verdicts(this.pilot.robots, connected, now);
  }

  /**
   * Note that STOP was pressed.
   *
   * @param {string} robot Or "*".
   * @param {boolean} left Whether it was sent. If not, or if the gate has not answered when
   *     the connection is lost, it is the first message on the next connection: a late stop
   *     is still a stop.
   * @param {number} now
   */
  stopped(robot, left, now) {
    if (left) this._unanswered.sent(robot, this.pilot.robots);
    else this._unsent.add(robot);
    this.pilot.stopped(robot, now);
    this.stopping.start(robot, this.pilot.robots, now);
  }

  /**
   * Note that a command was sent.
   *
   * @param {Command} command
   * @param {number} now
   */
  sent(command, now) {
    const { robot } = command;
    if (command.op === "goal") this._sentTo.set(robot, this.pilot.robots.get(robot)?.goal?.id);
    if (command.op !== "drive") return;
    const moving = ["x", "y", "turn"].some((axis) => command[axis] !== 0);
    this.onset.sent(command.robot, moving, now);
  }

  /**
   * Process a message of the gate.
   *
   * @param {any} message
   * @param {number} now
   * @returns {{send: Command[], events: DriveEvent[]}} What to send, then the events to emit.
   */
  receive(message, now) {
    if (message.op === "hello") return this._greeted(message, now);
    return { send: [], events: this._received(message, now) };
  }

  /**
   * Update the state of the link from the loop to the display's own gate.
   *
   * @param {number} now
   * @returns {DriveEvent[] | null} The events to emit; null if the connection must be
   *     closed.
   */
  judge(now) {
    const state = this.loops.own.state(now);
    if (state === "lost") return null;
    // Before its first message the other side may not be a gate.
    return this.connection === null ? [] : this._change(state);
  }

  /**
   * @param {string | null} robot The robot that the operator has chosen.
   * @param {number} now
   * @returns {LinkState} The state of the link to that robot's gate: late also while that
   *     gate does not answer.
   */
  linkTo(robot, now) {
    const late = this.state === "open" && this.loops.of(robot).state(now) !== "open";
    return late ? "late" : this.state;
  }

  /**
   * Note that the connection is lost.
   *
   * @param {number} now
   * @returns {DriveEvent[]} The events to emit.
   */
  lost(now) {
    this.connection = null;
    this._forget(now);
    const events = this._change("lost");
    for (const report of this.pilot.robots.values()) events.push(["robot", report]);
    return events;
  }

  /**
   * @param {{connection: string, ticks?: number}} hello
   * @param {number} now
   * @returns {{send: Command[], events: DriveEvent[]}}
   */
  _greeted({ connection, ticks = 20 }, now) {
    // A second greeting on one connection: the gate was restarted.
    if (this.connection !== null) this._forget(now);
    this.connection = connection;
    this.loops.greeted(ticks);
    const send = [...this._unsent].map((robot) => ({ op: "stop", robot }));
    for (const robot of this._unsent) this._unanswered.sent(robot, this.pilot.robots);
    this._unsent.clear();
    return { send, events: this._change("open") };
  }

  /**
   * @param {any} message
   * @param {number} now
   * @returns {DriveEvent[]}
   */
  _received(message, now) {
    switch (message.op) {
      case "tick":
        this.loops.receive(message, now);
        return [];
      case "robot":
        for (const one of this._watching) one.report(message, now);
        return [["robot", message]];
      case "gone":
        for (const one of this._watching) one.gone(message.robot, now);
        return [["gone", message.robot]];
      case "refused":
        if (message.what === "goal") this._sentTo.delete(message.robot);
        this.pilot.refuse(message.robot, message.what, message.why, now);
        return [["refused", message]];
      default:
        return [];
    }
  }

  /** The objects that process each report of a gate. The pilot needs the loops first. */
  get _watching() {
    const { loops, pilot, stopping, requests, onset } = this;
    return [loops, pilot, stopping, requests, onset, this._unanswered];
  }

  /**
   * Forget leases, numbers and ticks: they belong to one connection. A STOP without an
   * answer does not, and is kept.
   *
   * @param {number} now
   */
  _forget(now) {
    for (const robot of this._unanswered.take()) this._unsent.add(robot);
    this.pilot.goNeutral(now);
    this.pilot.disconnect();
    this.requests.forget();
    this.loops.open(now);
  }

  /**
   * @param {LinkState} state
   * @returns {DriveEvent[]}
   */
  _change(state) {
    if (state === this.state) return [];
    this.state = state;
    return [["state", state]];
  }
}
