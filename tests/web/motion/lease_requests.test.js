import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { Inputs } from "../../../src/webmap/web/motion/inputs.js";
import { TAKE_PATIENCE, LeaseRequests, Leases } from "../../../src/webmap/web/motion/leases.js";
import { RoundTrips } from "../../../src/webmap/web/motion/round_trips.js";
import { Stream } from "../../../src/webmap/web/motion/commands.js";

const TAKE = [{ op: "take", robot: "r1" }];
const MINE = { holder: { connection: "c1", name: "me" }, mine: true, epoch: 7 };
const ANN = { holder: { connection: "c2", name: "Ann" }, epoch: 3 };
const PROGRAM = { holder: { connection: "program", name: "program" }, epoch: 3 };

/** @type {{inputs: Inputs, leases: Leases, stream: Stream, reach: LeaseRequests}} */
let it;
beforeEach(() => {
  const inputs = new Inputs(-1000);
  const leases = new Leases();
  const stream = new Stream(inputs, new RoundTrips(), 0);
  it = { inputs, leases, stream, reach: new LeaseRequests(inputs, leases, stream) };
  reportRobot("r1", {}, 0);
  it.reach.choose("r1");
});

/**
 * @param {string} robot
 * @param {object} fields
 * @param {number} now
 */
function reportRobot(robot, fields, now) {
  const free = { holder: null, mine: false, epoch: null, armable: true, latched: false };
  const report = /** @type {any} */ ({ robot, ...free, ...fields });
  it.reach.report(report, it.leases.report(report), now);
}

function press() {
  it.inputs.set("keys", { x: 1 }, 0);
  return it.reach.step(0);
}

describe("a press", () => {
  test("requests the lease of the selected robot once and drives after the grant", () => {
    assert.deepEqual(press(), TAKE);
    assert.deepEqual(it.reach.step(50), []);
    assert.equal(it.reach.robot, "r1");
    reportRobot("r1", MINE, 100);
    assert.equal(it.stream.lease?.epoch, 7);
    assert.equal(it.reach.robot, null);
    assert.equal(it.inputs.blocked, false);
  });

  test("uses an existing lease", () => {
    reportRobot("r1", MINE, 0);
    assert.deepEqual(press(), []);
    assert.equal(it.stream.lease?.robot, "r1");
  });

  test("is needed for a request, and so is a selected robot", () => {
    assert.deepEqual(it.reach.step(0), []);
    it.reach.choose(null);
    assert.deepEqual(press(), []);
    assert.equal(it.inputs.blocked, false);
  });

  const barred = {
    "another person holds": ANN,
    "cannot be armed": { armable: false },
    "was stopped": { latched: true },
  };
  for (const [how, fields] of Object.entries(barred)) {
    test(`requests nothing and blocks the inputs for a robot that ${how}`, () => {
      reportRobot("r1", fields, 0);
      assert.deepEqual(press(), []);
      assert.equal(it.inputs.blocked, true);
    });
  }

  for (const connection of ["program", "west.4f/program"]) {
    test(`that takes control from the program ${connection} does not drive yet`, () => {
      reportRobot("r1", { ...PROGRAM, holder: { connection, name: "a program" } }, 0);
      assert.deepEqual(press(), TAKE);
      reportRobot("r1", MINE, 50);
      assert.equal(it.stream.lease?.robot, "r1");
      assert.equal(it.inputs.blocked, true);
    });
  }

  test("takes no control from a person whose name is program", () => {
    reportRobot("r1", { ...ANN, holder: { connection: "c2", name: "program" } }, 0);
    assert.deepEqual(press(), []);
  });

  const endings = {
    "another was quicker": () => reportRobot("r1", ANN, 50),
    "the gate refuses": () => it.reach.refuse("r1", "take", "no", 50),
    "nobody answers": () => it.reach.step(TAKE_PATIENCE + 1),
  };
  for (const [what, happen] of Object.entries(endings)) {
    test(`is given up when ${what}`, () => {
      press();
      happen();
      assert.equal(it.reach.robot, null);
      assert.equal(it.inputs.blocked, true);
      reportRobot("r1", MINE, 60);
      assert.equal(it.stream.lease, null);
    });
  }
});

describe("a lease that was requested without a key", () => {
  test("starts with blocked inputs", () => {
    assert.deepEqual(it.reach.take("r1", 0), TAKE);
    it.inputs.set("keys", { x: 1 }, 0);
    reportRobot("r1", MINE, 50);
    assert.equal(it.stream.lease?.robot, "r1");
    assert.equal(it.inputs.blocked, true);
  });

  test("of a robot that is not selected does not drive", () => {
    it.reach.take("r2", 0);
    reportRobot("r2", MINE, 50);
    assert.equal(it.stream.lease, null);
  });

  test("does not drive if the request was ended before the grant", () => {
    it.reach.take("r1", 0);
    it.reach.end();
    reportRobot("r1", MINE, 50);
    assert.equal(it.stream.lease, null);
  });
});

