import assert from "node:assert/strict";
import { test } from "node:test";

import { NEUTRAL, clean } from "../../../src/webmap/web/motion/axes.js";
import { Inputs, REST } from "../../../src/webmap/web/motion/inputs.js";

const FORWARD = { x: 1, y: 0, turn: 0 };
const LEFT = { x: 0, y: 0, turn: 1 };

/** Inputs that had been neutral long enough before time 0. */
function rested() {
  return new Inputs(-REST);
}

test("a press after rest acts", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  assert.deepEqual(inputs.axes, FORWARD);
});

test("a press on a page that was just made does nothing, however long it is held", () => {
  const inputs = new Inputs(0);
  inputs.set("keys", FORWARD, REST - 1);
  inputs.set("keys", LEFT, 10_000);
  assert.deepEqual(inputs.axes, NEUTRAL);
});

test("the operator may press again at once after a release", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  inputs.set("keys", null, 10);
  inputs.set("keys", LEFT, 11);
  assert.deepEqual(inputs.axes, LEFT);
});

test("after a doubt what is held does nothing until rest and a new press", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  inputs.block(100);
  inputs.set("keys", LEFT, 1000);
  assert.deepEqual(inputs.axes, NEUTRAL);
  inputs.set("keys", null, 2000);
  inputs.set("keys", FORWARD, 2000 + REST - 1);
  assert.deepEqual(inputs.axes, NEUTRAL, "pressed too soon");
  inputs.set("keys", null, 3000);
  inputs.set("keys", FORWARD, 3000 + REST);
  assert.deepEqual(inputs.axes, FORWARD);
});

test("rest is counted from the last doubt, not only from the last release", () => {
  const inputs = rested();
  inputs.block(0);
  inputs.block(500);
  inputs.set("keys", FORWARD, 500 + REST - 1);
  assert.deepEqual(inputs.axes, NEUTRAL);
});

test("the first input owns the motion, and another must be let go of first", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  inputs.set("stick", LEFT, 10);
  assert.deepEqual(inputs.axes, FORWARD);
  inputs.set("keys", null, 20);
  assert.deepEqual(inputs.axes, NEUTRAL, "the stick was pressed while the keys drove");
  inputs.set("stick", null, 30);
  inputs.set("stick", LEFT, 40);
  assert.deepEqual(inputs.axes, LEFT);
});

test("what is dropped is forgotten and asks for a new press", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  inputs.drop(10);
  assert.equal(inputs.pressed, false);
  assert.deepEqual(inputs.axes, NEUTRAL);
  inputs.set("keys", FORWARD, 10 + REST);
  assert.deepEqual(inputs.axes, FORWARD);
});

test("axes that are no numbers are neutral, all of them", () => {
  for (const x of [NaN, Infinity, "1", {}, true]) {
    assert.deepEqual(clean({ x: /** @type {any} */ (x), turn: 1 }), NEUTRAL);
  }
});

test("axes beyond one are one", () => {
  assert.deepEqual(clean({ x: 7, turn: -7 }), { x: 1, y: 0, turn: -1 });
});

test("what was pressed before it could be heard does nothing until it is released", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0, { fresh: false });
  assert.equal(inputs.pressed, true);
  inputs.set("keys", LEFT, 10_000);
  assert.deepEqual(inputs.axes, NEUTRAL);
  inputs.set("keys", null, 10_001);
  inputs.set("keys", FORWARD, 10_001 + REST);
  assert.deepEqual(inputs.axes, FORWARD);
});

test("a key that was not heard ends what its keyboard asked for until then", () => {
  const inputs = rested();
  inputs.set("keys", LEFT, 0);
  inputs.set("keys", { x: 1, y: 0, turn: 1 }, 100, { fresh: false });
  assert.deepEqual(inputs.axes, NEUTRAL);
});
