import assert from "node:assert/strict";
import test from "node:test";

import { DisplayClock } from "../../src/webmap/web/ages.js";

test("the clock is unknown before the first frame", () => {
  assert.equal(new DisplayClock().at(5), null);
});

test("a late frame does not set the clock back", () => {
  const clock = new DisplayClock();
  clock.update(100, 10.01);
  clock.update(101, 14);
  assert.ok(Math.abs(clock.at(14) - 103.99) < 1e-3);
});

test("a faster frame corrects the clock", () => {
  const clock = new DisplayClock();
  clock.update(100, 12);
  clock.update(101, 11.05);
  assert.ok(Math.abs(clock.at(12.05) - 102) < 1e-9);
});

test("the clock follows a slow drift", () => {
  const clock = new DisplayClock();
  for (let s = 0; s < 10_000; s++) clock.update(s, s * 1.00005 + 0.01);
  assert.ok(Math.abs(clock.at(9999 * 1.00005) - 9999) < 0.1);
});

test("after a reset the clock follows another display", () => {
  const clock = new DisplayClock();
  clock.update(1000, 1);
  clock.reset();
  clock.update(5, 2);
  assert.equal(clock.at(3), 6);
});
