import { FRAMED } from "./access.js";
import { devicesOf } from "./inputs/devices.js";
import { attentive, watchAttention } from "./inputs/focus.js";
import { PoseCommands } from "./motion/commands.js";
import { GateLink } from "./link.js";
import { DriveListeners, Session } from "./motion/session.js";
import { standingStops } from "./motion/stops.js";
import { html, setText, stopButton } from "./tools/elements.js";
import { endOf } from "./tools/overlay.js";

/** @typedef {import('./motion/inputs.js').Axes} Axes */
/** @typedef {import('./motion/session.js').DriveEvent} DriveEvent */
/** @typedef {import('./motion/session.js').DriveEvents} DriveEvents */
/** @typedef {import('./motion/report.js').RobotReport} RobotReport */
/** @typedef {import('./motion/commands.js').Command} Command */
/** @typedef {{x: number, y: number, yaw: number}} Pose Metres and radians. */

/** Milliseconds between two answers with the state of the inputs. */
const PERIOD = 50;

/**
 * This page's connection to the gate: control, inputs, goals, STOP.
 *
 * One per page, however many maps it shows. It sends the *state* of the inputs at
 * 20 Hz while it has control, from a timer of the page itself: a worker's timer would
 * continue when the page is hidden or hangs. Only {@link Drive#goal} moves a robot
 * without inputs; see `motion/pilot.js` for when inputs move it.
 *
 * `motion/` makes all decisions; this file has the clock, the timer, the socket and the
 * page's events.
 */
export class Drive {
  /**
   * @param {string | URL} baseUrl The address under which the server has `drive`.
   * @param {{id?: string, releaseAfter?: number}} [options] `id`: the page's own id,
   *     by which the server matches its `scene` and `drive`. `releaseAfter`: unused
   *     control is released after this time, in ms.
   */
  constructor(baseUrl, options = {}) {
    const now = performance.now();
    this._session = new Session(now, options);
    this._pilot = this._session.pilot;
    this._listeners = new DriveListeners();
    this._poseCommands = new PoseCommands(
      this._pilot,
      this._session.loops,
      (commands) => this._send(commands),
      () => performance.now(),
    );
    this._link = new GateLink(socketUrl(baseUrl, options.id), {
      open: () => this._session.loops.open(performance.now()),
      receive: (message) => this._receive(message),
      lost: () => this._emitAll(this._session.lost(performance.now())),
    });
    this._unwatch = watchAttention(
      (left) => this._goNeutral(left),
      () => this._renew(),
    );
    this._timer = setInterval(() => this._tick(), PERIOD);
    this._link.mind(now);
  }

  /** The state of the connection: may commands arrive, and do they? */
  get state() {
    return this._session.state;
  }

  /** This connection's name at the gate; null while there is none. */
  get connection() {
    return this._session.connection;
  }

  /**
   * The newest report of the gate on each robot.
   * @returns {ReadonlyMap<string, RobotReport>}
   */
  get robots() {
    return this._pilot.robots;
  }

  /** The state of the chosen robot and of the inputs, for the operator. */
  get status() {
    const { status } = this._pilot;
    const link = this._session.linkTo(status.choice, performance.now());
    return { link, connection: this.connection, ...status };
  }

  /** Whether this page has control of any robot, or a goal moves one that it sent a goal to. */
  get drives() {
    return this._session.drives;
  }

  /**
   * @param {string} robot
   * @returns {boolean} Whether this page has control of the robot, or sent it to a goal.
   */
  moves(robot) {
    return this._session.moves(robot);
  }

  /** The requests for control. */
  get requests() {
    return this._session.requests.requests(performance.now());
  }

  /** The results of this page's STOPs. */
  get verdicts() {
    return this._session.verdicts(performance.now());
  }

  /** Stop showing the results of the STOPs until now. */
  dismissVerdicts() {
    this._session.stopping.dismiss();
  }

  /**
   * The last time from the first command to motion of a robot, in ms; null before the
   * first.
   *
   * @param {string} robot
   */
  motionDelay(robot) {
    return this._session.motionDelay.delay(robot);
  }

