import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { LATE, LOST, RoundTrips } from "../../../src/webmap/web/motion/round_trips.js";

/** @type {RoundTrips} */
let loops;
beforeEach(() => {
  loops = new RoundTrips();
  loops.open(0);
  reportRobot("r1");
  reportRobot("r2", "bay3", 0);
  reportRobot("r3", "bay4", 0);
});

/**
 * @param {string} robot
 * @param {string} [gate]
 * @param {number} [now]
 */
function reportRobot(robot, gate, now = 0) {
  loops.report(/** @type {any} */ ({ robot, gate }), now);
}

const ticks = () => ["r1", "r2", "r3", "r4"].map((robot) => loops.of(robot).tick);

test("each robot has the ticks of its gate, one without a report those of the own", () => {
  loops.receive({ tick: 100, ack: -1 }, 0);
  loops.receive({ tick: 5000, ack: -1, gate: "bay3" }, 0);
  assert.deepEqual(ticks(), [100, 5000, null, 100]);
  assert.equal(loops.of(null), loops.own);
});

test("ticks that arrive before the first report of a gate count", () => {
  loops.receive({ tick: 70, ack: -1, gate: "bay9" }, 0);
  reportRobot("r4", "bay9");
  assert.equal(loops.of("r4").tick, 70);
});

test("a gate acknowledges only the commands to its robots", () => {
  loops.receive({ tick: 100, ack: 8 }, 0);
  loops.receive({ tick: 5000, ack: 3, gate: "bay3" }, 0);
  assert.equal(loops.of("r1").acknowledged(8), true);
  assert.equal(loops.of("r2").acknowledged(3), true);
  assert.equal(loops.of("r2").acknowledged(4), false);
  assert.equal(loops.of("r3").acknowledged(0), false);
});

test("each gate is late and lost by its own ticks, from its first message", () => {
  reportRobot("r4", "bay9", 1000);
  loops.receive({ tick: 100, ack: -1 }, 1000);
  const states = (/** @type {number} */ now) =>
    ["r1", "r2", "r4"].map((robot) => loops.of(robot).state(now));
  assert.deepEqual(states(1000 + LATE), ["open", "lost", "open"]);
  loops.receive({ tick: 101, ack: -1 }, 1000 + LOST);
  loops.receive({ tick: 5000, ack: -1, gate: "bay3" }, 1000 + LOST);
  assert.deepEqual(states(1000 + LOST + 1), ["open", "open", "lost"]);
});

test("a robot whose gate changes has the ticks of the new gate", () => {
  loops.receive({ tick: 100, ack: -1 }, 0);
  loops.receive({ tick: 5000, ack: -1, gate: "bay3" }, 0);
  reportRobot("r1", "bay3");
  reportRobot("r2");
  assert.deepEqual(ticks(), [5000, 100, null, 100]);
});

test("a gone robot has no gate any more", () => {
  loops.receive({ tick: 100, ack: -1 }, 0);
  loops.receive({ tick: 5000, ack: -1, gate: "bay3" }, 0);
  loops.gone("r2");
  assert.equal(loops.of("r2").tick, 100);
});

test("a new connection forgets the ticks and acknowledgements of all gates", () => {
  loops.receive({ tick: 100, ack: 9 }, 0);
  loops.receive({ tick: 5000, ack: 9, gate: "bay3" }, 0);
  loops.open(1000);
  reportRobot("r2", "bay3", 1000);
  assert.deepEqual(ticks(), [null, null, null, null]);
  assert.equal(loops.of("r2").acknowledged(0), false);
  assert.equal(loops.of("r3"), loops.own);
});

test("all gates send as few ticks as the hello states", () => {
  loops.greeted(2);
  reportRobot("r5", "bay5", 0);
  assert.deepEqual(
    ["r1", "r2", "r5"].map((robot) => loops.of(robot).state(LOST + 450)),
    ["late", "late", "late"],
  );
});
