import assert from "node:assert/strict";
import { test } from "node:test";

import { FakeElement } from "../../web/tools/fake_elements.js";
import { GroundMark } from "../../../src/webmap/features/goals/goal_marks.js";
import { assign, formation } from "../../../src/webmap/features/goals/goal_tool.js";
import { look, ShownGoals } from "../../../src/webmap/web/tools/goals.js";

function goal(state, more = {}) {
  const silent = { left: null, time: null, eta: null, recoveries: null };
  return { id: "g1", x: 0, y: 0, yaw: 0, state, why: "", ...silent, ...more };
}

function near(one, other) {
  assert.ok(Math.hypot(one.x - other.x, one.y - other.y) < 1e-9, JSON.stringify(one));
}

test("the text of a goal shows its state and the progress of the robot", () => {
  const progress = { left: 3.24, eta: 75, recoveries: 2 };
  assert.equal(
    look(goal("under way", progress)).text,
    "Navigating to goal, 3.2 m to go, about 75 s left, 2 recoveries",
  );
  assert.equal(look(goal("under way", { left: 12.3, eta: 150 })).text, "Navigating to goal, 12 m to go, about 3 min left");
  assert.equal(look(goal("failed", { why: "no path" })).text, "Goal failed, no path");
  assert.equal(look(goal("failed")).over, true);
  assert.equal(look(goal("unknown")).over, false);
  assert.equal(look(goal("sent")).shape, "sent");
});

test("an ended goal is hidden after a while, a failed goal stays", () => {
  for (const [state, stays] of [["reached", false], ["cancelled", false], ["failed", true]]) {
    const shown = new ShownGoals();
    shown.report("r1", goal("under way"), 0);
    shown.report("r1", goal(state), 1000);
    assert.equal(shown.shown(4000).size, 1);
    shown.report("r1", goal(state), 5000);
    assert.equal(shown.shown(6000).size, stays ? 1 : 0, state);
    shown.dismiss("r1");
    assert.equal(shown.shown(6000).size, 0);
    shown.report("r1", goal("sent", { id: "g2" }), 7000);
    assert.equal(shown.shown(7000).size, 1, "the next goal is shown");
  }
});

test("a goal that already ended when the page opened is not shown", () => {
  const shown = new ShownGoals();
  shown.report("r1", goal("failed"), 0);
  assert.equal(shown.shown(0).size, 0);
  shown.report("r1", null, 1);
  shown.gone("r1");
  shown.dismiss("r1");
  shown.report("r1", goal("failed"), 2);
  assert.equal(shown.shown(2).size, 0, "not shown after the robot was gone either");
});

test("a goal that starts and ends between two reports is shown", () => {
  const shown = new ShownGoals();
  shown.report("r1", null, 0);
  shown.report("r1", goal("failed"), 1);
  assert.equal(shown.shown(6000).size, 1, "the robot had no goal before");
  shown.report("r1", goal("reached", { id: "g2" }), 7000);
  assert.equal(shown.shown(7000).size, 1, "the robot had another goal before");
  shown.report("r1", goal("reached", { id: "g2" }), 12_000);
  assert.equal(shown.shown(12_000).size, 0);
});

test("one robot goes to the pose, two robots go to its left and right", () => {
  const pose = { x: 1, y: 2, yaw: Math.PI / 2 };
  assert.deepEqual(formation(pose, 1, 1), [{ x: 1, y: 2, yaw: Math.PI / 2 }]);
  const [left, right] = formation(pose, 2, 1);
  near(left, { x: 0.5, y: 2 });
  near(right, { x: 1.5, y: 2 });
});

test("goals of many robots are at least the spacing apart", () => {
  for (const count of [3, 5, 7, 12, 20]) {
    const places = formation({ x: 0, y: 0, yaw: 0.3 }, count, 1.5);
    assert.equal(places.length, count);
    for (const [i, a] of places.entries()) {
      for (const b of places.slice(i + 1)) {
        assert.ok(Math.hypot(a.x - b.x, a.y - b.y) > 1.5 - 1e-9, `${count} robots`);
      }
    }
  }
});

test("robots are assigned to goals so that no paths cross", () => {
  let seed = 1;
  const random = () => ((seed = (seed * 48271) % 2147483647), seed / 2147483647);
  const turn = (a, b, c) => (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  for (let round = 0; round < 50; round++) {
    const robots = Array.from({ length: 8 }, () => ({ x: 10 * random(), y: 10 * random() }));
    const goals = assign(robots, formation({ x: 5, y: 5, yaw: 6 * random() }, 8, 1));
    assert.equal(new Set(goals).size, 8);
    for (let i = 0; i < 8; i++) {
      for (let j = i + 1; j < 8; j++) {
        const [a, b, c, d] = [robots[i], goals[i], robots[j], goals[j]];
        const crosses =
          turn(a, b, c) * turn(a, b, d) < -1e-9 && turn(c, d, a) * turn(c, d, b) < -1e-9;
        assert.equal(crosses, false);
      }
    }
  }
});

/** A mark on a map without a layout, the places it asked for, and its clock. */
function groundMark() {
  const asked = [];
  const at = { now: 0 };
  const view = { a: 50, b: 0, c: 0, d: -50, e: 0, f: 0 };
  globalThis.ResizeObserver = class {
    observe() {}
  };
  const map = { svg: new FakeElement(), view, onView: () => () => {} };
  const mark = new GroundMark(map, (place) => asked.push(place), () => at.now);
  return { mark, asked, at };
}

test("one place is asked for at a time, then the newest", () => {
  const { mark, asked, at } = groundMark();
  for (const x of [1, 2, 3]) mark.show({ x, y: 0 });
  assert.deepEqual(asked, [{ x: 1, y: 0 }]);
  mark.hear({ x: 1, y: 0, word: "free" });
  assert.deepEqual(asked.at(-1), { x: 3, y: 0 });
  mark.hear({ x: 1, y: 0, word: "wall" });
  assert.equal(mark.word, "free", "a late answer is ignored");
  mark.hear({ x: 3, y: 0, word: "wall" });
  assert.equal(mark.word, "wall");
  assert.equal(asked.length, 2, "a known place is not asked for again");
  mark.show({ x: 9, y: 0 });
  at.now = 400;
  mark.show({ x: 9, y: 1 });
  assert.equal(mark.word, "", "the word of another place does not stay");
  at.now = 2000;
  mark.show({ x: 9, y: 2 });
  assert.deepEqual(asked.at(-1), { x: 9, y: 2 }, "a lost answer is not waited for");
});

test("the next place is asked for while the last answer is on its way", () => {
  const { mark, asked } = groundMark();
  mark.show({ x: 1, y: 0 });
  mark.show(null);
  mark.show({ x: 2, y: 0 }, "Robot 2");
  assert.deepEqual(asked.at(-1), { x: 2, y: 0 });
  mark.hear({ x: 1, y: 0, word: "wall" });
  mark.hear({ x: 2, y: 0, word: "free" });
  assert.equal(mark.word, "free");
});

test("where no map is, no word is shown, and the place is not asked for again", () => {
  const { mark, asked } = groundMark();
  mark.show({ x: 1, y: 0 });
  mark.hear({ x: 1, y: 0, word: null });
  assert.equal(mark.word, "");
  assert.equal(asked.length, 1);
  mark.hear({ x: 1, y: 0, word: "free" });
  mark.show(null);
  assert.equal(mark.word, "");
});
