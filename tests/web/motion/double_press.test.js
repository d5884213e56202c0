import assert from "node:assert/strict";
import { test } from "node:test";

import { LATEST, SOONEST, DoublePress } from "../../../src/webmap/web/motion/double_press.js";

test("one press is not enough", () => {
  const twice = new DoublePress();
  assert.equal(twice.press(0), false);
  assert.equal(twice.waiting(1), true);
});

test("a second press counts when it was neither too soon nor too late", () => {
  for (const at of [SOONEST, LATEST]) {
    const twice = new DoublePress();
    twice.press(0);
    assert.equal(twice.press(at), true);
    assert.equal(twice.waiting(at), false);
  }
});

test("a double click is one press, after which another still counts", () => {
  const twice = new DoublePress();
  twice.press(0);
  assert.equal(twice.press(SOONEST - 1), false);
  assert.equal(twice.press(SOONEST + 1), true);
});

test("a press after a long while is a first one again", () => {
  const twice = new DoublePress();
  twice.press(0);
  assert.equal(twice.press(LATEST + 1), false);
  assert.equal(twice.press(LATEST + 1 + SOONEST), true);
});

test("a first press can be forgotten", () => {
  const twice = new DoublePress();
  twice.press(0);
  twice.forget();
  assert.equal(twice.press(SOONEST), false);
});

test("a second press is said of what the first was said of", () => {
  const twice = new DoublePress();
  twice.press(0, ["r1"]);
  twice.look(["r1"]);
  assert.equal(twice.press(SOONEST, ["r1"]), true);
  assert.deepEqual(twice.meant, ["r1"]);
});

test("something new that the first press was not said of takes it back", () => {
  const twice = new DoublePress();
  twice.press(0, ["r1", "r2"]);
  twice.look(["r2"]);
  assert.equal(twice.waiting(1), true);
  twice.look(["r2", "r3"]);
  assert.equal(twice.waiting(1), false);
});
