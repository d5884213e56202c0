import assert from "node:assert/strict";
import { test } from "node:test";

import { clustersOf, roomFor, worst } from "../../src/webmap/console/robot_marks.js";

const name = (x, y, first = false) => ({ x, y, width: 60, first });

test("names that do not overlap are all shown", () => {
  assert.deepEqual(roomFor([name(0, 0), name(70, 0), name(0, 20)]), [true, true, true]);
});

test("of two names that overlap the first is shown", () => {
  assert.deepEqual(roomFor([name(0, 0), name(10, 5)]), [true, false]);
});

test("the name of the selected robot is shown even with an overlap", () => {
  assert.deepEqual(roomFor([name(0, 0), name(10, 5, true)]), [false, true]);
});

test("a name that is not shown takes no room from others", () => {
  assert.deepEqual(roomFor([name(0, 0), name(50, 0), name(100, 0)]), [true, false, true]);
});

test("an empty list of names gives an empty list", () => {
  assert.deepEqual(roomFor([]), []);
});

test("the name of the robot in the worst state takes priority", () => {
  const names = [{ ...name(0, 0), rank: 5 }, { ...name(10, 5), rank: 1 }];
  assert.deepEqual(roomFor(names), [false, true]);
});

test("two lines take more room than one", () => {
  assert.deepEqual(roomFor([{ ...name(0, 0), height: 36 }, name(0, 20)]), [true, false]);
});

const at = (x, y, alone = false) => ({ x, y, alone });

test("robots that are apart are in no cluster", () => {
  assert.deepEqual(clustersOf([at(0, 0), at(30, 0), at(0, 30)]), []);
});

test("robots that overlap are one cluster", () => {
  assert.deepEqual(clustersOf([at(0, 0), at(100, 0), at(10, 0), at(0, 0)]), [[0, 2, 3]]);
});

test("a robot that stays alone, such as the selected one, joins no cluster", () => {
  assert.deepEqual(clustersOf([at(0, 0, true), at(5, 0), at(5, 5)]), [[1, 2]]);
  assert.deepEqual(clustersOf([at(0, 0), at(5, 0, true)]), []);
});

test("a long row of robots becomes several clusters whose marks do not overlap", () => {
  const row = Array.from({ length: 30 }, (_, i) => at(20 * i, 0));
  const clusters = clustersOf(row);
  assert.ok(clusters.length > 3);
  const middles = clusters.map((all) => all.reduce((sum, i) => sum + 20 * i, 0) / all.length);
  middles.slice(1).forEach((x, i) => assert.ok(x - middles[i] >= 34, `${middles}`));
});

test("a robot beside the mark of others joins them", () => {
  assert.deepEqual(clustersOf([at(0, 0), at(10, 0), at(30, 0)]), [[0, 1, 2]]);
});

test("1000 robots are clustered in less time than a pass may take", () => {
  const many = Array.from({ length: 1000 }, (_, i) => at((i * 37) % 1400, (i * 91) % 900));
  const begin = performance.now();
  clustersOf(many);
  assert.ok(performance.now() - begin < 300);
});

test("only the worst eight of those that need someone have words", () => {
  const robots = Array.from({ length: 500 }, (_, i) => ({ rank: 500 - i, words: "Lost" }));
  robots[499].words = ""; // the worst one needs no one
  const found = worst(robots, [...robots.keys()]);
  assert.deepEqual([...found], [498, 497, 496, 495, 494, 493, 492, 491]);
  assert.equal(worst(robots, [499]).size, 0);
});
