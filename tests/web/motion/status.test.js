import assert from "node:assert/strict";
import { test } from "node:test";

import { doingOf } from "../../../src/webmap/web/motion/report.js";
import { capOf, describe, sentence } from "../../../src/webmap/web/motion/status.js";

const STATUS = {
  link: "open",
  choice: "r1",
  report: null,
  driven: null,
  taking: false,
  settled: false,
  pressed: false,
  frozen: false,
  blocked: false,
  axes: { x: 0, y: 0, turn: 0 },
  refusal: null,
  delay: 20,
};
const REPORT = {
  robot: "r1",
  name: "Bob",
  state: "free",
  doing: "free",
  holder: null,
  mine: false,
  epoch: null,
  armed: false,
  v: 0.3,
  w: 0.6,
  why: [],
  link: "up",
  sent: [0, 0, 0],
  echoed: null,
  measured: [0, 0, 0],
  armable: true,
  reason: null,
};
const ME = {
  holder: { connection: "c1", name: "me" },
  mine: true,
  epoch: 3,
  state: "held",
  doing: "held",
};
const DRIVING = { state: "driving", doing: "driven" };
const ANN = { connection: "c2", name: "Ann" };

const cases = [
  ["connecting", { link: "connecting" }, REPORT],
  ["lost", { link: "lost", driven: "r1" }, { ...REPORT, ...ME, ...DRIVING }],
  ["late", { link: "late", driven: "r1" }, { ...REPORT, ...ME, ...DRIVING }],
  ["fixed", {}, null],
  ["free", {}, REPORT],
  ["fixed", {}, { ...REPORT, armable: false, doing: "barred", reason: "no link" }],
  ["held", {}, { ...REPORT, holder: ANN, ...DRIVING }],
  ["hands-off", { pressed: true, blocked: true }, REPORT],
  ["hands-off", { pressed: true, blocked: true }, { ...REPORT, doing: "moving" }],
  ["taking", { taking: true }, REPORT],
  ["taking", { driven: "r1" }, { ...REPORT, ...ME }],
  ["ready", { driven: "r1", settled: true }, { ...REPORT, ...ME }],
  ["driving", { driven: "r1", settled: true }, { ...REPORT, ...ME, ...DRIVING }],
  [
    "blocked",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, ...DRIVING, doing: "blocked" },
  ],
  [
    "stopping",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, state: "stopping", doing: "stopping" },
  ],
  [
    "stopping",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, doing: "settling" },
  ],
  [
    "moving",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, doing: "navigating_held" },
  ],
  ["moving", {}, { ...REPORT, doing: "navigating" }],
  ["moving", {}, { ...REPORT, doing: "moving" }],
  ["moving", {}, { ...REPORT, doing: "other" }],
  ["hands-off", { driven: "r1", pressed: true, blocked: true }, { ...REPORT, ...ME }],
  [
    "fixed",
    { driven: "r1" },
    { ...REPORT, ...ME, doing: "barred_held", reason: "no odometry for 1 s" },
  ],
  ["stopped", {}, { ...REPORT, state: "stopped", doing: "stopped" }],
];

for (const [state, status, report] of cases) {
  const { doing = null } = report ?? {};
  const text = JSON.stringify({ ...status, doing });
  test(`${text} is shown as ${state}`, () => {
    const description = describe({ ...STATUS, ...status }, "r1", report, true);
    assert.equal(description.state, state);
    assert.notEqual(description.title, "");
  });
}

test("without a selected robot the state is none", () => {
  assert.equal(describe(STATUS, null, null, true).state, "none");
});

test("the title names the operator", () => {
  const title = (more) =>
    describe(STATUS, "r1", { ...REPORT, holder: ANN, ...more }, true).title;
  assert.equal(title({ doing: "held" }), "Ann has control");
  assert.equal(title(DRIVING), "Ann is driving");
  const odd = { connection: "c2", name: "$& {since}" };
  assert.equal(title({ ...DRIVING, holder: odd }), "$& {since} is driving");
  const nameless = { connection: "c2", name: "" };
  assert.equal(title({ ...DRIVING, holder: nameless }), "C2 is driving");
});