describe("a lease that this page has not requested", () => {
  test("is kept without driving, with blocked inputs, and is released unused", () => {
    it.inputs.set("keys", { x: 1 }, 0);
    reportRobot("r1", MINE, 50);
    assert.equal(it.stream.lease, null);
    assert.equal(it.inputs.blocked, true);
    assert.deepEqual(it.leases.unused(50, 0), ["r1"]);
  });
});

describe("a robot whose control was requested from its operator", () => {
  beforeEach(() => {
    reportRobot("r1", ANN, 0);
    assert.deepEqual(it.reach.ask("r1"), [{ op: "ask", robot: "r1" }]);
    it.inputs.set("keys", { x: 1 }, 0);
  });

  test("starts with blocked inputs", () => {
    reportRobot("r1", MINE, 50);
    assert.equal(it.stream.lease?.robot, "r1");
    assert.equal(it.inputs.blocked, true);
  });

  test("is kept without driving if another robot was selected before the grant", () => {
    it.reach.choose("r2");
    reportRobot("r1", MINE, 50);
    assert.equal(it.stream.lease, null);
    assert.deepEqual(it.leases.unused(50, 0), ["r1"]);
  });

  const endings = {
    refused: () => it.reach.refuse("r1", "ask", "Ann keeps it", 50),
    "gone from the gate": () => it.reach.gone("r1"),
    "asked for on a connection that ended": () => it.reach.forget(),
  };
  for (const [how, happen] of Object.entries(endings)) {
    test(`is not driven by a late grant after the robot was ${how}`, () => {
      happen();
      reportRobot("r1", MINE, 60);
      assert.equal(it.stream.lease, null);
    });
  }
});

describe("a refusal", () => {
  test("is shown for the selected robot until the next request", () => {
    it.reach.refuse("r2", "take", "no", 0);
    assert.equal(it.reach.refusal, null);
    it.reach.refuse("r1", "goal", "too far", 0); // shown by the tool that sent it
    assert.equal(it.reach.refusal, null);
    it.reach.refuse("r1", "ask", "too often", 0);
    assert.deepEqual([it.reach.refusal?.text, it.reach.refusal?.what], ["too often", "ask"]);
    for (const ask of [
      () => it.reach.take("r1", 0),
      () => it.reach.ask("r1"),
      () => it.reach.reset("r1"),
      () => it.reach.reset("*"),
      () => it.reach.choose("r1"),
    ]) {
      it.reach.refuse("r1", "ask", "too often", 0);
      ask();
      assert.equal(it.reach.refusal, null);
    }
  });

  test("of a velocity command blocks the inputs with a lease and is ignored without one", () => {
    it.reach.refuse("r1", "drive", "nobody has it", 0);
    assert.equal(it.reach.refusal, null);
    press();
    reportRobot("r1", MINE, 0);
    it.reach.refuse("r1", "drive", "too old", 50);
    assert.equal(it.reach.refusal?.text, "too old");
    assert.equal(it.inputs.blocked, true);
  });

  const text = () => it.reach.refusal?.text ?? null;

  test("that another operator got control ends when that operator has it or is gone", () => {
    reportRobot("r1", MINE, 0);
    it.reach.refuse("r1", "lease", "control is handed over to Ann", 0);
    reportRobot("r1", { changing: true }, 50);
    assert.equal(text(), "control is handed over to Ann");
    reportRobot("r1", {}, 100);
    assert.equal(text(), null);
  });

  test("because of a STOP ends with the reset, or with another STOP", () => {
    for (const next of [{}, { latched: true, stop: { id: "s2" } }]) {
      reportRobot("r1", MINE, 0);
      it.reach.refuse("r1", "lease", "STOP by Ann", 0);
      reportRobot("r1", { latched: true, stop: { id: "s1" } }, 50);
      it.reach.step(60_000);
      assert.equal(text(), "STOP by Ann");
      reportRobot("r1", next, 100);
      assert.equal(text(), null);
    }
  });

  test("because of another operator ends when that operator has no control any more", () => {
    reportRobot("r1", ANN, 0);
    it.reach.refuse("r1", "take", "Ann has control", 0);
    it.reach.step(60_000);
    assert.equal(text(), "Ann has control");
    reportRobot("r1", {}, 50);
    assert.equal(text(), null);
  });

  test("without a cause in a report, or of a request, ends after 10 s", () => {
    it.reach.refuse("r1", "take", "viewers can only look", 0);
    it.reach.step(10_000);
    assert.equal(text(), "viewers can only look");
    it.reach.step(10_001);
    assert.equal(text(), null);
    reportRobot("r1", ANN, 0);
    it.reach.refuse("r1", "ask", "Ben has already requested control", 0);
    it.reach.step(10_001);
    assert.equal(text(), null);
  });
});
