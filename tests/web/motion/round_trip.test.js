import assert from "node:assert/strict";
import { test } from "node:test";

import { LATE, LOST, RoundTrip } from "../../../src/webmap/web/motion/round_trips.js";

function opened() {
  const loop = new RoundTrip();
  loop.open(0);
  loop.receive(100, -1, 0);
  return loop;
}

test("a loop with ticks is open", () => {
  const loop = opened();
  for (let now = 0; now < 2000; now += 50) {
    loop.receive(100 + now, -1, now);
    assert.equal(loop.state(now + 49), "open");
  }
});

test("a loop without ticks is late, then lost", () => {
  const loop = opened();
  assert.equal(loop.state(LATE), "open");
  assert.equal(loop.state(LATE + 1), "late");
  assert.equal(loop.state(LOST + 1), "lost");
});

test("a loop with ticks but without acknowledgements is late", () => {
  const loop = opened();
  loop.sent(0, 1000);
  loop.receive(101, -1, 1000 + LATE);
  assert.equal(loop.state(1000 + LATE), "open");
  assert.equal(loop.state(1000 + LATE + 1), "late");
  loop.receive(102, 0, 1000 + LATE + 10);
  assert.equal(loop.state(1000 + LATE + 10), "open");
});

test("an acknowledgement includes every earlier command", () => {
  const loop = opened();
  loop.sent(0, 0);
  loop.sent(1, 50);
  loop.sent(2, 100);
  loop.receive(101, 1, 120);
  assert.equal(loop.delay, 70);
  assert.equal(loop.age(120), 20);
  assert.equal(loop.acknowledged(1), true);
  assert.equal(loop.acknowledged(2), false);
});

test("an old acknowledgement changes nothing", () => {
  const loop = opened();
  loop.sent(0, 0);
  loop.receive(101, 0, 10);
  loop.receive(102, -1, 20);
  assert.equal(loop.acknowledged(0), true);
});

test("a clock that is set back does not keep a silent loop open", () => {
  const loop = opened();
  loop.receive(101, -1, 3_600_000);
  assert.notEqual(loop.state(0), "open");
});

test("the age of a loop is that of its oldest command without acknowledgement", () => {
  const loop = opened();
  for (let seq = 0; seq < 1000; seq++) loop.sent(seq, seq * 50);
  assert.equal(loop.age(50_000), 50_000);
});

test("a loop of a page that may not drive waits longer for its ticks", () => {
  const loop = opened();
  loop.pause = 500;
  assert.equal(loop.state(LATE + 450), "open");
  assert.equal(loop.state(LATE + 451), "late");
  assert.equal(loop.state(LOST + 450), "late");
  assert.equal(loop.state(LOST + 451), "lost");
});
