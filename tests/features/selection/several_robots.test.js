import assert from "node:assert/strict";
import { test } from "node:test";

import { inBox } from "../../../src/webmap/features/selection/several_robots.js";

test("a box has the robots between its corners, in whichever order they were set", () => {
  /** @type {[string, {x: number, y: number}][]} */
  const places = [
    ["a", { x: 10, y: 10 }],
    ["b", { x: 50, y: 20 }],
    ["c", { x: 51, y: 20 }],
  ];
  assert.deepEqual(inBox(places, { x: 0, y: 0 }, { x: 50, y: 20 }), ["a", "b"]);
  assert.deepEqual(inBox(places, { x: 50, y: 20 }, { x: 0, y: 0 }), ["a", "b"]);
  assert.deepEqual(inBox(places, { x: 60, y: 0 }, { x: 20, y: 30 }), ["b", "c"]);
  assert.deepEqual(inBox([], { x: 0, y: 0 }, { x: 9, y: 9 }), []);
});
