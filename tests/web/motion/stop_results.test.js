import assert from "node:assert/strict";
import { describe, test } from "node:test";

import {
  ANSWER_PATIENCE,
  linesOf,
  Obedience,
  STAND_PATIENCE,
  StopResults,
  standingStops,
  stopText,
} from "../../../src/webmap/web/motion/stops.js";

const STILL = [0, 0, 0];
const GOING = [0.4, 0, 0];

function report(fields = {}) {
  return {
    robot: "r1",
    name: "Bob",
    state: "stopping",
    holder: null,
    mine: false,
    epoch: null,
    armed: false,
    v: 1,
    w: 1,
    why: [],
    link: "up",
    sent: STILL,
    echoed: null,
    measured: STILL,
    armable: true,
    reason: null,
    ...fields,
  };
}

/** Stop r1 at time 0, receive one report at `at`, and return the verdict at `now`. */
function verdict(reported, at, now, connected = true) {
  const stopping = new StopResults();
  stopping.start("r1", new Map(), 0);
  if (reported) stopping.report(reported, at);
  const robots = new Map(reported ? [["r1", reported]] : []);
  return stopping.verdicts(robots, connected, now)[0];
}

describe("a STOP", () => {
  test("is confirmed by odometry that shows standstill", () => {
    assert.equal(verdict(report(), 100, 200).state, "confirmed");
  });

  test("is not confirmed by a standstill reported before the gate answered", () => {
    assert.equal(verdict(report({ state: "driving" }), 10, 20).state, "stopping");
  });

  test("that the gate does not answer in time is not confirmed", () => {
    assert.equal(verdict(null, 0, ANSWER_PATIENCE).state, "stopping");
    assert.match(verdict(null, 0, ANSWER_PATIENCE + 1).text, /NOT CONFIRMED: no answer/);
  });

  test("of a robot that still moves after a second is not confirmed", () => {
    const moving = report({ measured: GOING });
    assert.equal(verdict(moving, 100, STAND_PATIENCE).state, "stopping");
    assert.match(verdict(moving, 100, STAND_PATIENCE + 1).text, /moving at 0.40 m\/s/);
  });

  for (const [motion, measured] of [
    ["climbs", [0, 0, 0, -0.4, 0, 0]],
    ["rolls", [0, 0, 0, 0, 0.4, 0]],
    ["pitches", [0, 0, 0, 0, 0, -0.4]],
  ]) {
    test(`of a robot that still ${motion} is not confirmed`, () => {
      const { state } = verdict(report({ measured }), 100, STAND_PATIENCE + 1);
      assert.equal(state, "unconfirmed");
    });
  }

  test("of a robot that still climbs shows its speed", () => {
    const climbing = report({ measured: [0.3, 0, 0, -0.4, 0, 0] });
    const { text } = verdict(climbing, 100, STAND_PATIENCE + 1);
    assert.match(text, /still moving at 0.50 m\/s/);
  });

  test("of a robot without odometry is not confirmed", () => {
    const blind = report({ measured: null });
    assert.match(verdict(blind, 100, STAND_PATIENCE + 1).text, /no odometry/);
  });

  test("of a robot without a connection is shown as such at once", () => {
    assert.match(verdict(report({ link: "down" }), 10, 20).text, /no connection to the bridge/);
    assert.match(verdict(null, 0, 1, false).text, /no connection/);
  });

  test("of all robots has a verdict for every robot", () => {
    const stopping = new StopResults();
    stopping.start("*", new Map([["r1", report()], ["r2", report()]]), 0);
    const names = stopping.verdicts(new Map(), true, 1).map(({ robot }) => robot);
    assert.deepEqual(names, ["r1", "r2"]);
  });

  test("is shown until confirmed, and then for some seconds", () => {
    const stopping = new StopResults();
    stopping.start("r1", new Map(), 0);
    const robots = new Map([["r1", report()]]);
    assert.equal(stopping.verdicts(robots, true, 60_000).length, 1);
    stopping.report(report(), 60_000);
    assert.equal(stopping.verdicts(robots, true, 61_000).length, 1);
    assert.equal(stopping.verdicts(robots, true, 66_000).length, 0);
  });
});

