import assert from "node:assert/strict";
import { test } from "node:test";

import {
  arranged,
  AT_FIRST,
  countsOf,
  isShown,
  MANY,
  nextNeed,
} from "../../src/webmap/console/robot_list.js";

const GROUPS = ["lost", "stopped", "free"];

/** @param {Record<string, unknown>} [changes] */
function robot(name, group = "free", changes = {}) {
  const rank = GROUPS.indexOf(group);
  return { name, group, rank, tag: "", bridge: "", charge: null, added: 0, ...changes };
}

const names = (robots, choice) =>
  arranged(robots, { ...AT_FIRST, ...choice }).map((group) => [
    group.name,
    ...group.robots.map(({ name }) => name),
  ]);

test("the worst states come first, robots of one state in natural order", () => {
  const robots = [robot("r 10"), robot("r 2"), robot("z", "lost"), robot("a", "stopped")];
  assert.deepEqual(names(robots, { order: "state" }), [["", "z", "a", "r 2", "r 10"]]);
});

test("the lowest charge comes first, an unknown charge last", () => {
  const robots = [robot("a"), robot("b", "free", { charge: 80 }), robot("c", "free", { charge: 5 })];
  assert.deepEqual(names(robots, { order: "battery" }), [["", "c", "b", "a"]]);
});

test("a short list keeps the order in which robots were added, a long one does not", () => {
  const robots = Array.from({ length: MANY }, (_, i) => robot(`r ${99 - i}`, "free", { added: i }));
  robots.push(robot("bad", "lost", { added: MANY }));
  assert.equal(names(robots.slice(0, MANY))[0][1], "r 99");
  assert.equal(names(robots)[0][1], "bad");
});

test("twins keep the order in which they were added", () => {
  const twins = [robot("t", "free", { added: 2 }), robot("t", "free", { added: 1 })];
  const [{ robots }] = arranged(twins, { ...AT_FIRST, order: "name" });
  assert.deepEqual(robots.map(({ added }) => added), [1, 2]);
});

test("groups are in natural order, robots without one come last", () => {
  const robots = [
    robot("a"),
    robot("b", "free", { tag: "bay 10" }),
    robot("c", "free", { tag: "bay 2" }),
    robot("d", "lost", { tag: "bay 10" }),
  ];
  const wanted = [["bay 2", "c"], ["bay 10", "d", "b"], ["No tag", "a"]];
  assert.deepEqual(names(robots, { order: "state", group: "tag" }), wanted);
});

test("robots are counted by state, a chosen state without robots too", () => {
  const robots = [robot("a"), robot("b", "stopped"), robot("c")];
  assert.deepEqual(countsOf(robots, ["lost"]), [
    { group: "stopped", count: 1 },
    { group: "free", count: 2 },
    { group: "lost", count: 0 },
  ]);
});

test("a robot is shown if its name and its state are wanted", () => {
  assert.ok(isShown(robot("Robot 1"), " ROBOT", []));
  assert.ok(isShown(robot("Robot 1", "lost"), "", ["lost", "stopped"]));
  assert.ok(!isShown(robot("Robot 1"), "", ["lost"]));
  assert.ok(!isShown(robot("Robot 1"), "2", []));
});

test("nothing that compares names in a language is made while modules load", async (t) => {
  const made = t.mock.method(Intl, "Collator");
  await import("../../src/webmap/console/robot_list.js?again");
  assert.equal(made.mock.callCount(), 0);
});

test("N goes round the robots that need someone, in both directions", () => {
  const robots = ["each", "", "each", ""].map((need) => ({ group: "stopped", need }));
  assert.equal(nextNeed(robots, -1, 1), 0);
  assert.equal(nextNeed(robots, 0, 1), 2);
  assert.equal(nextNeed(robots, 1, 1), 2);
  assert.equal(nextNeed(robots, 2, 1), 0);
  assert.equal(nextNeed(robots, 0, -1), 2);
  assert.equal(nextNeed(robots, 3, -1), 2);
});

test("N finds no other robot where none or only the selected one needs someone", () => {
  assert.equal(nextNeed([], -1, 1), -1);
  assert.equal(nextNeed([{ group: "free", need: "" }], 0, 1), -1);
  assert.equal(nextNeed([{ group: "lost", need: "each" }], 0, 1), -1);
});

test("thirty robots with the fault of one bridge are one robot for N", () => {
  const fault = { group: "without a connection to hall", need: "one" };
  const robots = [...Array(30).fill(fault), { group: "stopped", need: "each" }];
  assert.equal(nextNeed(robots, -1, 1), 0);
  assert.equal(nextNeed(robots, 0, 1), 30);
  assert.equal(nextNeed(robots, 30, 1), 0);
});
