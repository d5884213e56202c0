import assert from "node:assert/strict";
import { test } from "node:test";

import { DEAD_ZONE, beyondDeadZone, axesOfStick } from "../../../src/webmap/web/inputs/sticks.js";

const near = (axes, x, y, turn) => {
  for (const [value, expected] of [[axes.x, x], [axes.y, y], [axes.turn, turn]]) {
    assert.ok(Math.abs(value - expected) < 1e-9, JSON.stringify(axes));
  }
};

test("up drives forward, down drives backward, left and right turn on the spot", () => {
  near(axesOfStick(0, -1), 1, 0, 0);
  near(axesOfStick(0, 1), -1, 0, 0);
  near(axesOfStick(-1, 0), 0, 0, 1);
  near(axesOfStick(1, 0), 0, 0, -1);
});

test("in sideways mode left and right move sideways and do not turn", () => {
  near(axesOfStick(-1, 0, { sideways: true }), 0, 1, 0);
  near(axesOfStick(1, 0, { sideways: true }), 0, -1, 0);
});

test("a movement inside the dead zone does nothing", () => {
  near(axesOfStick(DEAD_ZONE, -DEAD_ZONE), 0, 0, 0);
  assert.equal(axesOfStick(DEAD_ZONE, -0.9).turn, 0);
});

test("beyond the dead zone the output goes from zero to one", () => {
  assert.ok(beyondDeadZone(DEAD_ZONE + 0.001) < 0.01);
  assert.equal(beyondDeadZone(1), 1);
  assert.equal(beyondDeadZone(-1), -1);
});

test("a pull beyond the edge keeps its direction and has the maximum size", () => {
  assert.deepEqual(axesOfStick(30, -40), axesOfStick(0.6, -0.8));
});