  /**
   * Add a listener.
   *
   * @template {keyof DriveEvents} K
   * @param {K} kind
   * @param {(event: DriveEvents[K]) => void} fn
   * @returns {() => void} Removes the listener.
   */
  on(kind, fn) {
    return this._listeners.on(kind, fn);
  }

  // Inputs ---------------------------------------------------------------------

  /** @param {DriveEvents["gamepad"]} notice What the page shows about a gamepad. */
  showGamepad(notice) {
    this._listeners.emit("gamepad", notice);
  }

  /**
   * Set the axes of an input. Only one input drives at a time.
   *
   * @param {string} source
   * @param {Partial<Axes> | null} axes null if the input is gone.
   * @param {{fresh?: boolean}} [how] See {@link Inputs#set}.
   */
  setInput(source, axes, how) {
    const { inputs } = this._session;
    const was = inputs.pressed;
    inputs.set(source, axes, performance.now(), how);
    // A release and a press are sent immediately.
    if (was !== inputs.pressed) this._step();
  }

  /**
   * Note that the operator drives by the picture of a robot's camera: while the picture
   * is older than a second, the robot does not move.
   *
   * @param {string} robot
   * @param {() => number} age Age of the picture that the page shows now, in ms.
   * @returns {() => void} Ends this.
   */
  goBy(robot, age) {
    return this._pilot.pictures.goBy(robot, age);
  }

  /** Discard all inputs and go neutral immediately: for inputs that may be wrong. */
  goNeutral() {
    this._goNeutral(false);
  }

  // Control --------------------------------------------------------------------

  /**
   * Choose the robot to drive. Control of the previous one is released.
   *
   * @param {string | null} robot
   */
  choose(robot) {
    this._send(this._pilot.choose(robot, performance.now()));
  }

  /** @param {string} robot Take control. Inputs that are active now do not move it. */
  take(robot) {
    this._send(this._pilot.take(robot, performance.now()));
  }

  /** @param {string} robot Release control, neutral first. */
  release(robot) {
    this._send(this._pilot.release(robot, performance.now()));
  }

  /**
   * Request control. Inputs that are active when it is granted do not move the robot.
   *
   * @param {string} robot
   */
  ask(robot) {
    this._send(this._pilot.ask(robot));
  }

  /** @param {string} robot Hand control over to the requester, neutral first. */
  grant(robot) {
    this._send(this._pilot.grant(robot, performance.now()));
  }

  /** @param {string} robot Keep control in spite of a request. */
  deny(robot) {
    this._send([{ op: "deny", robot }]);
  }

  /**
   * @param {string} robot
   * @returns {boolean} Whether this page has control.
   */
  holds(robot) {
    return this._pilot.epoch(robot) !== null;
  }

  /** @param {string} robot Keep control longer, if this page has it. */
  keep(robot) {
    this._send(this._pilot.keep(robot, performance.now()));
  }

  // Goals ----------------------------------------------------------------------

  /**
   * Send a robot to a goal; if control is free, take it for that.
   *
   * @param {string} robot
   * @param {Pose} pose In the robot's goal frame.
   * @returns {Promise<void>} Done when the gate has accepted the goal.
   * @throws {Error} When the gate refuses it or does not answer.
   */
  async goal(robot, pose) {
    await this._poseCommands.place("goal", robot, pose);
  }

  /**
   * Set a robot's pose; if control is free, take it for that moment.
   *
   * @param {string} robot
   * @param {Pose} pose In the robot's goal frame.
   * @returns {Promise<void>} Done when the gate has accepted it.
   * @throws {Error} When the gate refuses it or does not answer.
   */
  async locate(robot, pose) {
    const taken = await this._poseCommands.place("locate", robot, pose);
    if (taken) this.release(robot);
  }

  /** @param {string} robot Cancel its goal. */
  cancel(robot) {
    this._send([{ op: "cancel", robot }]);
  }

  // STOP -----------------------------------------------------------------------

  /**
   * Stop a robot, or all: "*". Works without control.
   *
   * Without a connection it is the first message on the next one: a late stop is still
   * a stop.
   *
   * @param {string} robot
   * @returns {boolean} Whether it was sent now.
   */
  stop(robot) {
    // The first message: everything else that a STOP causes here comes after it.
    const left = this._link.open;
    if (left) this._link.send({ op: "stop", robot });
    this._session.stopped(robot, left, performance.now());
    this._listeners.emit("stop", robot);
    return left;
  }

