import assert from "node:assert/strict";
import { test } from "node:test";

import { capOf, describe } from "../../../src/webmap/web/motion/status.js";

const STATUS = {
  link: "open",
  choice: "r1",
  report: null,
  driven: null,
  taking: false,
  settled: false,
  pressed: false,
  dead: false,
  axes: { x: 0, y: 0, turn: 0 },
  refusal: null,
  delay: 20,
};
const REPORT = {
  robot: "r1",
  name: "Bob",
  state: "free",
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
};

const cases = [
  ["connecting", { link: "connecting" }, REPORT],
  ["lost", { link: "lost", driven: "r1" }, { ...REPORT, ...ME, state: "driving" }],
  ["late", { link: "late", driven: "r1" }, { ...REPORT, ...ME, state: "driving" }],
  ["fixed", {}, null],
  ["free", {}, REPORT],
  ["fixed", {}, { ...REPORT, armable: false, reason: "no link" }],
  [
    "held",
    {},
    { ...REPORT, holder: { connection: "c2", name: "Ann" }, state: "driving" },
  ],
  ["hands-off", { pressed: true, dead: true }, REPORT],
  ["taking", { taking: true }, REPORT],
  ["taking", { driven: "r1" }, { ...REPORT, ...ME }],
  ["ready", { driven: "r1", settled: true }, { ...REPORT, ...ME }],
  ["driving", { driven: "r1", settled: true }, { ...REPORT, ...ME, state: "driving" }],
  [
    "stopping",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, state: "stopping" },
  ],
  [
    "stopping",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, measured: [0, 0.06, 0] },
  ],
  [
    "ready",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, measured: [0.04, 0, 0.09] },
  ],
  [
    "ready",
    { driven: "r1", settled: true },
    { ...REPORT, ...ME, measured: [0.4, 0, 0], goal: { state: "under way" } },
  ],
  [
    "stopping",
    { driven: "r1", settled: true },
    {
      ...REPORT,
      ...ME,
      measured: [0.4, 0, 0],
      cancels: false,
      goal: { state: "sent", way: "topic" },
    },
  ],
  ["stopping", {}, { ...REPORT, measured: [0, 0, -0.2], goal: { state: "cancelled" } }],
  ["stopping", {}, { ...REPORT, measured: [0, 0, 0, -0.2, 0, 0] }],
  ["stopping", {}, { ...REPORT, measured: [0, 0, 0, 0, 0.2, 0] }],
  ["hands-off", { driven: "r1", pressed: true, dead: true }, { ...REPORT, ...ME }],
  ["fixed", { driven: "r1" }, { ...REPORT, ...ME, reason: "no odometry for 1 s" }],
  ["stopped", {}, { ...REPORT, state: "stopped" }],
];

for (const [state, status, report] of cases) {
  const { state: robot, measured } = report ?? {};
  const told = JSON.stringify({ ...status, robot, measured });
  test(`${told} is shown as ${state}`, () => {
    const description = describe({ ...STATUS, ...status }, "r1", report, true);
    assert.equal(description.state, state);
    assert.notEqual(description.title, "");
  });
}

test("without a selection nothing can be driven", () => {
  assert.equal(describe(STATUS, null, null, true).state, "none");
});

test("the name of who drives is said", () => {
  const report = { ...REPORT, holder: { connection: "c2", name: "Ann" } };
  assert.equal(describe(STATUS, "r1", report, true).title, "Held by Ann");
});

test("the cap says why it is in force", () => {
  const why = ["unverified stop"];
  assert.equal(
    capOf({ ...REPORT, why }),
    "Up to 0.30 m/s, 0.60 rad/s: unverified stop",
  );
});

test("a stop hook that failed is said, whatever else there is to say", () => {
  const hooks = ["stop hook /e_stop: refused", "stop hook /lock: no answer within 2 s"];
  const words = "Stop hook /e_stop: refused. Stop hook /lock: no answer within 2 s.";
  const detail = (more, status = {}) =>
    describe({ ...STATUS, ...status }, "r1", { ...REPORT, hooks, ...more }, true).detail;
  const stop = { by: "Ann", confirmed: true, why: "" };
  const latched = { state: "stopped", latched: true, stop };
  assert.equal(detail(latched), `By Ann, confirmed by odometry. ${words}`);
  assert.equal(detail({}, { taking: true }), words);
  const driving = detail({ ...ME, state: "driving" }, { driven: "r1" });
  assert.equal(driving, `0.00 m/s, 0.00 rad/s. ${words}`);
  assert.equal(detail({}, { link: "connecting" }), "Connecting.");
});

test("another program that publishes velocities is said in every state", () => {
  const other_writer = "another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s)";
  const said = "Another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s).";
  const mine = { ...STATUS, driven: "r1", settled: true };
  const stop = { by: "Ann", confirmed: true, why: "", id: "s1" };
  const states = [
    [STATUS, {}, "Free"],
    [mine, ME, "Ready"],
    [mine, { ...ME, state: "driving" }, "Driving"],
    [STATUS, { state: "stopped", latched: true, stop }, "Stopped"],
  ];
  for (const [status, more, title] of states) {
    const words = describe(status, "r1", { ...REPORT, other_writer, ...more }, true);
    assert.equal(words.title, title);
    assert.ok(words.detail.endsWith(said), words.detail);
    const alone = describe(status, "r1", { ...REPORT, ...more }, true);
    assert.ok(!alone.detail.includes("nother program"));
  }
});
