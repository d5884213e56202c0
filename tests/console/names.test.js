import assert from "node:assert/strict";
import { test } from "node:test";

import { roomFor } from "../../src/webmap/console/console.js";

const name = (x, y, first = false) => ({ x, y, width: 60, first });

test("names that do not overlap are all shown", () => {
  assert.deepEqual(roomFor([name(0, 0), name(70, 0), name(0, 20)]), [true, true, true]);
});

test("of two names that overlap the first is shown", () => {
  assert.deepEqual(roomFor([name(0, 0), name(10, 5)]), [true, false]);
});

test("the name of the selected robot is shown even with an overlap", () => {
  assert.deepEqual(roomFor([name(0, 0), name(10, 5, true)]), [false, true]);
});

test("a name that is not shown takes no room from others", () => {
  assert.deepEqual(roomFor([name(0, 0), name(50, 0), name(100, 0)]), [true, false, true]);
});

test("an empty list of names gives an empty list", () => {
  assert.deepEqual(roomFor([]), []);
});
