import assert from "node:assert/strict";
import { describe, test } from "node:test";
import {
  clock,
  groupMarks,
  Position,
} from "../../../src/webmap/features/player/player_position.js";

/** @typedef {import('../../../src/webmap/features/player/player_position.js').Status} Status */
/** @typedef {import('../../../src/webmap/features/player/player_position.js').Mark} Mark */

/**
 * @param {Partial<Status>} [changes]
 * @returns {Status}
 */
function status(changes = {}) {
  const usual = { name: "office", at: 10, seconds: 60, rate: 1, playing: true };
  return { ...usual, ended: false, jumps: 0, problem: "", ...changes };
}

describe("the position", () => {
  test("moves with the rate between two messages", () => {
    const position = new Position();
    position.receive(status({ rate: 4 }), 1000);
    assert.equal(position.at(1500), 12);
  });

  test("stays while the recording is paused", () => {
    const position = new Position();
    position.receive(status({ playing: false }), 1000);
    assert.equal(position.at(1500), 10);
  });

  test("moves neither beyond the end nor long without a message", () => {
    const position = new Position();
    position.receive(status(), 0);
    assert.equal(position.at(60_000), 11);
    position.receive(status({ at: 59.9 }), 0);
    assert.equal(position.at(1000), 60);
  });

  test("is the wanted one until the replay has jumped there", () => {
    const position = new Position();
    position.receive(status(), 0);
    position.want(40, 100);
    position.receive(status({ at: 10.2 }), 200);
    assert.equal(position.at(300), 40);
    position.receive(status({ at: 40, jumps: 1 }), 400);
    assert.equal(position.at(900), 40.5);
  });

  test("is the wanted one when the replay answers the key before", () => {
    const position = new Position();
    position.receive(status({ at: 30, playing: false }), 0);
    position.want(31, 100);
    position.want(32, 110);
    position.receive(status({ at: 31, jumps: 1, playing: false }), 120);
    assert.equal(position.at(120), 32);
    position.receive(status({ at: 32, jumps: 2, playing: false }), 130);
    position.receive(status({ at: 33, jumps: 3, playing: false }), 140);
    assert.equal(position.at(140), 33, "another page may seek again");
  });

  test("is the replay's again when a seek has no effect", () => {
    const position = new Position();
    position.receive(status({ playing: false }), 0);
    position.want(40, 100);
    assert.equal(position.at(2200), 10);
  });

  test("that is wanted is inside the recording", () => {
    const position = new Position();
    position.receive(status(), 0);
    assert.equal(position.want(-2, 0), 0);
    assert.equal(position.want(Infinity, 0), 60);
  });

  test("is lost three seconds after the last message", () => {
    const position = new Position();
    assert.equal(position.lost(99_999), false);
    position.receive(status(), 0);
    assert.equal(position.lost(2900), false);
    assert.equal(position.lost(3100), true);
  });
});

describe("a time", () => {
  for (const [seconds, text] of /** @type {[number, string][]} */ ([
    [0, "0:00.0"],
    [59.96, "1:00.0"],
    [83.4, "1:23.4"],
    [3723.4, "1:02:03.4"],
    [-1, "0:00.0"],
  ])) {
    test(`of ${seconds} s is ${text}`, () => assert.equal(clock(seconds), text));
  }
});

describe("marks", () => {
  /**
   * @param {number} at
   * @param {Mark["kind"]} kind
   * @returns {Mark}
   */
  const mark = (at, kind) => ({ at, kind, text: kind });

  test("that cover one another are one group with the gravest kind", () => {
    const groups = groupMarks([mark(30, "goal"), mark(30.2, "stop"), mark(45, "alarm")], 60, 0.01);
    assert.deepEqual(groups, [
      { at: 30, fraction: 0.5, kind: "stop", text: "0:30.0 goal\n0:30.2 stop" },
      { at: 45, fraction: 0.75, kind: "alarm", text: "0:45.0 alarm" },
    ]);
  });

  test("of a large group are counted", () => {
    const marks = Array.from({ length: 9 }, () => mark(1, "alarm"));
    assert.match(groupMarks(marks, 60, 0.1)[0].text, /\nand 4 more$/);
  });

  test("of a recording without a length are at its begin", () => {
    assert.equal(groupMarks([mark(0, "goal")], 0, 0.1)[0].fraction, 0);
  });
});
