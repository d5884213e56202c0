import assert from "node:assert/strict";
import { test } from "node:test";

import { RouteRobots } from "../../../src/webmap/features/routes/route_run.js";
import { TRIES } from "../../../src/webmap/web/tools/goals.js";
import { holdTimeouts, settle } from "../../web/tools/held_timeouts.js";

const LINKLESS = "no connection to the bridge that takes goals";
const POINTS = [1, 2, 3].map((x) => ({ x, y: 0, yaw: 0 }));

const pass = holdTimeouts();

/** The page's link to a gate that refuses goals with the reason `refusal`, if any. */
class FakeDrive {
  constructor() {
    this.refusal = null;
    /** The x of each goal that was sent to the gate, and "cancel". */
    this.offered = [];
    this.kept = 0;
    this.robots = new Map();
    this._listeners = {};
  }

  on(kind, fn) {
    this._listeners[kind] = fn;
    return () => delete this._listeners[kind];
  }

  emit(kind, what) {
    this._listeners[kind]?.(what);
  }

  holds() {
    return true;
  }

  keep() {
    this.kept += 1;
  }

  cancel() {
    this.offered.push("cancel");
  }

  async goal(robot, { x }) {
    await this.taking;
    this.offered.push(x);
    this.emit("goal", robot);
    if (this.refusal !== null) throw new Error(this.refusal);
  }

  report(reported, more = {}) {
    this.robots.set("r1", { robot: "r1", latched: false, goal: reported, ...more });
    this.emit("robot", { robot: "r1" });
  }
}

function goal(id, state = "under way") {
  return { id, state, why: "", method: "navigate_to_pose", left: null, eta: null };
}

/** A robot whose first goal waits for a link, as another goal used the link. */
async function waiting() {
  const drive = new FakeDrive();
  drive.report(null);
  drive.refusal = LINKLESS;
  const robots = new RouteRobots(drive, () => null, () => {});
  robots.begin("r1", POINTS, { loop: false });
  await settle();
  assert.deepEqual(drive.offered, [1]);
  return { drive, robots, run: robots.of("r1").run };
}

test("a route continues after its goals were refused for a missing link", async () => {
  const { drive, run } = await waiting();
  assert.equal(run.state, "going");
  drive.refusal = null;
  await pass();
  drive.report(goal("g1"));
  drive.refusal = LINKLESS;
  drive.report(goal("g1", "reached"));
  await settle();
  drive.refusal = null;
  await pass();
  drive.report(goal("g2"));
  assert.deepEqual(drive.offered, [1, 1, 2, 2]);
  assert.equal(run.state, "going");
});

test("a route without a link halts with that reason after all tries", async () => {
  const { drive, run } = await waiting();
  await pass(20);
  assert.equal(run.state, "halted");
  assert.equal(run.why, LINKLESS);
  assert.equal(drive.offered.length, TRIES);
});

test("a waiting route is not busy", async () => {
  const { robots } = await waiting();
  assert.equal(robots.of("r1").busy, false);
});

for (const [what, act, state] of [
  ["paused", ({ robots }) => robots.act("r1", "pause"), "paused"],
  ["ended", ({ robots }) => robots.act("r1", "end"), "ended"],
  ["stopped", ({ drive }) => drive.emit("stop", "r1"), "halted"],
  ["stopped with all robots", ({ drive }) => drive.emit("stop", "*"), "halted"],
  ["stopped by another page", ({ drive }) => drive.report(null, { latched: true }), "halted"],
  ["sent elsewhere by this page", ({ drive }) => drive.emit("goal", "r1"), "halted"],
  ["sent elsewhere by another", ({ drive }) => drive.report(goal("g9")), "halted"],
]) {
  test(`a waiting route that is ${what} sends no more goals`, async () => {
    const bench = await waiting();
    act(bench);
    bench.drive.refusal = null;
    await pass(20);
    assert.equal(bench.run.state, state);
    assert.deepEqual(
      bench.drive.offered.filter((each) => each !== "cancel"),
      [1],
    );
  });
}

test("a STOP of another robot does not halt a route", async () => {
  const { drive, run } = await waiting();
  drive.emit("stop", "r2");
  assert.equal(run.state, "going");
});

