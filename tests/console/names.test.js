import assert from "node:assert/strict";
import { test } from "node:test";

import { roomFor } from "../../src/webmap/console/console.js";

const name = (x, y, first = false) => ({ x, y, width: 60, first });

test("names that are apart are all shown", () => {
  assert.deepEqual(roomFor([name(0, 0), name(70, 0), name(0, 20)]), [true, true, true]);
});

test("of two names that would cover one another the first is shown", () => {
  assert.deepEqual(roomFor([name(0, 0), name(10, 5)]), [true, false]);
});

test("the selected robot has its name whatever is in its way", () => {
  assert.deepEqual(roomFor([name(0, 0), name(10, 5, true)]), [false, true]);
});

test("a name that is left out takes no room from others", () => {
  assert.deepEqual(roomFor([name(0, 0), name(50, 0), name(100, 0)]), [true, false, true]);
});

test("no names need no room", () => {
  assert.deepEqual(roomFor([]), []);
});