test("the detail names the operator if the title does not", () => {
  const report = { ...REPORT, holder: ANN, state: "stopping", doing: "stopping" };
  const shown = describe(STATUS, "r1", report, true);
  assert.deepEqual([shown.title, shown.detail], ["Stopping", "Ann has control."]);
});

test("speeds are shown with their sign, and a driven robot at standstill as blocked", () => {
  const driven = { ...STATUS, driven: "r1", settled: true };
  const report = { ...REPORT, ...ME, ...DRIVING, sent: [-1, 0, 0] };
  const back = describe(driven, "r1", { ...report, measured: [-0.98, 0, 0.1] }, true);
  assert.equal(back.detail, "-0.98 m/s, 0.10 rad/s");
  const wall = describe(driven, "r1", { ...report, doing: "blocked" }, true);
  assert.equal(wall.title, "You are driving · not moving: blocked?");
  assert.equal(
    wall.detail,
    "Sent: -1.00 m/s, 0.00 rad/s. Measured: 0.00 m/s, 0.00 rad/s.",
  );
});

test("the operator who does not drive reads that this page has control", () => {
  const { title, detail } = describe(STATUS, "r1", { ...REPORT, ...ME }, true);
  assert.equal(title, "You have control");
  assert.equal(detail, "Hold W A S D or the arrow keys to drive. Press Space for STOP.");
  const barred = { ...ME, armable: false, doing: "barred_held", reason: "no link" };
  const held = describe(STATUS, "r1", { ...REPORT, ...barred }, true);
  assert.equal(held.title, "Cannot be driven (you have control)");
  assert.equal(held.detail, "No link.");
});

test("the title is the state of the gate or a state that only the display knows", () => {
  const title = (doing, state) => {
    const armable = doing === "free";
    const more = { seen: { state, since: "10:32" } };
    return describe(STATUS, "r1", { ...REPORT, doing, armable }, true, more).title;
  };
  assert.equal(title("free", "free"), "Free");
  assert.equal(title("free", "moving"), "Moved by another program");
  assert.equal(title("free", "navigating"), "Autonomous");
  assert.equal(title("moving", "navigating"), "Autonomous");
  assert.equal(title("other", "navigating"), "Autonomous");
  assert.equal(title("free", "gone"), "No pose since 10:32");
  assert.equal(title("barred", "gone"), "No pose since 10:32");
  assert.equal(title("down", "no_bridge"), "No connection to the bridge");
  assert.equal(title("down", "down"), "No connection for commands");
  // What the display showed a moment ago is older than the report of the gate.
  assert.equal(title("free", "driven"), "Free");
  assert.equal(title("navigating", "gone"), "Autonomous");
  assert.equal(title("settling", "no_bridge"), "Still moving");
  assert.equal(doingOf({ ...REPORT, doing: "driven" }, "gone"), "driven");
});

test("the title has the conditions beside the activity, and hides neither", () => {
  const title = (fields, seen) =>
    describe({ ...STATUS, driven: "r1", settled: true }, "r1", { ...REPORT, ...fields }, true, { seen }).title;
  const low = { state: "battery_low", activity: "free", conditions: "battery_low" };
  assert.equal(title({}, low), "Free · battery low");
  assert.equal(title({ ...ME, ...DRIVING }, low), "You are driving · battery low");
  const away = { state: "lost", activity: "driven", conditions: "lost goal_failed" };
  const blocked = { ...ME, ...DRIVING, doing: "blocked" };
  assert.equal(
    title(blocked, away),
    "You are driving · not moving: blocked? · lost: no new pose · goal failed",
  );
  assert.equal(title({ doing: "stopped", latched: true }, low), "STOP active · battery low");
});

test("a silent agent is named, also by the report of its loss, and no connection is slow", () => {
  const silent = { ...STATUS, link: "silent", driven: "r1" };
  const report = { ...REPORT, ...ME, ...DRIVING, gate: "bay3" };
  const soon = describe(silent, "r1", report, true);
  assert.deepEqual(
    [soon.state, soon.title, soon.detail],
    ["late", "No answer from the agent bay3", "Commands are ignored."],
  );
  const reason = "no connection to the router at tcp/h:7447";
  const lost = { gate: "bay3", link: "down", doing: "down", armable: false, reason };
  for (const state of ["free", "driving", "stopping"]) {
    const later = describe({ ...silent, driven: null }, "r1", { ...REPORT, ...lost, state }, true);
    assert.equal(later.title, "No connection for commands");
    assert.equal(later.detail, "No connection to the router at tcp/h:7447.");
  }
});

