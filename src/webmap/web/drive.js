import { Asking } from "./motion/asking.js";
import { attentive, watchAttention } from "./motion/attention.js";
import { Hands } from "./motion/hands.js";
import { Line } from "./motion/line.js";
import { Loop } from "./motion/loop.js";
import { Onset } from "./motion/onset.js";
import { Pilot } from "./motion/pilot.js";
import { TAKE_PATIENCE } from "./motion/reach.js";
import { Stopping } from "./motion/stopping.js";

/** @typedef {import('./motion/axes.js').Axes} Axes */
/** @typedef {import('./motion/stream.js').Command} Command */
/** @typedef {import('./motion/report.js').RobotReport} RobotReport */
/** @typedef {import('./motion/stopping.js').Verdict} Verdict */
/** @typedef {'connecting' | 'open' | 'late' | 'lost'} LinkState */

/**
 * The kinds of news, and what each tells.
 *
 * `robot`: the gate's newest word on a robot. `gone`: the gate knows a robot no more.
 * `state`: the link's state changed. `refused`: the gate refused something. `stop`:
 * STOP was sent for a robot or "*". `goal`: a goal was sent for a robot. `read`: inputs that must be asked for their state
 * (gamepads) are asked now. `drop`: inputs must forget what is held. `step`: a 20 Hz
 * step is over.
 *
 * @typedef {object} News
 * @property {RobotReport} robot
 * @property {string} gone
 * @property {LinkState} state
 * @property {{robot: string | null, what: string, why: string}} refused
 * @property {string} stop
 * @property {string} goal
 * @property {null} read
 * @property {null} drop
 * @property {null} step
 */

/** Commands carry the state of the hands this often, in ms. */
const PERIOD = 50;

