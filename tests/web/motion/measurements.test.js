import assert from "node:assert/strict";
import { describe, test } from "node:test";

import {
  motions,
  ownStop,
  speedAlong,
  speedNow,
  stoppingDistance,
  stopTestText,
  timings,
} from "../../../src/webmap/web/motion/measurements.js";

function report(fields = {}) {
  const known = { reaction: 0.6, brake: 0.5, state: "driving" };
  return { sent: [0.4, 0, 0], echoed: null, measured: [0.4, 0, 0], ...known, ...fields };
}

describe("a speed", () => {
  test("is the ground speed, negative when driving backwards", () => {
    assert.equal(speedAlong([0.3, 0.4, 9]), 0.5);
    assert.equal(speedAlong([-0.3, 0.4, 9]), -0.5);
    assert.equal(speedAlong([0, 0.4, 0]), 0.4);
    assert.equal(speedAlong(null), null);
    assert.equal(speedAlong([NaN, 0, 0]), null);
  });

  test("is the measured one, else the echoed one, else the sent one", () => {
    const echoed = [0.2, 0, 0];
    assert.equal(speedNow(report({ echoed, sent: [0.1, 0, 0] })), 0.4);
    assert.equal(speedNow(report({ echoed, measured: null })), 0.2);
    assert.equal(speedNow(report({ measured: null })), 0.4);
  });
});

describe("the stopping distance", () => {
  test("is the way during the reaction plus the way of braking", () => {
    assert.ok(Math.abs(stoppingDistance(report()) - (0.24 + 0.16)) < 1e-9);
  });

  test("is null for a robot that does not move or is not driven", () => {
    assert.equal(stoppingDistance(report({ measured: [0.019, 0, 0.5] })), null);
    assert.equal(stoppingDistance(report({ state: "free" })), null);
  });

  test("is known while a stopped robot still moves", () => {
    assert.ok(stoppingDistance(report({ state: "stopped" })) > 0);
  });

  test("uses safe defaults if an older gate does not report the values", () => {
    const older = report({ reaction: undefined, brake: undefined });
    assert.ok(Math.abs(stoppingDistance(older) - (0.4 + 0.16)) < 1e-9);
  });

  test("is null for a robot that cannot brake", () => {
    assert.equal(stoppingDistance(report({ brake: 0 })), null);
  });
});

test("the sent, the echoed and the measured velocity are listed", () => {
  const figures = motions(report({ measured: [-0.3, 0, -0.001] }));
  assert.deepEqual(figures, [
    { name: "Sent", kind: "motion", text: "0.40 m/s", more: ", 0.00 rad/s" },
    { name: "Arrived", kind: "motion", text: "unknown", more: "" },
    { name: "Measured", kind: "motion", text: "-0.30 m/s", more: ", 0.00 rad/s" },
  ]);
});

test("the round trip is that of the gate, or else that of the page", () => {
  const texts = (...about) => timings(...about).map(({ text }) => text);
  assert.deepEqual(texts(report({ age: 41.6 }), 55, 230), ["42 ms", "230 ms", "0.40 m"]);
  assert.deepEqual(texts(report({ age: null }), 55, null)[0], "55 ms");
  const standing = report({ measured: [0, 0, 0] });
  assert.deepEqual(texts(standing, null, null), ["unknown", "unknown", "not moving"]);
});

test("a robot is shown as not moving only if odometry shows standstill", () => {
  const stop = (fields) => timings(report(fields), null, null)[2].text;
  const rest = { sent: [0, 0, 0], echoed: null };
  assert.equal(stop({ ...rest, measured: [0, 0, 0] }), "not moving");
  assert.equal(stop({ ...rest, measured: null }), "unknown");
  assert.equal(stop({ ...rest, state: "free", measured: [0.4, 0, 0] }), "unknown");
});

test("a running or failed stop test is shown, a successful one is not", () => {
  const holder = { connection: "c1", name: "Ann" };
  const text = (state) => stopTestText({ test: { state, text: "creeping" }, holder });
  assert.equal(text("creeping"), "Stop test: creeping");
  assert.equal(text("failed"), "Stop test: creeping");
  assert.equal(text("done"), "");
  assert.equal(stopTestText({ test: null }), "");
  const stopped = { state: "failed", text: "STOP by Ann" };
  assert.equal(stopTestText({ test: stopped, holder: null }), "");
  assert.equal(stopTestText({}), "");
});

test("the command timeout is shown with its source", () => {
  const text = (stop_time, stop_source, stop_date, why = []) =>
    ownStop({ stop_time, stop_source, stop_date, why });
  assert.equal(text(undefined), "");
  assert.equal(text(null, null, null), "Command timeout of the base: unknown.");
  const failed = "Command timeout of the base: none (tested 2026-11-21).";
  assert.equal(text(null, "tested", "2026-11-21"), failed);
  assert.equal(text(null, null, null, ["stop test failed on 2026-11-21"]), "");
  assert.equal(text(0.25, "stated", null), "Command timeout of the base: 0.25 s (stated).");
  const tested = "Command timeout of the base: 0.31 s (tested 2026-11-21).";
  assert.equal(text(0.31, "tested", "2026-11-21"), tested);
});
