import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { Inputs } from "../../../src/webmap/web/motion/inputs.js";
import { Leases } from "../../../src/webmap/web/motion/leases.js";
import { Loop } from "../../../src/webmap/web/motion/loop.js";
import { LeaseRequests, TAKE_PATIENCE } from "../../../src/webmap/web/motion/lease_requests.js";
import { Stream } from "../../../src/webmap/web/motion/stream.js";

const TAKE = [{ op: "take", robot: "r1" }];
const MINE = { holder: { connection: "c1", name: "me" }, mine: true, epoch: 7 };
const ANN = { holder: { connection: "c2", name: "Ann" }, epoch: 3 };
const PROGRAM = { holder: { connection: "program", name: "program" }, epoch: 3 };

/** @type {{inputs: Inputs, leases: Leases, stream: Stream, reach: LeaseRequests}} */
let it;
beforeEach(() => {
  const inputs = new Inputs(-1000);
  const leases = new Leases();
  const stream = new Stream(inputs, new Loop(), 0);
  it = { inputs, leases, stream, reach: new LeaseRequests(inputs, leases, stream) };
  say("r1", {}, 0);
  it.reach.choose("r1");
});

/**
 * @param {string} robot
 * @param {object} fields
 * @param {number} now
 */
function say(robot, fields, now) {
  const free = { holder: null, mine: false, epoch: null, armable: true, latched: false };
  const report = /** @type {any} */ ({ robot, ...free, ...fields });
  it.reach.report(report, it.leases.report(report), now);
}

function press() {
  it.inputs.set("keys", { x: 1 }, 0);
  return it.reach.step(0);
}

describe("a press", () => {
  test("asks for the chosen robot once, and drives it when it comes", () => {
    assert.deepEqual(press(), TAKE);
    assert.deepEqual(it.reach.step(50), []);
    assert.equal(it.reach.robot, "r1");
    say("r1", MINE, 100);
    assert.equal(it.stream.lease?.epoch, 7);
    assert.equal(it.reach.robot, null);
    assert.equal(it.inputs.blocked, false);
  });

  test("uses a lease that is there already", () => {
    say("r1", MINE, 0);
    assert.deepEqual(press(), []);
    assert.equal(it.stream.lease?.robot, "r1");
  });

  test("reaches for nothing where nothing is chosen, or nothing is held", () => {
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
    test(`means nothing for a robot that ${how}`, () => {
      say("r1", fields, 0);
      assert.deepEqual(press(), []);
      assert.equal(it.inputs.blocked, true);
    });
  }

  test("that takes over from a program does not drive yet", () => {
    say("r1", PROGRAM, 0);
    assert.deepEqual(press(), TAKE);
    say("r1", MINE, 50);
    assert.equal(it.stream.lease?.robot, "r1");
    assert.equal(it.inputs.blocked, true);
  });

  const endings = {
    "another was quicker": () => say("r1", ANN, 50),
    "the gate refuses": () => it.reach.refuse("r1", "take", "no", 50),
    "nobody answers": () => it.reach.step(TAKE_PATIENCE + 1),
  };
  for (const [what, happen] of Object.entries(endings)) {
    test(`is given up when ${what}`, () => {
      press();
      happen();
      assert.equal(it.reach.robot, null);
      assert.equal(it.inputs.blocked, true);
      say("r1", MINE, 60);
      assert.equal(it.stream.lease, null);
    });
  }
});

describe("a lease that was asked for by name", () => {
  test("comes with inputs that are dead", () => {
    assert.deepEqual(it.reach.take("r1", 0), TAKE);
    it.inputs.set("keys", { x: 1 }, 0);
    say("r1", MINE, 50);
    assert.equal(it.stream.lease?.robot, "r1");
    assert.equal(it.inputs.blocked, true);
  });

  test("of another robot than the chosen one does not drive", () => {
    it.reach.take("r2", 0);
    say("r2", MINE, 50);
    assert.equal(it.stream.lease, null);
  });

  test("is waited for no more when that was ended", () => {
    it.reach.take("r1", 0);
    it.reach.end();
    say("r1", MINE, 50);
    assert.equal(it.stream.lease, null);
  });
});

describe("a robot that its holder was asked for", () => {
  beforeEach(() => {
    say("r1", ANN, 0);
    assert.deepEqual(it.reach.ask("r1"), [{ op: "ask", robot: "r1" }]);
    it.inputs.set("keys", { x: 1 }, 0);
  });

  test("comes with inputs that are dead", () => {
    say("r1", MINE, 50);
    assert.equal(it.stream.lease?.robot, "r1");
    assert.equal(it.inputs.blocked, true);
  });

  test("is kept for later if the operator has turned to another", () => {
    it.reach.choose("r2");
    say("r1", MINE, 50);
    assert.equal(it.stream.lease, null);
    assert.deepEqual(it.leases.unused(50, 0), ["r1"]);
  });

  const endings = {
    refused: () => it.reach.refuse("r1", "ask", "Ann keeps it", 50),
    "gone from the gate": () => it.reach.gone("r1"),
    "asked for on a connection that ended": () => it.reach.forget(),
  };
  for (const [how, happen] of Object.entries(endings)) {
    test(`is waited for no more when it was ${how}`, () => {
      happen();
      say("r1", MINE, 60);
      assert.equal(it.stream.lease, null);
    });
  }
});

describe("a refusal", () => {
  test("is shown of the chosen robot, until something else is asked for", () => {
    it.reach.refuse("r2", "take", "no", 0);
    assert.equal(it.reach.refusal, null);
    it.reach.refuse("r1", "goal", "too far", 0); // shown by the tool that sent it
    assert.equal(it.reach.refusal, null);
    it.reach.refuse("r1", "ask", "too often", 0);
    assert.deepEqual([it.reach.refusal, it.reach.refused], ["too often", "ask"]);
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

  test("of a command is a doubt while there is a lease, and no news without", () => {
    it.reach.refuse("r1", "drive", "nobody has it", 0);
    assert.equal(it.reach.refusal, null);
    press();
    say("r1", MINE, 0);
    it.reach.refuse("r1", "drive", "too old", 50);
    assert.equal(it.reach.refusal, "too old");
    assert.equal(it.inputs.blocked, true);
  });
});