describe("the results of STOP ALL for many robots", () => {
  const ids = Array.from({ length: 30 }, (_, number) => `r${number}`);
  const robots = new Map(ids.map((robot) => [robot, report({ robot, name: robot })]));

  /** Stop all at time 0; all but some have stopped at `at`. */
  function stopped(at, moving = []) {
    const stopping = new StopResults();
    stopping.start("*", robots, 0);
    for (const [robot, each] of robots) {
      if (!moving.includes(robot)) stopping.report(each, at);
    }
    return stopping;
  }

  const texts = (verdicts) => linesOf(verdicts).map(({ text }) => text);

  test("are one line with their number", () => {
    const [line, ...others] = linesOf(stopped(200).verdicts(robots, true, 300));
    assert.deepEqual(line, { state: "confirmed", text: "30 of 30 stopped, confirmed" });
    assert.deepEqual(others, []);
  });

  test("name only robots whose STOP is not confirmed, and keep the number", () => {
    const stopping = stopped(200, ["r7"]);
    for (const now of [ANSWER_PATIENCE + 1, 60_000]) {
      assert.deepEqual(texts(stopping.verdicts(robots, true, now)), [
        "29 of 30 stopped, confirmed",
        "r7: NOT CONFIRMED: no answer from the gate",
      ]);
    }
    stopping.report(robots.get("r7"), 60_000);
    assert.equal(stopping.verdicts(robots, true, 64_000).length, 30);
    stopping.verdicts(robots, true, 66_000);
    assert.deepEqual(stopping.verdicts(robots, true, 66_000), []);
  });

  test("are not named while the robots still may stop", () => {
    const lines = linesOf(stopped(200, ids.slice(10)).verdicts(robots, true, 250));
    assert.deepEqual(lines, [{ state: "stopping", text: "10 of 30 stopped, confirmed" }]);
  });

  test("name eight robots, and count the others", () => {
    const lines = texts(stopped(200, ids).verdicts(robots, true, 5000));
    assert.equal(lines.length, 10);
    assert.equal(lines[0], "0 of 30 stopped, confirmed");
    assert.equal(lines.at(-1), "22 more, 22 NOT CONFIRMED");
  });

  test("name a robot whose stop hook failed", () => {
    const failed = "stop hook /e_stop: refused";
    const hooked = new Map(robots).set("r3", report({ name: "r3", hooks: [failed] }));
    assert.deepEqual(texts(stopped(200).verdicts(hooked, true, 300)), [
      "30 of 30 stopped, confirmed",
      `r3: stopped, confirmed by odometry; ${failed}`,
    ]);
  });
});

describe("a STOP for all robots before any robot is known", () => {
  const latched = { state: "stopped", latched: true };
  const free = { state: "free", latched: false };

  /** Stop all at time 0, and return the verdicts at `now` after some reports. */
  function verdicts(reports, now, connected = true) {
    const stopping = new StopResults();
    stopping.start("*", new Map(), 0);
    const robots = new Map();
    for (const [at, reported] of reports) {
      robots.set(reported.robot, reported);
      stopping.report(reported, at);
    }
    return stopping.verdicts(robots, connected, now);
  }

  test("is shown as not confirmed", () => {
    const [unknown, ...others] = verdicts([], 10, false);
    assert.deepEqual(others, []);
    assert.equal(unknown.name, "All robots");
    assert.match(unknown.text, /^NOT CONFIRMED: no connection/);
    const [silent] = verdicts([], ANSWER_PATIENCE + 1);
    assert.equal(silent.text, "NOT CONFIRMED: no answer from the gate");
  });

  test("applies to robots that are reported before the answer", () => {
    const two = report({ ...free, robot: "r2" });
    const shown = verdicts([[10, report(free)], [11, two]], ANSWER_PATIENCE);
    assert.deepEqual(
      shown.map(({ robot, state }) => [robot, state]),
      [["r1", "stopping"], ["r2", "stopping"]],
    );
    const later = verdicts([[10, report(free)], [11, two]], ANSWER_PATIENCE + 1);
    assert.deepEqual(new Set(later.map(({ state }) => state)), new Set(["unconfirmed"]));
  });

  test("does not apply to a robot that is reported after the answer", () => {
    const later = report({ ...free, robot: "r2" });
    const stopped = report({ ...latched, stop: { by: "Ann", confirmed: true, why: "" } });
    const shown = verdicts([[10, report(free)], [20, stopped], [30, later]], 40);
    assert.deepEqual(
      shown.map(({ robot, state }) => [robot, state]),
      [["r1", "confirmed"]],
    );
  });

  test("can be dismissed", () => {
    const stopping = new StopResults();
    stopping.start("*", new Map(), 0);
    stopping.dismiss();
    stopping.report(report(free), 10);
    assert.deepEqual(stopping.verdicts(new Map(), false, 20), []);
  });
});

