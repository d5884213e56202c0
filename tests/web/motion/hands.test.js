import assert from "node:assert/strict";
import { test } from "node:test";

import { NEUTRAL, clean } from "../../../src/webmap/web/motion/axes.js";
import { Hands, REST } from "../../../src/webmap/web/motion/hands.js";

const FORWARD = { x: 1, y: 0, turn: 0 };
const LEFT = { x: 0, y: 0, turn: 1 };

/** Hands that had been neutral long enough before time 0. */
function rested() {
  return new Hands(-REST);
}

test("a press after rest acts", () => {
  const hands = rested();
  hands.set("keys", FORWARD, 0);
  assert.deepEqual(hands.axes, FORWARD);
});

test("a press on a page that was just made does nothing, however long it is held", () => {
  const hands = new Hands(0);
  hands.set("keys", FORWARD, REST - 1);
  hands.set("keys", LEFT, 10_000);
  assert.deepEqual(hands.axes, NEUTRAL);
});

test("the operator may press again at once after a release", () => {
  const hands = rested();
  hands.set("keys", FORWARD, 0);
  hands.set("keys", null, 10);
  hands.set("keys", LEFT, 11);
  assert.deepEqual(hands.axes, LEFT);
});

test("after a doubt what is held does nothing until rest and a new press", () => {
  const hands = rested();
  hands.set("keys", FORWARD, 0);
  hands.kill(100);
  hands.set("keys", LEFT, 1000);
  assert.deepEqual(hands.axes, NEUTRAL);
  hands.set("keys", null, 2000);
  hands.set("keys", FORWARD, 2000 + REST - 1);
  assert.deepEqual(hands.axes, NEUTRAL, "pressed too soon");
  hands.set("keys", null, 3000);
  hands.set("keys", FORWARD, 3000 + REST);
  assert.deepEqual(hands.axes, FORWARD);
});

test("rest is counted from the last doubt, not only from the last release", () => {
  const hands = rested();
  hands.kill(0);
  hands.kill(500);
  hands.set("keys", FORWARD, 500 + REST - 1);
  assert.deepEqual(hands.axes, NEUTRAL);
});

test("the first input owns the motion, and another must be let go of first", () => {
  const hands = rested();
  hands.set("keys", FORWARD, 0);
  hands.set("stick", LEFT, 10);
  assert.deepEqual(hands.axes, FORWARD);
  hands.set("keys", null, 20);
  assert.deepEqual(hands.axes, NEUTRAL, "the stick was pressed while the keys drove");
  hands.set("stick", null, 30);
  hands.set("stick", LEFT, 40);
  assert.deepEqual(hands.axes, LEFT);
});

test("what is dropped is forgotten and asks for a new press", () => {
  const hands = rested();
  hands.set("keys", FORWARD, 0);
  hands.drop(10);
  assert.equal(hands.pressed, false);
  assert.deepEqual(hands.axes, NEUTRAL);
  hands.set("keys", FORWARD, 10 + REST);
  assert.deepEqual(hands.axes, FORWARD);
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
  const hands = rested();
  hands.set("keys", FORWARD, 0, { fresh: false });
  assert.equal(hands.pressed, true);
  hands.set("keys", LEFT, 10_000);
  assert.deepEqual(hands.axes, NEUTRAL);
  hands.set("keys", null, 10_001);
  hands.set("keys", FORWARD, 10_001 + REST);
  assert.deepEqual(hands.axes, FORWARD);
});

test("a key that was not heard ends what its keyboard asked for until then", () => {
  const hands = rested();
  hands.set("keys", LEFT, 0);
  hands.set("keys", { x: 1, y: 0, turn: 1 }, 100, { fresh: false });
  assert.deepEqual(hands.axes, NEUTRAL);
});
