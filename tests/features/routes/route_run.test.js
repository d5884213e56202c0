import assert from "node:assert/strict";
import { test } from "node:test";

import { RouteRun } from "../../../src/webmap/features/routes/route_run.js";

const POINTS = [1, 2, 3].map((x) => ({ x, y: 0, yaw: 0 }));

function goal(id, state = "under way", more = {}) {
  return { id, state, why: "", method: "move_base", left: null, eta: null, ...more };
}

/** A run whose first goal, `g1`, is under way. */
function underWay(options) {
  const run = new RouteRun(POINTS, options);
  run.go(null);
  run.accepted(0);
  report(run, goal("g1"));
  return run;
}

function report(run, reported, { mine = true, latched = false, away = null, now = 0 } = {}) {
  return run.report({ mine, latched, goal: reported }, away, now);
}

test("a route sends its goals one after another and ends after the last", () => {
  const run = underWay();
  for (const n of [1, 2]) {
    assert.deepEqual(report(run, goal(`g${n}`, "reached")), { send: POINTS[n] });
    assert.equal(report(run, goal(`g${n}`, "reached")), null, "the goal is sent once");
    run.accepted(0);
    assert.equal(report(run, goal(`g${n}`, "reached")), null, "the previous goal is ignored");
    assert.equal(report(run, goal(`g${n + 1}`)), null);
  }
  assert.equal(report(run, goal("g3", "reached")), null);
  assert.equal(run.state, "ended");
  assert.equal(run.go("g3"), null);
});

test("a loop starts again at its first point", () => {
  const run = underWay({ loop: true });
  run.skip("g1");
  run.skip("g1");
  run.accepted(0);
  report(run, goal("g3"));
  const later = { now: 1000 };
  assert.deepEqual(report(run, goal("g3", "reached"), later), { send: POINTS[0] });
  assert.equal(run.rounds, 1);
});

test("a loop whose points are already reached sends one goal per second", () => {
  const run = new RouteRun(POINTS, { loop: true });
  run.go(null);
  run.accepted(0);
  const sent = [];
  for (let now = 0; now < 10_000; now += 50) {
    const there = goal(`g${sent.length}`, "sent", { method: "topic" });
    if (report(run, there, { away: 0.1, now }) === null) continue;
    sent.push(now);
    run.accepted(now);
  }
  assert.deepEqual(sent, [1, 2, 3, 4, 5, 6, 7, 8, 9].map((second) => 1000 * second));
});

test("a route without a loop does not wait at points that are reached at once", () => {
  assert.deepEqual(report(underWay(), goal("g1", "reached")), { send: POINTS[1] });
});

test("a STOP halts a loop that waits at a reached point", () => {
  const run = underWay({ loop: true });
  assert.equal(report(run, goal("g1", "reached"), { now: 500 }), null);
  report(run, goal("g1", "reached"), { now: 1500, latched: true });
  assert.equal(run.state, "halted");
});

test("a loop with one point ends at that point", () => {
  const run = new RouteRun(POINTS.slice(0, 1), { loop: true });
  run.go(null);
  run.accepted(0);
  report(run, goal("g1"));
  assert.equal(report(run, goal("g1", "reached"), { now: 60_000 }), null);
  assert.equal(run.state, "ended");
});

test("a failed goal halts the route until the operator resumes or skips", () => {
  const run = underWay();
  assert.equal(report(run, goal("g1", "failed", { why: "no path" })), null);
  assert.equal(run.state, "halted");
  assert.equal(run.why, "the goal failed: no path");
  assert.equal(report(run, goal("g1", "failed")), null);
  assert.deepEqual(run.go("g1"), { send: POINTS[0] });
  run.accepted(0);
  report(run, goal("g2", "failed"));
  assert.deepEqual(run.skip("g2"), { send: POINTS[1] });
});

test("STOP, a lost lease, another goal and a cancel halt the route", () => {
  const cases = [
    [goal("g1"), { latched: true }, /STOP/],
    [goal("g1"), { mine: false }, /no longer has control of the robot/],
    [goal("g9"), {}, /another goal/],
    [goal("g1", "cancelled", { why: "STOP" }), {}, /cancelled: STOP/],
    [goal("g1", "cancelling"), {}, /cancelled/],
  ];
  for (const [reported, more, why] of cases) {
    const run = underWay();
    assert.equal(report(run, reported, more), null);
    assert.equal(run.state, "halted");
    assert.match(run.why, why);
    assert.equal(report(run, goal("g1", "reached")), null, "the route does not continue by itself");
  }
});

test("a missing lease does not halt the route before the gate accepts the goal", () => {
  const run = new RouteRun(POINTS);
  run.go(null);
  assert.equal(report(run, null, { mine: false }), null);
  assert.equal(run.state, "going");
  run.halt("Ann has control");
  assert.equal(run.why, "Ann has control");
});

test("a goal that never appears in a report halts the route", () => {
  const run = new RouteRun(POINTS);
  run.go("g0");
  run.accepted(0);
  report(run, goal("g0", "reached"), { now: 4000 });
  assert.equal(run.state, "going");
  report(run, goal("g0", "reached"), { now: 6000 });
  assert.equal(run.state, "halted");
});

test("a pause cancels the goal and a resume sends the same point again", () => {
  const run = underWay();
  assert.deepEqual(run.pause(), { cancel: true });
  assert.equal(run.pause(), null);
  assert.equal(report(run, goal("g1", "cancelled")), null);
  assert.equal(run.state, "paused");
  assert.equal(run.skip("g1"), null, "a paused route sends nothing");
  assert.equal(run.index, 1);
  assert.deepEqual(run.go("g1"), { send: POINTS[1] });
});

test("a skip sends the next point at once and ends the route at the last point", () => {
  const run = underWay();
  assert.deepEqual(run.skip("g1"), { send: POINTS[1] });
  assert.deepEqual(run.skip("g2"), { send: POINTS[2] });
  assert.deepEqual(run.skip("g3"), { cancel: true });
  assert.equal(run.state, "ended");
  assert.equal(run.skip("g3"), null);
});

test("ending the route cancels the goal under way", () => {
  const run = underWay();
  assert.deepEqual(run.end(), { cancel: true });
  assert.equal(run.end(), null);
  assert.equal(run.live, false);
});

test("a goal without progress counts as reached when the robot is near", () => {
  const run = new RouteRun(POINTS);
  run.go(null);
  run.accepted(0);
  const sent = goal("g1", "sent", { method: "topic" });
  assert.equal(report(run, sent, { away: 0.5 }), null);
  assert.deepEqual(report(run, sent, { away: 0.2 }), { send: POINTS[1] });
});

test("a goal with progress is not reached by distance alone", () => {
  const run = underWay();
  assert.equal(report(run, goal("g1"), { away: 0.1 }), null);
  assert.equal(run.state, "going");
});

test("a goal of unknown state halts the route with the reason", () => {
  const run = underWay();
  assert.equal(report(run, goal("g1", "unknown", { why: "perhaps rejected" })), null);
  assert.equal(run.state, "halted");
  assert.equal(run.why, "the state of the goal is unknown: perhaps rejected");
});