describe("a latched STOP", () => {
  const stopOf = (confirmed, why = "") => ({ by: "Ann", confirmed, why });
  const latched = (fields) => report({ state: "stopped", latched: true, ...fields });

  test("is confirmed by the gate", () => {
    const stopped = latched({ measured: null, stop: stopOf(true) });
    assert.equal(verdict(stopped, 100, 200).state, "confirmed");
  });

  test("is not confirmed while the gate still checks, even if odometry shows standstill", () => {
    assert.equal(verdict(latched({ stop: stopOf(null) }), 100, 200).state, "stopping");
  });

  test("that is not confirmed shows the reason of the gate", () => {
    const stopped = latched({ stop: stopOf(false, "no connection to ws://bob") });
    const { text } = verdict(stopped, 100, 200);
    assert.equal(text, "NOT CONFIRMED: no connection to ws://bob");
  });

  test("is not answered by a report that is not latched", () => {
    const free = report({ state: "free", latched: false });
    assert.match(verdict(free, 100, ANSWER_PATIENCE + 1).text, /^NOT CONFIRMED/);
  });

  test("sent again needs no new answer", () => {
    const stopping = new StopResults();
    const robots = new Map([["r1", latched({ stop: stopOf(true) })]]);
    stopping.start("r1", robots, 0);
    assert.equal(stopping.verdicts(robots, true, 400)[0].state, "confirmed");
  });

  test("is removed by its Reset", () => {
    const stopping = new StopResults();
    stopping.start("r1", new Map(), 0);
    stopping.report(latched({ stop: stopOf(false, "no odometry") }), 50);
    stopping.report(report({ state: "free", latched: false, stop: null }), 100);
    assert.deepEqual(stopping.verdicts(new Map(), true, 5000), []);
  });

  test("is shown with its operator and its confirmation", () => {
    const text = (stop) => stopText(latched({ stop })).text;
    assert.equal(text(stopOf(true)), "By Ann, confirmed by odometry.");
    assert.equal(text(stopOf(null)), "By Ann, waiting for odometry to confirm.");
    assert.equal(text(stopOf(false, "no odometry")), "By Ann: no odometry.");
    assert.equal(text({ ...stopOf(true), by: "" }), "Confirmed by odometry.");
    assert.equal(text(null), "");
  });

  test("that is not on the disk is shown with a warning about a restart", () => {
    const forgotten = "a restart would end this STOP: the disk is full";
    const text = (confirmed, why) =>
      stopText(latched({ stop: { by: "Ann", confirmed, why: `${why}; ${forgotten}` } }))
        .text;
    const reason = "stopped, confirmed by odometry";
    assert.equal(text(true, reason), `By Ann, confirmed by odometry; ${forgotten}.`);
    assert.equal(text(null, ""), `By Ann, waiting for odometry to confirm; ${forgotten}.`);
    const stop = { by: "Ann", confirmed: true, why: `${reason}; ${forgotten}` };
    assert.equal(verdict(latched({ stop }), 100, 200).text, `${reason}; ${forgotten}`);
  });

  test("is listed beside STOP ALL", () => {
    const one = latched({ stop: stopOf(true) });
    const doubtful = latched({ stop: stopOf(false, "no odometry") });
    assert.equal(standingStops([report()]), "");
    assert.equal(standingStops([one, report()]), "STOP active: Bob.");
    assert.equal(standingStops([doubtful]), "STOP active: Bob, NOT CONFIRMED.");
    const text = "STOP active: 2 robots, 1 NOT CONFIRMED.";
    assert.equal(standingStops([one, doubtful]), text);
  });
});

describe("a robot", () => {
  const driven = report({ state: "driving", sent: GOING, measured: GOING });
  const moving = report({ measured: GOING });

  function obedience(...reports) {
    const watch = new Obedience();
    for (const [at, reported] of reports) watch.report(reported, at);
    return watch;
  }

  test("that still moves one second after zero does not obey", () => {
    const watch = obedience([0, driven], [100, moving], [900, moving]);
    assert.deepEqual(watch.disobeying(100 + STAND_PATIENCE), []);
    assert.equal(watch.disobeying(101 + STAND_PATIENCE)[0].name, "Bob");
  });

  test("that stood still after zero obeys, even when moving later", () => {
    const watch = obedience([0, driven], [100, moving], [500, report()], [600, moving]);
    assert.deepEqual(watch.disobeying(5000), []);
  });

  test("that drives to a goal obeys", () => {
    const watch = obedience([0, moving], [100, moving]);
    assert.deepEqual(watch.disobeying(5000), []);
    const excused = obedience([0, driven], [100, moving]);
    excused.excuse("r1");
    assert.deepEqual(excused.disobeying(5000), []);
  });

  test("without odometry is not reported as not obeying", () => {
    const watch = obedience([0, driven], [100, report({ measured: null })]);
    assert.deepEqual(watch.disobeying(5000), []);
  });
});

describe("a failed stop hook", () => {
  const stop = { by: "Ann", confirmed: true, why: "" };
  const hooks = ["stop hook /e_stop: refused"];
  const failed = report({ state: "stopped", latched: true, stop, hooks });

  test("is shown with a STOP that odometry confirms", () => {
    const text = "stopped, confirmed by odometry; stop hook /e_stop: refused";
    assert.equal(verdict(failed, 100, 200).text, text);
  });

  test("is shown beside STOP ALL", () => {
    const text = "STOP active: Bob. Stop hooks failed: Bob.";
    assert.equal(standingStops([failed, report()]), text);
  });
});
