import assert from "node:assert/strict";
import { test } from "node:test";

import { hidden } from "../../../src/webmap/features/goals/goal_marks.js";

test("a goal that the goal tool shows is not drawn a second time", () => {
  assert.equal(
    hidden(["r1"], []),
    '[data-robot="r1"] .posestamped.goal { display: none; }',
  );
});

test("what the goal tool has shown stays hidden, and the next one is not", () => {
  assert.equal(
    hidden([], [["r1", ["/goal_pose 3"]]]),
    '[data-robot="r1"] .posestamped.goal[data-pose="/goal_pose 3"] { display: none; }',
  );
  assert.equal(hidden([], []), "");
});
