import assert from "node:assert/strict";
import { test } from "node:test";

import { hidingRules } from "../../../src/webmap/features/goals/goal_marks.js";

test("the goal layer hides a goal that the goal tool shows", () => {
  assert.equal(
    hidingRules(["r1"], []),
    '[data-robot="r1"] .posestamped.goal { display: none; }',
  );
});

test("the goal layer still hides an earlier goal of the goal tool, and only that one", () => {
  assert.equal(
    hidingRules([], [["r1", ["/goal_pose 3"]]]),
    '[data-robot="r1"] .posestamped.goal[data-pose="/goal_pose 3"] { display: none; }',
  );
  assert.equal(hidingRules([], []), "");
});
