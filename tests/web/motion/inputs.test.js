import assert from "node:assert/strict";
import { test } from "node:test";

import { NEUTRAL, REST, Inputs, clean } from "../../../src/webmap/web/motion/inputs.js";

const FORWARD = { x: 1, y: 0, turn: 0 };
const LEFT = { x: 0, y: 0, turn: 1 };

/** Inputs that were neutral long enough before time 0. */
function rested() {
  return new Inputs(-REST);
}

test("a press after the rest time is accepted", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  assert.deepEqual(inputs.axes, FORWARD);
});

test("a press before the rest time of a new page does nothing, even if held for long", () => {
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

test("after an input block a held key does nothing until a rest and a new press", () => {
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

test("the rest time counts from the last input block, not only from the last release", () => {
  const inputs = rested();
  inputs.block(0);
  inputs.block(500);
  inputs.set("keys", FORWARD, 500 + REST - 1);
  assert.deepEqual(inputs.axes, NEUTRAL);
});

test("the first input drives, and a second one must be released and pressed again", () => {
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

test("a dropped input is neutral until a new press", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  inputs.drop(10);
  assert.equal(inputs.pressed, false);
  assert.deepEqual(inputs.axes, NEUTRAL);
  inputs.set("keys", FORWARD, 10 + REST);
  assert.deepEqual(inputs.axes, FORWARD);
});

test("one axis that is not a number makes all axes neutral", () => {
  for (const x of [NaN, Infinity, "1", {}, true]) {
    assert.deepEqual(clean({ x: /** @type {any} */ (x), turn: 1 }), NEUTRAL);
  }
});

test("axes are limited to one", () => {
  assert.deepEqual(clean({ x: 7, turn: -7 }), { x: 1, y: 0, turn: -1 });
});

test("an input pressed before the page listened does nothing until released", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0, { fresh: false });
  assert.equal(inputs.pressed, true);
  inputs.set("keys", LEFT, 10_000);
  assert.deepEqual(inputs.axes, NEUTRAL);
  inputs.set("keys", null, 10_001);
  inputs.set("keys", FORWARD, 10_001 + REST);
  assert.deepEqual(inputs.axes, FORWARD);
});

test("a key whose press the page did not see makes the keyboard neutral", () => {
  const inputs = rested();
  inputs.set("keys", LEFT, 0);
  inputs.set("keys", { x: 1, y: 0, turn: 1 }, 100, { fresh: false });
  assert.deepEqual(inputs.axes, NEUTRAL);
});

test("an input that was held when the page froze is remembered until its release or a press", () => {
  const inputs = rested();
  inputs.set("keys", FORWARD, 0);
  inputs.drop(10);
  assert.equal(inputs.frozen, false);
  inputs.set("keys", FORWARD, 10 + REST);
  inputs.drop(300, { frozen: true });
  assert.deepEqual([inputs.frozen, inputs.pressed, inputs.blocked], [true, false, true]);
  inputs.drop(310);
  inputs.set("stick", null, 320);
  assert.equal(inputs.frozen, true);
  inputs.set("keys", null, 330);
  assert.equal(inputs.frozen, false);
  inputs.set("keys", FORWARD, 1000);
  inputs.drop(1100, { frozen: true });
  inputs.set("stick", LEFT, 1100 + REST);
  assert.deepEqual([inputs.frozen, inputs.blocked], [false, false]);
});
