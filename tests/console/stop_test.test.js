import assert from "node:assert/strict";
import { test } from "node:test";

import { StopTestButton } from "../../src/webmap/console/side_panel.js";

/** A drive with one robot, and the requests that it received. */
function driveWith(report) {
  const asked = [];
  const robots = new Map([["r1", { robot: "r1", mine: true, ...report }]]);
  return { asked, robots, stopTest: (robot) => asked.push(robot) };
}

test("two separate presses start the stop test of a robot", () => {
  const drive = driveWith({});
  const button = new StopTestButton(drive);
  assert.equal(button.state("r1", 0), "ready");
  button.press("r1", 0);
  assert.equal(button.state("r1", 100), "asking");
  assert.deepEqual(drive.asked, []);
  button.press("r1", 500);
  assert.deepEqual(drive.asked, ["r1"]);
  assert.equal(button.state("r1", 600), "ready");
});

test("a double click and a press long after the first start no stop test", () => {
  const drive = driveWith({});
  const button = new StopTestButton(drive);
  button.press("r1", 0);
  button.press("r1", 100);
  button.press("r1", 4500);
  assert.deepEqual(drive.asked, []);
});

test("a press on another robot does not count as the second press", () => {
  const drive = driveWith({});
  drive.robots.set("r2", { robot: "r2", mine: true });
  const button = new StopTestButton(drive);
  button.press("r1", 0);
  button.press("r2", 500);
  assert.deepEqual(drive.asked, []);
});

test("a robot with a stated or tested command timeout can be tested again", () => {
  for (const known of [
    { stop_time: 0.25, stop_source: "stated" },
    { stop_time: 0.3, stop_source: "tested", test: { state: "done", text: "" } },
  ]) {
    const drive = driveWith(known);
    const button = new StopTestButton(drive);
    button.press("r1", 0);
    button.press("r1", 500);
    assert.deepEqual(drive.asked, ["r1"]);
  }
});

test("a page without control of the robot starts no stop test", () => {
  const drive = driveWith({ mine: false });
  const button = new StopTestButton(drive);
  assert.equal(button.state("r1", 0), "take");
  button.press("r1", 0);
  button.press("r1", 500);
  assert.deepEqual(drive.asked, []);
});

test("a running stop test is shown, and an unknown robot has no stop test", () => {
  const drive = driveWith({ test: { state: "waiting", text: "" } });
  const button = new StopTestButton(drive);
  assert.equal(button.state("r1", 0), "running");
  assert.equal(button.state("r9", 0), "none");
  assert.equal(button.state(null, 0), "none");
});