/**
 * This page's line to the gate: who drives what, the operator's hands, goals, STOP.
 *
 * One per page, however many maps it shows. It sends the *state* of the inputs at
 * 20 Hz while it holds a lease, from a timer of the page itself: a worker's timer would
 * go on when the page is hidden or hangs. No method moves a robot by itself but
 * {@link Drive#goal}; see `motion/pilot.js` for when the hands do.
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
    this._hands = new Hands(now);
    this._loop = new Loop();
    this._pilot = new Pilot(this._hands, this._loop, now, options);
    this._stopping = new Stopping();
    this._asking = new Asking();
    this._onset = new Onset();
    this._line = new Line(socketUrl(baseUrl, options.id), {
      open: () => this._loop.open(performance.now()),
      receive: (message) => this._receive(message),
      lost: () => this._lost(),
    });
    /**
     * This connection's name at the gate; null while there is none.
     * @type {string | null}
     */
    this.connection = null;
    /** @type {LinkState} */
    this._state = "connecting";
    /** @type {Map<keyof News, Set<Function>>} */
    this._listeners = new Map();
    /**
     * STOPs that were asked for without a connection.
     * @type {Set<string>}
     */
    this._unsent = new Set();
    this._unwatch = watchAttention(
      (left) => this._doubt(left),
      () => this._renew(),
    );
    this._timer = setInterval(() => this._tick(), PERIOD);
    this._line.mind(now);
  }

  /** The state of the link: may commands arrive, and do they? */
  get state() {
    return this._state;
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
    return {
      link: this._state,
      connection: this.connection,
      ...this._pilot.status,
    };
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
    const listeners = this._listeners.get(kind) ?? new Set();
    this._listeners.set(kind, listeners.add(fn));
    return () => {
      listeners.delete(fn);
    };
  }

  /**
   * Say what an input asks for. One input owns the motion at a time.
   *
   * @param {string} source
   * @param {Partial<Axes> | null} axes Null when the input is gone.
   */
  setInput(source, axes) {
    const was = this._hands.pressed;
    this._hands.set(source, axes, performance.now());
    // A release must not wait for the next step, nor should a press.
    if (was !== this._hands.pressed) this._step();
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

  /**
   * Choose the robot that a press drives. The one driven before is let go of.
   *
   * @param {string | null} robot
   */
  choose(robot) {
    this._send(this._pilot.choose(robot, performance.now()));
  }

  /**
   * Ask for the lease of a robot. Whatever is pressed now does not move it.
   *
   * @param {string} robot
   */
  take(robot) {
    this._send(this._pilot.take(robot, performance.now()));
  }

  /**
   * Give the lease of a robot back, neutral first.
   *
   * @param {string} robot
   */
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

  /**
   * Hand a robot to the one who asks for it, neutral first.
   *
   * @param {string} robot
   */
  grant(robot) {
    this._send(this._pilot.grant(robot, performance.now()));
  }

  /**
   * Keep a robot that somebody asks for.
   *
   * @param {string} robot
   */
  deny(robot) {
    this._send([{ op: "deny", robot }]);
  }

  /**
   * Who asks for robots.
   *
   * @returns {import('./motion/asking.js').Request[]}
   */
  get requests() {
    return this._asking.requests(performance.now());
  }

  /**
   * Send a robot to a place, and take its lease for that when it is free.
   *
   * @param {string} robot
   * @param {{x: number, y: number, yaw: number}} pose Metres and radians in the
   *     robot's goal frame.
   * @returns {Promise<void>} Done when the gate has accepted the goal.
   * @throws {Error} When the gate refuses it or does not answer.
   */
  async goal(robot, pose) {
    await this._place("goal", robot, pose);
  }

  /**
   * Tell a robot where it is, and take its lease for that moment when it is free.
   *
   * @param {string} robot
   * @param {{x: number, y: number, yaw: number}} pose Metres and radians in the
   *     robot's goal frame.
   * @returns {Promise<void>} Done when the gate has accepted it.
   * @throws {Error} When the gate refuses it or does not answer.
   */
  async locate(robot, pose) {
    const taken = await this._place("locate", robot, pose);
    if (taken) this.release(robot);
  }

  /**
   * Whether this page may send a robot somewhere without asking anybody.
   *
   * @param {string} robot
   */
  holds(robot) {
    return this._pilot.epoch(robot) !== null;
  }

  /**
   * Keep the lease of a robot that this page has, as it goes on being needed.
   *
   * @param {string} robot
   */
  keep(robot) {
    this._pilot.keep(robot, performance.now());
  }

  /**
   * @param {'goal' | 'locate'} op
   * @param {string} robot
   * @param {{x: number, y: number, yaw: number}} pose
   * @returns {Promise<boolean>} Whether the lease was taken for it.
   */
  async _place(op, robot, { x, y, yaw }) {
    if (![x, y, yaw].every(Number.isFinite)) {
      throw new Error(`A ${op} needs finite numbers, got ${x}, ${y}, ${yaw}.`);
    }
    const taken = this._pilot.epoch(robot) === null;
    if (taken) {
      this._send([{ op: "take", robot }]);
      await this._until(robot, "take", () => this._pilot.epoch(robot) !== null);
    }
    const command = this._pilot.place(op, robot, { x, y, yaw }, performance.now());
    this._send([command]);
    if (op === "goal") this._tell("goal", robot);
    try {
      await this._until(robot, op, () => this._loop.acknowledged(command.seq));
    } catch (error) {
      if (taken) this.release(robot);
      throw error;
    }
    return taken;
  }

  /**
   * Take back the goal of a robot.
   *
   * @param {string} robot
   */
  cancel(robot) {
    this._send([{ op: "cancel", robot }]);
  }

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
    const left = this._line.open;
    if (left) this._line.send({ op: "stop", robot });
    else this._unsent.add(robot);
    const now = performance.now();
    this._pilot.stopped(robot, now);
    this._stopping.start(robot, this.robots, now);
    this._tell("stop", robot);
    return left;
  }

  /**
   * End the STOP of a robot, or all: "*". Moves nothing, and gives nobody the robot.
   *
   * @param {string} robot
   */
  reset(robot) {
    this._pilot.reset(robot, performance.now());
    this._send([{ op: "reset", robot }]);
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

  /**
   * How long it took a robot the last time from the first command to motion, in ms; null
   * before that.
   *
   * @param {string} robot
   */
  motionDelay(robot) {
    return this._onset.delay(robot);
  }

  /**
   * What became of the STOPs of this page.
   *
   * @returns {Verdict[]}
   */
  get verdicts() {
    const connected = this._state === "open" || this._state === "late";
    return this._stopping.verdicts(this.robots, connected, performance.now());
  }

  /** Show no more what became of the STOPs until now. */
  dismissVerdicts() {
    this._stopping.dismiss();
  }

  /** End for good: neutral, leases back, connection closed. */
  close() {
    this._doubt(true);
    clearInterval(this._timer);
    this._unwatch();
    this._line.abandon();
  }

  /** @param {boolean} left Whether the page is hidden or going away. */
  _doubt(left) {
    const now = performance.now();
    this._pilot.doubt(now, { drop: true });
    this._step();
    if (left) this._send(this._pilot.letGo(now));
    this._tell("drop", null);
  }

  _tick() {
    this._tell("read", null);
    this._step();
    const now = performance.now();
    if (this._line.open) this._judge(this._loop.state(now));
    this._line.mind(now);
    this._tell("step", null);
  }

  _step() {
    const held = this._hands.pressed;
    this._send(this._pilot.step(performance.now(), attentive()));
    if (held && !this._hands.pressed) this._tell("drop", null);
  }

  /** @param {'open' | 'late' | 'lost'} state */
  _judge(state) {
    if (state === "lost") this._line.lose();
    else if (this.connection !== null) this._setState(state);
  }

  /** The page was frozen or stored away; its connection may be dead or not ours. */
  _renew() {
    this._pilot.doubt(performance.now(), { drop: true });
    this._tell("drop", null);
    this._line.renew();
  }

  _lost() {
    this.connection = null;
    this._forget(performance.now());
    this._setState("lost");
    for (const report of this.robots.values()) this._tell("robot", report);
  }

  /**
   * Forget leases, numbers and ticks: they belong to one connection to one gate.
   *
   * @param {number} now
   */
  _forget(now) {
    this._pilot.doubt(now);
    this._pilot.disconnect();
    this._asking.forget();
    this._loop.open(now);
  }

  /** @param {any} message */
  _receive(message) {
    const now = performance.now();
    if (message.op === "tick") {
      this._loop.receive(message.tick, message.ack, now);
    } else if (message.op === "hello") {
      // A second one on a connection: the gate was started anew.
      if (this.connection !== null) this._forget(now);
      this.connection = message.connection;
      this._line.trust();
      for (const robot of this._unsent) this._line.send({ op: "stop", robot });
      this._unsent.clear();
      this._setState("open");
    } else if (message.op === "robot") {
      this._pilot.report(message, now);
      this._stopping.report(message, now);
      this._asking.report(message, now);
      this._onset.report(message, now);
      this._tell("robot", message);
    } else if (message.op === "gone") {
      this._pilot.gone(message.robot, now);
      this._stopping.gone(message.robot);
      this._asking.gone(message.robot);
      this._onset.gone(message.robot);
      this._tell("gone", message.robot);
    } else if (message.op === "refused") {
      this._pilot.refuse(message.robot, message.what, message.why, now);
      this._tell("refused", message);
    }
  }

  /** @param {Command[]} messages */
  _send(messages) {
    for (const message of messages) {
      this._line.send(message);
      if (message.op !== "drive") continue;
      const moving = ["x", "y", "turn"].some((axis) => message[axis] !== 0);
      this._onset.sent(message.robot, moving, performance.now());
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
      const since = performance.now();
      /** @param {string | null} problem */
      const end = (problem) => {
        for (const off of offs) off();
        if (problem === null) resolve();
        else reject(new Error(problem));
      };
      const offs = [
        this.on("refused", (refusal) => {
          if (refusal.robot === robot && refusal.what === what) end(refusal.why);
        }),
        this.on("step", () => {
          if (reached()) end(null);
          else if (performance.now() - since > TAKE_PATIENCE) {
            end("The gate is silent.");
          }
        }),
      ];
    });
  }

  /** @param {LinkState} state */
  _setState(state) {
    if (state === this._state) return;
    this._state = state;
    this._tell("state", state);
  }

  /**
   * @template {keyof News} K
   * @param {K} kind
   * @param {News[K]} news
   */
  _tell(kind, news) {
    for (const fn of this._listeners.get(kind) ?? []) {
      try {
        fn(news);
      } catch (error) {
        // A broken display must never keep a neutral or a STOP from leaving.
        reportError(error);
      }
    }
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
