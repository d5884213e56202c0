import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { PoseCommands } from "../../../src/webmap/web/motion/commands.js";
import { Session } from "../../../src/webmap/web/motion/session.js";

/**
 * A page with two gates: the gate of the display has r1, and the gate of the agent
 * "bay3" has r2. Each gate sends ticks, and acknowledges the commands to its robot.
 */
class Bench {
  constructor() {
    this.now = 0;
    this.epoch = 7;
    /** @type {any[]} */
    this.sent = [];
    this.gates = {
      r1: { tick: 100, ack: -1, ticking: true, acking: true, field: {} },
      r2: { tick: 5000, ack: -1, ticking: true, acking: true, field: { gate: "bay3" } },
    };
    this.session = new Session(0, {});
    this.poseCommands = new PoseCommands(
      this.session.pilot,
      this.session.loops,
      (commands) => this.keep(commands),
      () => this.now,
    );
    this.session.loops.open(0);
    this.greet();
  }

  /** The gate of the display sends hello, and both gates report their robots. */
  greet() {
    this.session.receive({ op: "hello", connection: "c1" }, this.now);
    this.report("r1");
    this.report("r2");
  }

  /**
   * @param {'r1' | 'r2'} robot
   * @param {object} [fields]
   */
  report(robot, fields = {}) {
    const report = { robot, holder: null, mine: false, epoch: null, armable: true };
    const { field } = this.gates[robot];
    this.session.receive({ op: "robot", ...report, ...field, ...fields }, this.now);
  }

  /** @param {'r1' | 'r2'} robot */
  grant(robot) {
    const holder = { connection: "c1", name: "me" };
    this.report(robot, { holder, mine: true, epoch: ++this.epoch, armed: true });
  }

  /** @param {any[]} commands */
  keep(commands) {
    this.sent.push(...commands);
    for (const { robot, seq } of commands) {
      const gate = this.gates[robot];
      if (seq !== undefined && gate.acking) gate.ack = seq;
    }
  }

  /**
   * @param {number} ms
   * @returns {any[]} What was sent.
   */
  run(ms) {
    const before = this.sent.length;
    for (let t = 0; t < ms; t += 50) {
      this.now += 50;
      for (const gate of Object.values(this.gates)) {
        const { ack, field } = gate;
        if (!gate.ticking) continue;
        this.session.receive({ op: "tick", tick: ++gate.tick, ack, ...field }, this.now);
      }
      this.keep(this.session.pilot.step(this.now, true));
      this.poseCommands.step(this.now);
    }
    return this.sent.slice(before);
  }

  /** @param {number} x */
  press(x) {
    this.session.inputs.set("keys", x === 0 ? null : { x }, this.now);
    this.keep(this.session.pilot.step(this.now, true));
  }

  /** @param {'r1' | 'r2'} robot Drive it forward until it moves. */
  drive(robot) {
    this.press(0);
    this.keep(this.session.pilot.choose(robot, this.now));
    this.run(600);
    this.press(1);
    assert.deepEqual(this.sent.at(-1), { op: "take", robot });
    this.grant(robot);
    this.run(600);
    assert.ok(moves(this.sent.slice(-1), robot), `${robot} is driven`);
  }
}

/**
 * @param {any[]} commands
 * @param {string} robot
 * @returns {boolean} Whether one of them moves the robot.
 */
function moves(commands, robot) {
  return commands.some((one) => one.op === "drive" && one.robot === robot && one.x !== 0);
}

/** @type {Bench} */
let bench;
beforeEach(() => {
  bench = new Bench();
});

describe("a robot of an agent's gate", () => {
  test("receives commands with the newest tick of its gate and growing numbers", () => {
    bench.drive("r1");
    bench.drive("r2");
    const numbers = bench.sent.map(({ seq }) => seq).filter((seq) => seq !== undefined);
    assert.deepEqual(numbers, [...numbers.keys()]);
    const last = bench.run(50)[0];
    assert.deepEqual([last.robot, last.tick], ["r2", bench.gates.r2.tick]);
    bench.drive("r1");
    assert.equal(bench.run(50)[0].tick, bench.gates.r1.tick);
  });

  test("does not move before its gate has acknowledged neutral", () => {
    bench.gates.r2.acking = false;
    bench.session.pilot.choose("r2", 0);
    bench.run(600);
    bench.press(1);
    bench.grant("r2");
    bench.gates.r1.ack = 1000;
    const sent = bench.run(250);
    assert.equal(sent.length, 5);
    assert.equal(moves(sent, "r2"), false);
    assert.equal(bench.session.pilot.settled, false);
    bench.gates.r2.acking = true;
    assert.equal(moves(bench.run(600), "r2"), true);
  });

  test("has the delay of its gate", () => {
    bench.drive("r2");
    assert.equal(bench.session.pilot.status.delay, 50);
    bench.gates.r2.acking = false;
    bench.run(200);
    assert.equal(bench.session.pilot.status.delay, 150);
    assert.deepEqual(bench.session.judge(bench.now), [], "the connection is still open");
  });

  test("is not ready for a press before the first tick of its gate", () => {
    bench.gates.r2.ticking = false;
    bench.run(600);
    bench.session.pilot.choose("r1", bench.now);
    assert.equal(bench.session.pilot.status.early, false);
    bench.session.pilot.choose("r2", bench.now);
    assert.equal(bench.session.pilot.status.early, true);
    bench.gates.r2.ticking = true;
    bench.run(600);
    assert.equal(bench.session.pilot.status.early, false);
  });
});

