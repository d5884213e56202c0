import assert from "node:assert/strict";
import test from "node:test";

import { Following } from "../../src/webmap/web/view.js";

const at = (x, y) => ({ x, y });

test("the view is not shifted without a followed element", () => {
  const following = new Following();
  following.settle(at(1, 2));
  assert.equal(following.shift(at(5, 5)), null);
});

test("the view is shifted by the movement of the element on the screen", () => {
  const following = new Following();
  following.start(7);
  following.settle(at(100, 50));
  assert.deepEqual(following.shift(at(103, 48)), at(-3, 2));
  assert.deepEqual(following.shift(at(101, 50)), at(-1, 0), "its place is the same");
});

test("a movement too small to see does not shift the view", () => {
  const following = new Following();
  following.start(7);
  following.settle(at(100, 50));
  assert.equal(following.shift(at(100.005, 50)), null);
});

test("an element that appears later keeps its first place on the screen", () => {
  const following = new Following();
  following.start(7);
  following.settle(null);
  assert.equal(following.shift(null), null);
  assert.equal(following.shift(at(10, 10)), null);
  assert.deepEqual(following.shift(at(12, 10)), at(-2, 0));
});

test("another change of the view gives the element a new place", () => {
  const following = new Following();
  following.start(7);
  following.settle(at(100, 50));
  following.settle(at(200, 50));
  assert.deepEqual(following.shift(at(201, 50)), at(-1, 0));
});

test("the view is not shifted after the following has ended", () => {
  const following = new Following();
  following.start(7);
  following.settle(at(100, 50));
  following.start(0);
  assert.equal(following.shift(at(150, 50)), null);
});