test("a skip while waiting drops the point and sends the next point once", async () => {
  const { drive, robots, run } = await waiting();
  drive.refusal = null;
  robots.act("r1", "skip");
  await pass(20);
  assert.deepEqual(drive.offered, [1, 2]);
  assert.equal(run.state, "going");
});

test("a waiting route that is paused and resumed sends its point once", async () => {
  const { drive, robots, run } = await waiting();
  robots.act("r1", "pause");
  drive.refusal = null;
  robots.act("r1", "go");
  await pass(20);
  assert.deepEqual(drive.offered, [1, "cancel", 1]);
  assert.equal(run.state, "going");
});

test("no goals are sent after the tool is destroyed", async () => {
  const { drive, robots } = await waiting();
  robots.destroy();
  await pass(20);
  assert.deepEqual(drive.offered, [1]);
});

test("a route that ends while its lease is requested cancels the goal sent later", async () => {
  const drive = new FakeDrive();
  drive.report(null);
  let take;
  drive.taking = new Promise((resolve) => (take = resolve));
  const robots = new RouteRobots(drive, () => null, () => {});
  robots.begin("r1", POINTS, { loop: false });
  robots.act("r1", "end");
  take();
  await settle();
  assert.deepEqual(drive.offered, ["cancel", 1, "cancel"]);
  assert.equal(robots.of("r1").run.state, "ended");
});

test("a removed robot halts its route", async () => {
  const { drive, robots, run } = await waiting();
  drive.robots.clear();
  robots.look();
  assert.equal(run.why, "the robot is gone");
});

test("the page keeps control of a robot only while its route runs", async () => {
  const { drive, robots } = await waiting();
  drive.emit("step", null);
  assert.equal(drive.kept, 1);
  robots.act("r1", "end");
  drive.emit("step", null);
  assert.equal(drive.kept, 1);
});

test("a run continues after the map is drawn again", async () => {
  const drive = new FakeDrive();
  drive.report(null, { name: "Bob" });
  const before = new RouteRobots(drive, () => null, () => {});
  before.begin("r1", POINTS, { loop: false });
  await settle();
  drive.report(goal("g1"), { name: "Bob" });
  const runs = before.destroy();
  const after = new RouteRobots(drive, () => null, () => {}, runs);
  drive.report(goal("g1", "reached"), { name: "Bob" });
  await settle();
  assert.deepEqual(drive.offered, [1, 2]);
  assert.equal(after.of("r1").run.index, 1);
  assert.equal(before.of("r1"), undefined);
});

test("a run halts if the map is drawn again while its goal waits for a link", async () => {
  const drive = new FakeDrive();
  drive.report(null, { name: "Bob" });
  drive.refusal = LINKLESS;
  const before = new RouteRobots(drive, () => null, () => {});
  before.begin("r1", POINTS, { loop: false });
  await settle();
  const after = new RouteRobots(drive, () => null, () => {}, before.destroy());
  drive.refusal = null;
  await pass(20);
  assert.deepEqual(drive.offered, [1]);
  assert.equal(after.of("r1").run.why, "the map was drawn again");
});

test("a robot with the same id but another name does not get the run", async () => {
  const drive = new FakeDrive();
  drive.report(null, { name: "Bob" });
  const before = new RouteRobots(drive, () => null, () => {});
  before.begin("r1", POINTS, { loop: false });
  await settle();
  const runs = before.destroy();
  drive.report(null, { name: "Alice" });
  const after = new RouteRobots(drive, () => null, () => {}, runs);
  assert.equal(after.of("r1"), undefined);
});

test("a goal sent after the map was drawn again is cancelled", async () => {
  const drive = new FakeDrive();
  drive.report(null, { name: "Bob" });
  let take = () => {};
  drive.taking = new Promise((done) => (take = done));
  const before = new RouteRobots(drive, () => null, () => {});
  before.begin("r1", POINTS, { loop: false });
  await settle();
  const after = new RouteRobots(drive, () => null, () => {}, before.destroy());
  take();
  await pass();
  assert.deepEqual(drive.offered, [1, "cancel"]);
  assert.equal(after.of("r1").run.state, "halted");
});
