import assert from "node:assert/strict";
import { test } from "node:test";

import { aim, onScreen } from "../../../src/webmap/web/tools/aim.js";
import { rotate } from "../../../src/webmap/web/view.js";

const VIEW = { a: 50, b: 0, c: 0, d: -50, e: 100, f: 200 };

function near(actual, expected) {
  assert.ok(Math.abs(actual - expected) < 1e-9, `${actual} is not near ${expected}`);
}

test("a press says the place and a drag the heading", () => {
  const pose = aim(VIEW, { x: 200, y: 100 }, { x: 200, y: 40 }, null);
  near(pose.x, 2);
  near(pose.y, 2);
  near(pose.yaw, Math.PI / 2);
});

test("without a drag the robot looks the way it comes", () => {
  const robot = { x: 2, y: 4, yaw: 1 };
  near(aim(VIEW, { x: 200, y: 100 }, { x: 203, y: 99 }, robot).yaw, -Math.PI / 2);
});

test("without a drag, where the robot stands already, it stays turned as it is", () => {
  const robot = { x: 2, y: 2, yaw: 1 };
  near(aim(VIEW, { x: 200, y: 100 }, { x: 200, y: 100 }, robot).yaw, 1);
});

test("an arrow points where it was dragged to, however the view is turned", () => {
  for (const degrees of [0, 30, 100, -160]) {
    const view = rotate(VIEW, degrees, 77, 33);
    const pose = aim(view, { x: 10, y: 20 }, { x: 110, y: 120 }, null);
    const arrow = onScreen(view, pose);
    near(arrow.x, 10);
    near(arrow.y, 20);
    near(arrow.degrees, 45);
  }
});