describe("an agent's gate without ticks", () => {
  beforeEach(() => {
    bench.drive("r2");
    bench.gates.r2.ticking = false;
    bench.run(300);
  });

  test("makes its lease neutral, until a new press after ticks and settling", () => {
    const silent = bench.run(600);
    assert.equal(silent.length, 12, "the stream goes on");
    assert.equal(moves(silent, "r2"), false);
    bench.gates.r2.ticking = true;
    assert.equal(moves(bench.run(1000), "r2"), false, "the key is still held");
    bench.press(0);
    bench.run(300);
    bench.press(1);
    assert.equal(moves(bench.run(50), "r2"), true);
  });

  test("does not close the connection", () => {
    bench.run(1000);
    assert.deepEqual(bench.session.judge(bench.now), []);
    assert.equal(bench.session.state, "open");
  });

  test("makes the link silent for its robots only", () => {
    const links = () =>
      ["r1", "r2", null].map((robot) => bench.session.linkTo(robot, bench.now));
    assert.deepEqual(links(), ["open", "open", "open"]);
    bench.run(50);
    assert.deepEqual(links(), ["open", "silent", "open"]);
    bench.run(1000);
    assert.deepEqual(links(), ["open", "silent", "open"]);
    bench.session.lost(bench.now);
    assert.deepEqual(links(), ["lost", "lost", "lost"]);
  });

  test("leaves the robots of other gates drivable", () => {
    bench.run(1000);
    bench.drive("r1");
    assert.equal(moves(bench.run(1000), "r1"), true);
  });

  test("does not let a press take its robots", () => {
    bench.run(100);
    bench.press(0);
    bench.keep(bench.session.pilot.release("r2", bench.now));
    bench.report("r2");
    bench.run(300);
    bench.sent = [];
    bench.press(1);
    bench.run(300);
    assert.deepEqual(bench.sent, []);
  });

  test("can be driven with again after its robot was gone", () => {
    bench.session.receive({ op: "gone", robot: "r2" }, bench.now);
    bench.run(1000);
    Object.assign(bench.gates.r2, { tick: 30, ack: -1, ticking: true });
    bench.report("r2");
    bench.drive("r2");
    assert.equal(bench.run(50)[0].tick, bench.gates.r2.tick);
  });
});

describe("the display's own gate without ticks", () => {
  test("closes the connection, in spite of the ticks of others", () => {
    bench.drive("r2");
    bench.gates.r1.ticking = false;
    bench.run(350);
    assert.deepEqual(bench.session.judge(bench.now), [["state", "late"]]);
    assert.equal(moves(bench.run(50), "r2"), true, "its own gate answers");
    bench.run(150);
    assert.equal(bench.session.judge(bench.now), null);
    bench.session.lost(bench.now);
    assert.equal(bench.session.pilot.driven, null);
    assert.deepEqual(bench.run(300), []);
  });
});

test("a second hello forgets the ticks and leases of all gates", () => {
  bench.drive("r2");
  bench.greet();
  assert.equal(bench.session.pilot.driven, null);
  assert.equal(bench.session.loops.of("r2").tick, null);
  assert.equal(bench.session.loops.own.tick, null);
  for (const gate of Object.values(bench.gates)) gate.ack = -1;
  bench.drive("r2");
  assert.equal(bench.run(50)[0].tick, bench.gates.r2.tick);
});

test("the first report of a robot may both name its gate and give control", () => {
  bench.session.receive({ op: "hello", connection: "c1" }, 0);
  bench.session.pilot.choose("r2", 0);
  bench.run(600);
  bench.press(1);
  bench.grant("r2");
  assert.equal(moves(bench.run(600), "r2"), true);
  assert.equal(bench.run(50)[0].tick, bench.gates.r2.tick);
});

test("goals for robots of two gates carry the tick of each and wait for its answer", async () => {
  bench.grant("r1");
  bench.grant("r2");
  bench.run(100);
  /** @type {string[]} */
  const done = [];
  for (const gate of Object.values(bench.gates)) gate.acking = false;
  for (const robot of /** @type {const} */ (["r1", "r2"])) {
    const pose = { x: 1, y: 2, yaw: 0 };
    void bench.poseCommands.place("goal", robot, pose).then(() => done.push(robot));
  }
  const goals = bench.sent.map(({ op, robot, seq, tick }) => [op, robot, seq, tick]);
  const { r1, r2 } = bench.gates;
  assert.deepEqual(goals, [
    ["goal", "r1", 0, r1.tick],
    ["goal", "r2", 1, r2.tick],
  ]);
  r1.ack = 1000;
  bench.run(50);
  await new Promise(setImmediate);
  assert.deepEqual(done, ["r1"]);
  r2.ack = 1;
  bench.run(50);
  await new Promise(setImmediate);
  assert.deepEqual(done, ["r1", "r2"]);
});
