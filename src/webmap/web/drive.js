import { attentive, watchAttention } from "./motion/attention.js";
import { Errands } from "./motion/errands.js";
import { Line } from "./motion/line.js";
import { Listeners } from "./motion/news.js";
import { Session } from "./motion/session.js";

/** @typedef {import('./motion/axes.js').Axes} Axes */
/** @typedef {import('./motion/news.js').Item} Item */
/** @typedef {import('./motion/news.js').News} News */
/** @typedef {import('./motion/report.js').RobotReport} RobotReport */
/** @typedef {import('./motion/stream.js').Command} Command */
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
    this._listeners = new Listeners();
    this._errands = new Errands(
      this._pilot,
      this._session.loop,
      (commands) => this._send(commands),
      () => performance.now(),
    );
    this._line = new Line(socketUrl(baseUrl, options.id), {
      open: () => this._session.loop.open(performance.now()),
      receive: (message) => this._receive(message),
      lost: () => this._tellAll(this._session.lost(performance.now())),
    });
    this._unwatch = watchAttention(
      (left) => this._doubt(left),
      () => this._renew(),
    );
    this._timer = setInterval(() => this._tick(), PERIOD);
    this._line.mind(now);
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
    return { link: this.state, connection: this.connection, ...this._pilot.status };
  }

  /** The requests for control. */
  get requests() {
    return this._session.asking.requests(performance.now());
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
    return this._session.onset.delay(robot);
  }

  /**
   * Add a listener.
   *
   * @template {keyof News} K
   * @param {K} kind
   * @param {(news: News[K]) => void} fn
   * @returns {() => void} Removes the listener.
   */
  on(kind, fn) {
    return this._listeners.on(kind, fn);
  }

  // Inputs ---------------------------------------------------------------------

  /**
   * Set the axes of an input. Only one input drives at a time.
   *
   * @param {string} source
   * @param {Partial<Axes> | null} axes null if the input is gone.
   * @param {{fresh?: boolean}} [how] See {@link Hands#set}.
   */
  setInput(source, axes, how) {
    const { hands } = this._session;
    const was = hands.pressed;
    hands.set(source, axes, performance.now(), how);
    // A release and a press are sent immediately.
    if (was !== hands.pressed) this._step();
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
  doubt() {
    this._doubt(false);
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
    await this._errands.place("goal", robot, pose);
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
    const taken = await this._errands.place("locate", robot, pose);
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
    const left = this._line.open;
    if (left) this._line.send({ op: "stop", robot });
    this._session.stopped(robot, left, performance.now());
    this._listeners.tell("stop", robot);
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
    this._pilot.doubt(performance.now());
    this._send([{ op: "stop-test", robot }]);
  }

  /** End: neutral, control released, connection closed. */
  close() {
    this._doubt(true);
    clearInterval(this._timer);
    this._unwatch();
    this._line.abandon();
  }

  // The page's events, its timer and its socket --------------------------------

  /** @param {boolean} left Whether the page is hidden or going away. */
  _doubt(left) {
    const now = performance.now();
    this._pilot.doubt(now, { drop: true });
    this._step();
    if (left) this._send(this._pilot.letGo(now));
    this._listeners.tell("drop", null);
  }

  /** Reconnect after the page was frozen or stored: the connection may be dead. */
  _renew() {
    this._pilot.doubt(performance.now(), { drop: true });
    this._listeners.tell("drop", null);
    this._line.renew();
  }

  _tick() {
    this._listeners.tell("read", null);
    this._step();
    const now = performance.now();
    if (this._line.open) {
      const news = this._session.judge(now);
      if (news === null) this._line.lose();
      else this._tellAll(news);
    }
    this._line.mind(now);
    this._errands.step(now);
    this._listeners.tell("step", null);
  }

  _step() {
    const { hands } = this._session;
    const held = hands.pressed;
    this._send(this._pilot.step(performance.now(), attentive()));
    if (held && !hands.pressed) this._listeners.tell("drop", null);
  }

  /** @param {any} message */
  _receive(message) {
    if (message.op === "hello") this._line.trust();
    const { say, news } = this._session.receive(message, performance.now());
    this._send(say);
    if (message.op === "refused") {
      this._errands.refused(message.robot, message.what, message.why);
    }
    this._tellAll(news);
  }

  /** @param {Command[]} commands */
  _send(commands) {
    for (const command of commands) {
      this._line.send(command);
      this._session.sent(command, performance.now());
      if (command.op === "goal") this._listeners.tell("goal", command.robot);
    }
  }

  /** @param {Item[]} news */
  _tellAll(news) {
    for (const [kind, what] of news) this._listeners.tell(kind, what);
  }
}

/**
 * @param {string | URL} baseUrl
 * @param {string | undefined} id
 */
function socketUrl(baseUrl, id) {
  const url = new URL("drive", baseUrl);
  if (id !== undefined) url.searchParams.set("id", id);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url;
}
