import assert from "node:assert/strict";
import { test } from "node:test";

import { matching } from "../../src/webmap/console/palette.js";

const ENTRIES = [
  ["Robot", "Robot 1"],
  ["Robot", "Stopgap"],
  ["Selected robot", "Stop test: take control"],
  ["STOP", "STOP Robot 1"],
  ["STOP", "STOP ALL"],
  ["All robots", "Reset all"],
].map(([kind, name]) => ({ kind, name, act: () => {} }));

const found = (text) => matching(ENTRIES, text).map(({ name }) => name);

test("without a text the first line is no command", () => {
  assert.equal(found("")[0], "Robot 1");
});

test("the word stop finds STOP before everything that begins with it", () => {
  assert.deepEqual(found("stop").slice(0, 3), ["STOP Robot 1", "STOP ALL", "Stopgap"]);
  assert.deepEqual(found("stop all"), ["STOP ALL"]);
});

test("the name of a robot finds the robot before its STOP", () => {
  assert.deepEqual(found("robot 1"), ["Robot 1", "STOP Robot 1"]);
});
