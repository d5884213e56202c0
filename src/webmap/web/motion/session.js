/**
 * The page's decisions about motion, without sockets and timers: from inputs and messages
 * to commands and events.
 *
 * This folder decides what the page sends to the gate. Open this file first, then
 * `pilot.js` and `commands.js`. The devices are read in `../inputs`.
 */

import { Inputs } from "./inputs.js";
import { MotionDelay } from "./measurements.js";
import { Pilot } from "./pilot.js";
import { isOver, nameYou, textForYou } from "./report.js";
import { RoundTrips } from "./round_trips.js";
import { StopResults, UnansweredStops } from "./stops.js";

/** @typedef {import('./commands.js').Command} Command */
/** @typedef {import('./report.js').RobotReport} RobotReport */

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
    this.loops = new RoundTrips();
    this.pilot = new Pilot(this.inputs, this.loops, now, options);
    this.stopping = new StopResults();
    this.requests = new ControlRequests();
    this.motionDelay = new MotionDelay();
    /**
     * This connection's name at the gate; null while there is none.
     * @type {string | null}
     */
    this.connection = null;
    /** @type {import('./report.js').You} */
    this.you = { name: "", person: "" };
    /** @type {LinkState} */
    this.state = "connecting";
    this._unanswered = new UnansweredStops();
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
    this.motionDelay.sent(command.robot, moving, now);
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
   * @returns {LinkState | 'silent'} The state of the link to that robot's gate; silent if
   *     the display answers, but not the gate of the robot's agent.
   */
  linkTo(robot, now) {
    const { own } = this.loops;
    const loop = this.loops.of(robot);
    if (this.state !== "open" || loop.state(now) === "open") return this.state;
    return loop === own ? "late" : "silent";
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
      case "you":
        this.you = message;
        return [];
      case "robot":
        nameYou(message, this.you);
        for (const one of this._watching) one.report(message, now);
        return [["robot", message]];
      case "gone":
        for (const one of this._watching) one.gone(message.robot, now);
        return [["gone", message.robot]];
      case "refused":
        if (message.what === "goal") this._sentTo.delete(message.robot);
        message.why = textForYou(message.why, this.you);
        this.pilot.refuse(message.robot, message.what, message.why, now);
        return [["refused", message]];
      default:
        return [];
    }
  }

  /** The objects that process each report of a gate. The pilot needs the loops first. */
  get _watching() {
    const { loops, pilot, stopping, requests, motionDelay } = this;
    return [loops, pilot, stopping, requests, motionDelay, this._unanswered];
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

/**
 * A request for control of a robot.
 *
 * @typedef {object} Request
 * @property {string} robot
 * @property {string} name The robot's.
 * @property {string} by The connection of the requester.
 * @property {string} who The name of the requester.
 * @property {boolean} mine Whether this page's connection has control.
 * @property {number} left Whole seconds until control is handed over automatically.
 */

/**
 * Counts down the time that holders have to answer, from the gate's last report.
 *
 * Times are in milliseconds of one clock.
 */
export class ControlRequests {
  constructor() {
    /** @type {Map<string, {report: RobotReport, ends: number}>} */
    this._requests = new Map();
  }

  /**
   * @param {RobotReport} report
   * @param {number} now
   */
  report(report, now) {
    if (!report.asker) this._requests.delete(report.robot);
    else {
      const ends = now + 1000 * report.asker.left;
      this._requests.set(report.robot, { report, ends });
    }
  }

  /** @param {string} robot */
  gone(robot) {
    this._requests.delete(robot);
  }

  /** Forget all: the gate will report the requests again. */
  forget() {
    this._requests.clear();
  }

  /**
   * @param {number} now
   * @returns {Request[]}
   */
  requests(now) {
    return [...this._requests.values()].map(({ report, ends }) => {
      const asker = /** @type {import('./report.js').Asker} */ (report.asker);
      return {
        robot: report.robot,
        name: report.name,
        by: asker.connection,
        who: asker.name || asker.connection,
        mine: report.mine,
        left: Math.max(0, Math.ceil((ends - now) / 1000)),
      };
    });
  }
}

/** @typedef {'connecting' | 'open' | 'late' | 'lost'} LinkState */

/**
 * The kinds of events, and the value of each.
 *
 * `robot`: the gate's newest report on a robot. `gone`: the gate does not know a robot any
 * more. `state`: the link's state changed. `refused`: the gate refused an operation.
 * `stop`: STOP was sent for a robot or "*". `goal`: a goal was sent for a robot.
 * `gamepad`: why a gamepad cannot drive, or how one drives, in sentences; empty when that
 * is over. `read`: inputs without events of their own (gamepads) must be read now. `drop`: inputs must
 * forget what is pressed. `step`: a 20 Hz step has ended.
 *
 * @typedef {object} DriveEvents
 * @property {RobotReport} robot
 * @property {string} gone
 * @property {LinkState} state
 * @property {{robot: string | null, what: string, why: string}} refused
 * @property {string} stop
 * @property {string} goal
 * @property {GamepadNotice} gamepad
 * @property {null} read
 * @property {null} drop
 * @property {null} step
 */

/**
 * @typedef {object} GamepadNotice
 * @property {"refused" | "hint"} kind
 * @property {string} text
 * @property {(() => void) | null} settings Opens the settings of gamepads.
 */

/** @typedef {{[K in keyof DriveEvents]: [kind: K, event: DriveEvents[K]]}[keyof DriveEvents]} DriveEvent */

/** The listeners of each kind of event. */
export class DriveListeners {
  constructor() {
    /** @type {Map<keyof DriveEvents, Set<Function>>} */
    this._listeners = new Map();
  }

  /**
   * @template {keyof DriveEvents} K
   * @param {K} kind
   * @param {(event: DriveEvents[K]) => void} fn
   * @returns {() => void} Stops listening.
   */
  on(kind, fn) {
    const listeners = this._listeners.get(kind) ?? new Set();
    this._listeners.set(kind, listeners.add(fn));
    return () => {
      listeners.delete(fn);
    };
  }

  /**
   * @template {keyof DriveEvents} K
   * @param {K} kind
   * @param {DriveEvents[K]} event
   */
  emit(kind, event) {
    for (const fn of this._listeners.get(kind) ?? []) {
      try {
        fn(event);
      } catch (error) {
        // An error of a listener must never prevent the sending of neutral or of STOP.
        reportError(error);
      }
    }
  }
}