test("after a freeze with a held key the input is blocked, whatever was refused", () => {
  const frozen = { ...STATUS, frozen: true, blocked: true };
  const blocked = "Input blocked: release all keys, then press again";
  const title = (status, fields) =>
    describe({ ...frozen, ...status }, "r1", { ...REPORT, ...fields }, true).title;
  assert.equal(title({}, {}), blocked);
  assert.equal(title({ refusal: "command too old", refused: "drive" }, {}), blocked);
  assert.equal(title({ driven: "r1", settled: true }, ME), blocked);
  assert.equal(title({ blocked: false }, {}), "Free");
});

test("another program that moves the robot is named if its nodes are known", () => {
  const seen = { state: "other", program: "another program: /joy" };
  const { title } = describe(STATUS, "r1", { ...REPORT, doing: "other" }, true, { seen });
  assert.equal(title, "Moved by another program: /joy");
});

test("a robot without a velocity topic is shown with the state of the display", () => {
  const title = (more) => describe(STATUS, "r1", null, true, more).title;
  assert.equal(title({}), "View only");
  assert.equal(title({ seen: { state: "watched" } }), "View only");
  assert.equal(title({ seen: { state: "gone", since: "10:32" } }), "No pose since 10:32");
});

test("a lower-case name at the beginning of a sentence is not capitalized", () => {
  assert.equal(sentence("no connection to ws://a"), "No connection to ws://a.");
  assert.equal(sentence("ws://a:9090 is lost."), "ws://a:9090 is lost.");
  assert.equal(sentence("robot_0 is free"), "robot_0 is free.");
  assert.equal(sentence("zero sent, still moving"), "Zero sent, still moving.");
});

test("the speed limit is shown with its reason", () => {
  const why = ["stop not verified"];
  assert.deepEqual(capOf({ ...REPORT, why }), {
    why: "Speed limit: stop not verified",
    cap: "at most 0.30 m/s, 0.60 rad/s",
  });
});

test("a failed stop hook is shown in every state of a connected robot", () => {
  const hooks = ["stop hook /e_stop: refused", "stop hook /lock: no answer within 2 s"];
  const failures = "Stop hook /e_stop: refused. Stop hook /lock: no answer within 2 s.";
  const detail = (more, status = {}) =>
    describe({ ...STATUS, ...status }, "r1", { ...REPORT, hooks, ...more }, true).detail;
  const stop = { by: "Ann", confirmed: true, why: "" };
  const latched = { state: "stopped", doing: "stopped", latched: true, stop };
  assert.equal(detail(latched), `By Ann, confirmed by odometry. ${failures}`);
  assert.equal(detail({}, { taking: true }), failures);
  const driving = detail({ ...ME, ...DRIVING }, { driven: "r1" });
  assert.equal(driving, `0.00 m/s, 0.00 rad/s. ${failures}`);
  assert.equal(detail({}, { link: "connecting" }), "Connecting.");
});

test("another program that publishes velocities is shown in every state", () => {
  const other_writer = "another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s)";
  const warning = "Another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s).";
  const mine = { ...STATUS, driven: "r1", settled: true };
  const stop = { by: "Ann", confirmed: true, why: "", id: "s1" };
  const states = [
    [STATUS, { doing: "other" }, "Moved by another program"],
    [mine, ME, "You have control"],
    [mine, { ...ME, ...DRIVING }, "You are driving"],
    [STATUS, { state: "stopped", doing: "stopped", latched: true, stop }, "STOP active"],
  ];
  for (const [status, more, title] of states) {
    const shown = describe(status, "r1", { ...REPORT, other_writer, ...more }, true);
    assert.equal(shown.title, title);
    assert.ok(shown.detail.endsWith(warning), shown.detail);
    assert.equal(shown.warns, true);
    const alone = describe(status, "r1", { ...REPORT, ...more }, true);
    assert.ok(!alone.detail.includes("nother program"));
  }
});
