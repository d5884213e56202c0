import assert from "node:assert/strict";
import { test } from "node:test";

import { aim, moved, onScreen } from "../../../src/webmap/web/tools/aim.js";
import { rotate } from "../../../src/webmap/web/view.js";

const VIEW = { a: 50, b: 0, c: 0, d: -50, e: 100, f: 200 };

function near(actual, expected) {
  assert.ok(Math.abs(actual - expected) < 1e-9, `${actual} is not near ${expected}`);
}

test("a press sets the position and a drag sets the heading", () => {
  const pose = aim(VIEW, { x: 200, y: 100 }, { x: 200, y: 40 }, null);
  near(pose.x, 2);
  near(pose.y, 2);
  near(pose.yaw, Math.PI / 2);
});

test("without a drag the heading is the direction from the robot to the goal", () => {
  const robot = { x: 2, y: 4, yaw: 1 };
  near(aim(VIEW, { x: 200, y: 100 }, { x: 203, y: 99 }, robot).yaw, -Math.PI / 2);
});

test("without a drag at the position of the robot the heading does not change", () => {
  const robot = { x: 2, y: 2, yaw: 1 };
  near(aim(VIEW, { x: 200, y: 100 }, { x: 200, y: 100 }, robot).yaw, 1);
});

test("an arrow points in the direction of the drag at any rotation of the view", () => {
  for (const degrees of [0, 30, 100, -160]) {
    const view = rotate(VIEW, degrees, 77, 33);
    const pose = aim(view, { x: 10, y: 20 }, { x: 110, y: 120 }, null);
    const arrow = onScreen(view, pose);
    near(arrow.x, 10);
    near(arrow.y, 20);
    near(arrow.degrees, 45);
  }
});

test("an arrow key moves the mark on the screen at any rotation of the view", () => {
  for (const degrees of [0, 30, -160]) {
    const view = rotate(VIEW, degrees, 77, 33);
    const pose = { x: 1, y: 2, yaw: 0.5 };
    const before = onScreen(view, pose);
    const after = onScreen(view, moved(view, pose, "ArrowUp", false));
    near(after.x, before.x);
    near(after.y, before.y - 10);
    near(after.degrees, before.degrees);
  }
});

test("Shift with an arrow key turns the mark, and other keys do nothing", () => {
  const pose = { x: 1, y: 2, yaw: Math.PI - 0.1 };
  const turned = moved(VIEW, pose, "ArrowLeft", true);
  near(turned.yaw, -Math.PI - 0.1 + Math.PI / 12);
  near(turned.x, 1);
  near(moved(VIEW, pose, "ArrowRight", true).yaw, pose.yaw - Math.PI / 12);
  near(moved(VIEW, pose, "ArrowUp", true).yaw, pose.yaw);
  assert.equal(moved(VIEW, pose, "w", false), null);
});
