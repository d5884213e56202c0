import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { PoseCommands } from "../../../src/webmap/web/motion/commands.js";
import { TAKE_PATIENCE } from "../../../src/webmap/web/motion/leases.js";
import { Session } from "../../../src/webmap/web/motion/session.js";

const POSE = { x: 1, y: 2, yaw: 0 };

/** @type {{now: number, sent: any[], session: Session, poseCommands: PoseCommands}} */
let it;
beforeEach(() => {
  const session = new Session(0, {});
  const send = (/** @type {any[]} */ commands) => it.sent.push(...commands);
  const poseCommands = new PoseCommands(session.pilot, session.loops, send, () => it.now);
  it = { now: 0, sent: [], session, poseCommands };
  session.receive({ op: "hello", connection: "c1" }, 0);
  reportRobot(false);
});

/** @param {boolean} mine */
function reportRobot(mine) {
  const holder = mine ? { connection: "c1", name: "me" } : null;
  const report = { op: "robot", robot: "r1", mine, holder, epoch: mine ? 7 : null };
  it.session.receive(report, it.now);
}

/** Step, and let pending promises continue. */
async function step(ms = 50) {
  it.now += ms;
  it.poseCommands.step(it.now);
  await new Promise(setImmediate);
}

/** @param {number} ack */
const acknowledge = (ack) =>
  it.session.receive({ op: "tick", tick: 100, ack }, it.now);

const sentOps = () => it.sent.map(({ op }) => op);

test("a goal for a free robot first takes control and is then sent", async () => {
  const placed = it.poseCommands.place("goal", "r1", POSE);
  await step();
  assert.deepEqual(sentOps(), ["take"]);
  reportRobot(true);
  await step();
  assert.deepEqual(sentOps(), ["take", "goal"]);
  const { epoch, seq, ...rest } = it.sent[1];
  assert.deepEqual([epoch, rest.x, rest.y, rest.yaw], [7, 1, 2, 0]);
  acknowledge(seq);
  await step();
  assert.equal(await placed, true, "the lease was requested for the goal");
});

test("a pose for a robot under control of this page is sent at once", async () => {
  reportRobot(true);
  const placed = it.poseCommands.place("locate", "r1", POSE);
  assert.deepEqual(sentOps(), ["locate"]);
  acknowledge(it.sent[0].seq);
  await step();
  assert.equal(await placed, false);
});

test("a lease that was taken for a refused goal is released", async () => {
  const placed = it.poseCommands.place("goal", "r1", POSE);
  const failed = assert.rejects(placed, /no such place/);
  reportRobot(true);
  await step();
  it.poseCommands.refused("r1", "take", "a refusal of another operation");
  it.poseCommands.refused("r2", "goal", "a refusal for another robot");
  it.poseCommands.refused("r1", "goal", "no such place");
  await failed;
  assert.deepEqual(sentOps(), ["take", "goal", "release"]);
});

test("a refused lease rejects the goal", async () => {
  const placed = it.poseCommands.place("goal", "r1", POSE);
  it.poseCommands.refused("r1", "take", "Ann has control");
  await assert.rejects(placed, /Ann has control/);
  assert.deepEqual(sentOps(), ["take"]);
});

test("a goal is rejected when the gate does not answer", async () => {
  const failed = assert.rejects(it.poseCommands.place("goal", "r1", POSE), /no answer/);
  await step(TAKE_PATIENCE);
  await step(1);
  await failed;
});

test("a goal with a number that is not finite is rejected", async () => {
  const nowhere = { ...POSE, yaw: NaN };
  await assert.rejects(it.poseCommands.place("goal", "r1", nowhere), /finite.+1, 2, NaN/);
  assert.deepEqual(it.sent, []);
});