  /**
   * End a STOP. Moves nothing, and gives control to no operator.
   *
   * The gate refuses it if STOP was pressed again since then.
   *
   * @param {string} robot
   * @param {string} stop The identity of the STOP that the operator saw: `stop.id` of
   *     the robot's report.
   */
  reset(robot, stop) {
    this._pilot.reset(robot, performance.now());
    this._send([{ op: "reset", robot, stop }]);
  }

  /**
   * Run a stop test of a robot that this page controls: the robot moves slowly.
   *
   * @param {string} robot
   */
  stopTest(robot) {
    this._pilot.stopTest(robot, performance.now());
  }

  /**
   * Report a check before driving, which the gate keeps if it saw a proved STOP.
   *
   * @param {string} robot
   */
  check(robot) {
    this._send([{ op: "check", robot }]);
  }

  /** End: neutral, control released, connection closed. */
  close() {
    this._goNeutral(true);
    clearInterval(this._timer);
    this._unwatch();
    this._link.abandon();
  }

  // The page's events, its timer and its socket --------------------------------

  /** @param {boolean} left Whether the page is hidden or going away. */
  _goNeutral(left) {
    const now = performance.now();
    this._pilot.goNeutral(now, { drop: true });
    this._step();
    if (left) this._send(this._pilot.letGo(now));
    this._listeners.emit("drop", null);
  }

  /** Reconnect after the page was frozen or stored: the connection may be dead. */
  _renew() {
    this._pilot.goNeutral(performance.now(), { drop: true });
    this._listeners.emit("drop", null);
    this._link.renew();
  }

  _tick() {
    this._listeners.emit("read", null);
    this._step();
    const now = performance.now();
    if (this._link.open) {
      const events = this._session.judge(now);
      if (events === null) this._link.lose();
      else this._emitAll(events);
    }
    this._link.mind(now);
    this._poseCommands.step(now);
    this._listeners.emit("step", null);
  }

  _step() {
    const { inputs } = this._session;
    const held = inputs.pressed;
    this._send(this._pilot.step(performance.now(), attentive()));
    if (held && !inputs.pressed) this._listeners.emit("drop", null);
  }

  /** @param {any} message */
  _receive(message) {
    if (message.op === "hello") this._link.trust();
    const { send, events } = this._session.receive(message, performance.now());
    this._send(send);
    if (message.op === "refused") {
      this._poseCommands.refused(message.robot, message.what, message.why);
    }
    this._emitAll(events);
  }

  /** @param {Command[]} commands */
  _send(commands) {
    for (const command of commands) {
      this._link.send(command);
      this._session.sent(command, performance.now());
      if (command.op === "goal") this._listeners.emit("goal", command.robot);
    }
  }

  /** @param {DriveEvent[]} events */
  _emitAll(events) {
    for (const [kind, what] of events) this._listeners.emit(kind, what);
  }
}

/**
 * @param {string | URL} baseUrl
 * @param {string | undefined} id
 */
function socketUrl(baseUrl, id) {
  const url = new URL("drive", baseUrl);
  if (FRAMED) url.searchParams.set("frame", "");
  if (id !== undefined) url.searchParams.set("id", id);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url;
}

/**
 * Show STOP ALL on a page without a picture, which has no other STOP; the keys act too.
 *
 * @param {Drive} drive
 * @returns {() => void} Removes it.
 */
export function showBareStop(drive) {
  const all = stopButton("", "STOP ALL", () => void drive.stop("*"));
  const result = html("p", "", { role: "status" });
  const label = { "aria-label": "STOP for all robots" };
  const box = html("section", "webmap-notice alert webmap-bare-stop", label, all, result);
  const show = () => {
    const waiting = drive.verdicts.map(({ name, text }) => `${name}: ${text}.`);
    setText(result, standingStops(drive.robots.values()) || waiting.join(" "));
  };
  document.body.append(box);
  return endOf(devicesOf(drive).open(), drive.on("step", show), () => box.remove());
}
