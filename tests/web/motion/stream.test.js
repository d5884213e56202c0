import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { Inputs } from "../../../src/webmap/web/motion/inputs.js";
import { RoundTrips } from "../../../src/webmap/web/motion/round_trips.js";
import { ASLEEP, SETTLE, Stream } from "../../../src/webmap/web/motion/commands.js";

const FORWARD = { x: 1, y: 0, turn: 0 };

/** @type {{inputs: Inputs, loops: RoundTrips, stream: Stream, now: number}} */
let it;
beforeEach(() => {
  const inputs = new Inputs(-1000);
  const loops = new RoundTrips();
  it = { inputs, loops, stream: new Stream(inputs, loops, 0), now: 0 };
  loops.open(0);
  loops.own.receive(100, -1, 0);
  it.stream.open("r1", 7, 0);
  inputs.set("keys", FORWARD, 0);
});

/**
 * Take steps of 50 ms with a gate that sends ticks and acknowledges commands.
 *
 * @param {number} ms
 * @param {{armed?: boolean, attentive?: boolean, acking?: boolean}} [how]
 * @returns {any[]} The sent commands.
 */
function run(ms, { armed = true, attentive = true, acking = true } = {}) {
  const sent = [];
  for (const end = it.now + ms; it.now < end; ) {
    it.now += 50;
    it.stream.look(it.now, attentive, "r1");
    sent.push(...it.stream.step(armed, it.now));
    const ack = acking ? Number(sent.at(-1)?.seq ?? -1) : -1;
    it.loops.own.receive(100 + it.now / 50, ack, it.now);
  }
  return sent;
}

describe("a stream", () => {
  test("sends nothing without a lease", () => {
    it.stream.close();
    assert.deepEqual(run(200), []);
    assert.deepEqual(it.stream.neutral(it.now), []);
  });

  test("sends its lease, a growing number and the newest tick with each command", () => {
    const [first, second] = run(100);
    assert.deepEqual(first, {
      op: "drive",
      robot: "r1",
      epoch: 7,
      seq: 0,
      tick: 100,
      x: 0,
      y: 0,
      turn: 0,
    });
    assert.deepEqual([second.seq, second.tick], [1, 101]);
  });

  test("is neutral until the gate has received neutral for the settling time", () => {
    const sent = run(600);
    const first = sent.findIndex(({ x }) => x === 1);
    assert.ok(50 * first >= SETTLE, `moved after ${50 * first} ms`);
    assert.ok(sent.slice(first).every(({ x }) => x === 1));
  });

  test("stays neutral while the gate acknowledges nothing", () => {
    assert.ok(run(250, { acking: false }).every(({ x }) => x === 0));
    assert.equal(it.stream.settled, false);
  });

  test("stays neutral while the gate is not armed", () => {
    assert.ok(run(600, { armed: false }).every(({ x }) => x === 0));
  });

  test("restarts its numbers on another connection", () => {
    run(200);
    it.stream.restart();
    assert.equal(it.stream.lease, null);
    assert.equal(it.stream.stamp("r1").seq, 0);
  });

  test("counts as used while inputs ask for motion", () => {
    run(200);
    assert.equal(it.stream.lease?.usedAt, 200);
    it.inputs.set("keys", null, 200);
    run(200);
    assert.equal(it.stream.lease?.usedAt, 200);
  });

  test("measures how long its oldest command waits for an acknowledgement", () => {
    run(200);
    assert.equal(it.stream.delay, 0);
    run(200, { acking: false });
    assert.equal(it.stream.delay, 150);
  });
});

describe("a stream that moves a robot", () => {
  beforeEach(() => {
    run(600);
    assert.equal(it.inputs.blocked, false, "the inputs drive the robot");
  });

  const doubts = {
    "the page is not attended to": () => run(50, { attentive: false }),
    "the page slept": () => it.stream.look((it.now += ASLEEP + 1), true, "r1"),
    "the clock was set back": () => it.stream.look((it.now -= 1), true, "r1"),
    "the picture is old": () => {
      it.stream.pictures.goBy("r1", () => 1001);
      run(50);
    },
    "the loop is late": () => it.stream.look((it.now += 301), true, "r1"),
    "there is no tick": () => {
      it.loops.open(it.now);
      it.stream.look(it.now, true, "r1");
    },
    "somebody says so": () => it.stream.goNeutral(it.now),
  };
  for (const [what, happen] of Object.entries(doubts)) {
    test(`is neutral and settles again when ${what}`, () => {
      happen();
      assert.equal(it.inputs.blocked, true);
      assert.equal(it.stream.settled, false);
      const [command] = it.stream.step(true, it.now);
      assert.deepEqual([command.x, command.turn], [0, 0]);
    });
  }

  test("can send neutral at once as its last command", () => {
    assert.equal(it.stream.neutral(it.now)[0].x, 0);
  });
});
