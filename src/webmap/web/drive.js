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

/** Commands carry the state of the hands this often, in ms. */
const PERIOD = 50;

/**
 * This page's line to the gate: who drives what, the operator's hands, goals, STOP.
 *
 * One per page, however many maps it shows. It sends the *state* of the inputs at
 * 20 Hz while it holds a lease, from a timer of the page itself: a worker's timer would
 * go on when the page is hidden or hangs. No method moves a robot by itself but
 * {@link Drive#goal}; see `motion/pilot.js` for when the hands do.
 *
 * What is decided is decided in `motion/`; here are the clock, the timer, the socket and
 * the page's events.
 */
export class Drive {
  /**
   * @param {string | URL} baseUrl The address under which the server has `drive`.
   * @param {{id?: string, releaseAfter?: number}} [options] `id`: the page's own, by
   *     which the server knows its `scene` and `drive` as one. `releaseAfter`: a lease
   *     that is not used for so long is given back, in ms.
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

  /** The state of the link: may commands arrive, and do they? */
  get state() {
    return this._session.state;
  }

  /** This connection's name at the gate; null while there is none. */
  get connection() {
    return this._session.connection;
  }

  /**
   * The newest word of the gate on each robot.
   * @returns {ReadonlyMap<string, RobotReport>}
   */
  get robots() {
    return this._pilot.robots;
  }

  /** What the operator should know of the chosen robot and of the hands. */
  get status() {
    return { link: this.state, connection: this.connection, ...this._pilot.status };
  }

  /** Who asks for robots. */
  get requests() {
    return this._session.asking.requests(performance.now());
  }

  /** What became of the STOPs of this page. */
  get verdicts() {
    return this._session.verdicts(performance.now());
  }

  /** Show no more what became of the STOPs until now. */
  dismissVerdicts() {
    this._session.stopping.dismiss();
  }

  /**
   * How long it took a robot the last time from the first command to motion, in ms; null
   * before that.
   *
   * @param {string} robot
   */
  motionDelay(robot) {
    return this._session.onset.delay(robot);
  }

  /**
   * Listen.
   *
   * @template {keyof News} K
   * @param {K} kind
   * @param {(news: News[K]) => void} fn
   * @returns {() => void} Stops listening.
   */
  on(kind, fn) {
    return this._listeners.on(kind, fn);
  }

  // Hands ----------------------------------------------------------------------

  /**
   * Say what an input asks for. One input owns the motion at a time.
   *
   * @param {string} source
   * @param {Partial<Axes> | null} axes Null when the input is gone.
   * @param {{fresh?: boolean}} [how] See {@link Hands#set}.
   */
  setInput(source, axes, how) {
    const { hands } = this._session;
    const was = hands.pressed;
    hands.set(source, axes, performance.now(), how);
    // A release must not wait for the next step, nor should a press.
    if (was !== hands.pressed) this._step();
  }

  /**
   * Say that the operator goes by the picture of a robot's camera: while it is older
   * than a second, the robot does not move.
   *
   * @param {string} robot
   * @param {() => number} age How old the picture is that the page shows now, in ms.
   * @returns {() => void} The operator goes by it no more.
   */
  goBy(robot, age) {
    return this._pilot.pictures.goBy(robot, age);
  }

  /** Forget what is held and go neutral at once: for inputs that are in doubt. */
  doubt() {
    this._doubt(false);
  }

  // Leases ---------------------------------------------------------------------

  /**
   * Choose the robot that a press drives. The one driven before is let go of.
   *
   * @param {string | null} robot
   */
  choose(robot) {
    this._send(this._pilot.choose(robot, performance.now()));
  }

  /** @param {string} robot Ask for its lease. Whatever is pressed now does not move it. */
  take(robot) {
    this._send(this._pilot.take(robot, performance.now()));
  }

  /** @param {string} robot Give its lease back, neutral first. */
  release(robot) {
    this._send(this._pilot.release(robot, performance.now()));
  }

  /**
   * Ask the holder of a robot for it. Whatever is pressed when it comes does not move it.
   *
   * @param {string} robot
   */
  ask(robot) {
    this._send(this._pilot.ask(robot));
  }

  /** @param {string} robot Hand it to the one who asks for it, neutral first. */
  grant(robot) {
    this._send(this._pilot.grant(robot, performance.now()));
  }

  /** @param {string} robot Keep it, although somebody asks for it. */
  deny(robot) {
    this._send([{ op: "deny", robot }]);
  }

  /**
   * @param {string} robot
   * @returns {boolean} Whether this page may send it somewhere without asking anybody.
   */
  holds(robot) {
    return this._pilot.epoch(robot) !== null;
  }

  /** @param {string} robot Whose lease goes on being needed, if this page has it. */
  keep(robot) {
    this._send(this._pilot.keep(robot, performance.now()));
  }

  // Goals ----------------------------------------------------------------------

  /**
   * Send a robot to a place, and take its lease for that when it is free.
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
   * Tell a robot where it is, and take its lease for that moment when it is free.
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

  /** @param {string} robot Take its goal back. */
  cancel(robot) {
    this._send([{ op: "cancel", robot }]);
  }

  // STOP -----------------------------------------------------------------------

  /**
   * Stop a robot, or all: "*". Needs no lease, and is heard whoever drives.
   *
   * Without a connection it is the first thing said on the next one: a stop that comes
   * late is still a stop.
   *
   * @param {string} robot
   * @returns {boolean} Whether it has left this page.
   */
  stop(robot) {
    // Nothing may come before this: whatever else a STOP means here follows it.
    const left = this._line.open;
    if (left) this._line.send({ op: "stop", robot });
    this._session.stopped(robot, left, performance.now());
    this._listeners.tell("stop", robot);
    return left;
  }

  /**
   * End a STOP. Moves nothing, and gives nobody the robot.
   *
   * The gate refuses it if somebody pressed STOP since then.
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
   * Let a robot that this page holds creep, and find out how soon it stops by itself.
   *
   * @param {string} robot
   */
  stopTest(robot) {
    this._pilot.doubt(performance.now());
    this._send([{ op: "stop-test", robot }]);
  }

  /** End for good: neutral, leases back, connection closed. */
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

  /** The page was frozen or stored away; its connection may be dead or not ours. */
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
