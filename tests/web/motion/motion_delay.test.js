import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { MotionDelay } from "../../../src/webmap/web/motion/measurements.js";

const STILL = { robot: "r1", measured: [0, 0, 0] };
const GOING = { robot: "r1", measured: [0.1, 0, 0] };

let onset;

beforeEach(() => {
  onset = new MotionDelay();
  onset.report(STILL, 0);
});

test("the time to motion is measured from the first command with motion", () => {
  onset.sent("r1", false, 900);
  onset.sent("r1", true, 1000);
  onset.sent("r1", true, 1050);
  onset.report(STILL, 1100);
  assert.equal(onset.delay("r1"), null);
  onset.report(GOING, 1230);
  assert.equal(onset.delay("r1"), 230);
});

test("turning is also motion", () => {
  onset.sent("r1", true, 1000);
  onset.report({ robot: "r1", measured: [0, 0, -0.2] }, 1150);
  assert.equal(onset.delay("r1"), 150);
});

test("a robot that already moves gives no measurement", () => {
  onset.report(GOING, 500);
  onset.sent("r1", true, 1000);
  onset.report(GOING, 1100);
  assert.equal(onset.delay("r1"), null);
});

test("motion after the release or much later is not measured", () => {
  onset.sent("r1", true, 1000);
  onset.sent("r1", false, 1050);
  onset.report(GOING, 1100);
  onset.report(STILL, 1200);
  onset.sent("r1", true, 2000);
  onset.report(GOING, 9000);
  assert.equal(onset.delay("r1"), null);
});

test("motion of another robot and missing odometry give no measurement", () => {
  onset.sent("r1", true, 1000);
  onset.report({ ...GOING, robot: "r2" }, 1100);
  onset.report({ robot: "r1", measured: null }, 1150);
  assert.equal(onset.delay("r1"), null);
  assert.equal(onset.delay("r2"), null);
});

test("the measurement of a removed robot is deleted", () => {
  onset.sent("r1", true, 1000);
  onset.report(GOING, 1230);
  onset.gone("r1");
  assert.equal(onset.delay("r1"), null);
});
