import assert from "node:assert/strict";
import { test } from "node:test";

import { LATEST, SOONEST, DoublePress } from "../../../src/webmap/web/tools/elements.js";

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

test("a double click counts as one press, and a later press as the second", () => {
  const twice = new DoublePress();
  twice.press(0);
  assert.equal(twice.press(SOONEST - 1), false);
  assert.equal(twice.press(SOONEST + 1), true);
});

test("a press after a long time is a first press again", () => {
  const twice = new DoublePress();
  twice.press(0);
  assert.equal(twice.press(LATEST + 1), false);
  assert.equal(twice.press(LATEST + 1 + SOONEST), true);
});

test("a first press can be cancelled", () => {
  const twice = new DoublePress();
  twice.press(0);
  twice.forget();
  assert.equal(twice.press(SOONEST), false);
});

test("a second press applies to the robots of the first press", () => {
  const twice = new DoublePress();
  twice.press(0, ["r1"]);
  twice.look(["r1"]);
  assert.equal(twice.press(SOONEST, ["r1"]), true);
  assert.deepEqual(twice.meant, ["r1"]);
});

test("a new robot cancels the first press", () => {
  const twice = new DoublePress();
  twice.press(0, ["r1", "r2"]);
  twice.look(["r2"]);
  assert.equal(twice.waiting(1), true);
  twice.look(["r2", "r3"]);
  assert.equal(twice.waiting(1), false);
});
