import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { Leases } from "../../../src/webmap/web/motion/leases.js";

/** @type {Leases} */
let leases;
beforeEach(() => {
  leases = new Leases();
});

/**
 * @param {string} robot
 * @param {boolean} mine
 * @param {number | null} epoch
 */
function reportRobot(robot, mine, epoch) {
  return leases.report(/** @type {any} */ ({ robot, mine, epoch }));
}

test("only a lease of this page has an epoch", () => {
  assert.equal(leases.epoch("r1"), null);
  reportRobot("r1", true, 7);
  assert.equal(leases.epoch("r1"), 7);
  reportRobot("r1", false, 8);
  assert.equal(leases.epoch("r1"), null);
});

test("a released lease is accepted again only with another epoch", () => {
  reportRobot("r1", true, 7);
  leases.giveBack("r1", 7);
  reportRobot("r1", true, 7);
  assert.equal(leases.epoch("r1"), null);
  reportRobot("r1", true, 9);
  assert.equal(leases.epoch("r1"), 9);
});

test("report() returns the previous report", () => {
  assert.equal(reportRobot("r1", false, null), undefined);
  assert.equal(reportRobot("r1", true, 3)?.mine, false);
});

test("a parked lease is unused after a time without use", () => {
  leases.park("r1", 0);
  leases.park("r2", 0);
  leases.use("r2", 600);
  leases.use("r3", 600);
  assert.deepEqual(leases.unused(999, 1000), []);
  assert.deepEqual(leases.unused(1000, 1000), ["r1"]);
  assert.deepEqual(leases.unused(1600, 1000), ["r1", "r2"]);
});

test("a lease that ended in any way is no longer parked", () => {
  for (const end of [
    () => leases.unpark("r1"),
    () => leases.unpark("*"),
    () => leases.gone("r1"),
    () => leases.forget(),
    () => reportRobot("r1", false, null),
  ]) {
    leases.park("r1", 0);
    end();
    assert.deepEqual(leases.unused(1000, 1000), []);
  }
});

test("all leases end with the connection, and robots stay known", () => {
  reportRobot("r1", true, 7);
  leases.forget();
  assert.equal(leases.epoch("r1"), null);
  assert.deepEqual([...leases.robots.keys()], ["r1"]);
});

test("a gone robot and its lease are removed", () => {
  reportRobot("r1", true, 7);
  leases.gone("r1");
  assert.equal(leases.robots.size, 0);
  assert.equal(leases.epoch("r1"), null);
});
