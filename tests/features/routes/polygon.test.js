import assert from "node:assert/strict";
import { test } from "node:test";

import {
  contains,
  isLineInside,
  LEAST_AREA,
  longestSide,
  MOST_CORNERS,
  problemOf,
  withoutRepetitions,
} from "../../../src/webmap/features/routes/polygon.js";
import { placed } from "./areas.js";

const ONE_BAY = placed([
  [0, 0],
  [6, 0],
  [6, 4],
  [4, 4],
  [4, 2],
  [2, 2],
  [2, 4],
  [0, 4],
]);

test("an area with a bay is valid, clockwise and counter-clockwise", () => {
  assert.equal(problemOf(ONE_BAY), "");
  assert.equal(problemOf([...ONE_BAY].reverse()), "");
});

for (const [what, corners, problem] of [
  ["one corner", [[0, 0]], "Got 1 corner, expected at least 3. Add corners."],
  [
    "two corners",
    [
      [0, 0],
      [1, 0],
    ],
    "Got 2 corners, expected at least 3. Add corners.",
  ],
  [
    "sides that cross",
    [
      [0, 0],
      [4, 0],
      [0, 4],
      [4, 4],
    ],
    "Sides 2 and 4 cross or touch: sides may meet only at corners. Move a corner.",
  ],
  [
    "a corner on another side",
    [
      [0, 0],
      [4, 0],
      [4, 4],
      [2, 0],
      [0, 4],
    ],
    "Sides 1 and 3 cross or touch: sides may meet only at corners. Move a corner.",
  ],
  [
    "a side that goes back along the one before",
    [
      [0, 0],
      [4, 0],
      [4, 3],
      [4, 1],
      [0, 1],
    ],
    "Sides 2 and 4 cross or touch: sides may meet only at corners. Move a corner.",
  ],
  [
    "three corners on a line",
    [
      [0, 0],
      [2, 0],
      [5, 0],
    ],
    `Got 0.00 m², expected at least ${LEAST_AREA} m². Use a larger area.`,
  ],
  [
    "next to nothing",
    [
      [0, 0],
      [0.2, 0],
      [0.2, 0.2],
      [0, 0.2],
    ],
    `Got 0.04 m², expected at least ${LEAST_AREA} m². Use a larger area.`,
  ],
]) {
  test(`${what}: the area is refused with a reason`, () => {
    assert.equal(problemOf(placed(corners)), problem);
  });
}

test("too many corners are refused with their number and the limit", () => {
  const around = (count) =>
    placed(
      Array.from({ length: count }, (_, i) => [
        9 * Math.cos((2 * Math.PI * i) / count),
        9 * Math.sin((2 * Math.PI * i) / count),
      ]),
    );
  assert.equal(problemOf(around(MOST_CORNERS)), "");
  assert.equal(
    problemOf(around(MOST_CORNERS + 1)),
    `Got ${MOST_CORNERS + 1} corners, expected at most ${MOST_CORNERS}. Use fewer corners.`,
  );
});

test("repeated corners are merged, including the first and the last", () => {
  const pressed = placed([
    [0, 0],
    [4, 0],
    [4, 0.001],
    [4, 3],
    [0.002, 0],
  ]);
  assert.deepEqual(withoutRepetitions(pressed), [pressed[0], pressed[1], pressed[3]]);
});

test("the direction is that of the first longest side", () => {
  assert.equal(longestSide(ONE_BAY), 0);
  const tall = placed([
    [0, 0],
    [2, 0],
    [2, 5],
    [0, 5],
  ]);
  assert.equal(longestSide(tall), Math.PI / 2);
});

test("points on an edge are inside the area, points in a bay are outside", () => {
  assert.ok(contains(ONE_BAY, { x: 1, y: 3 }));
  assert.ok(contains(ONE_BAY, { x: 6, y: 1 }));
  assert.ok(contains(ONE_BAY, { x: 2, y: 2 }));
  assert.ok(!contains(ONE_BAY, { x: 3, y: 3 }));
  assert.ok(!contains(ONE_BAY, { x: -1, y: 2 }));
});

test("a line along a side or past a corner is inside the area, a line across a bay is not", () => {
  assert.ok(isLineInside(ONE_BAY, { x: 2, y: 2 }, { x: 4, y: 2 }));
  assert.ok(isLineInside(ONE_BAY, { x: 1, y: 1 }, { x: 3, y: 2 }));
  assert.ok(isLineInside(ONE_BAY, { x: 0, y: 2 }, { x: 6, y: 2 }));
  assert.ok(!isLineInside(ONE_BAY, { x: 1, y: 3 }, { x: 5, y: 3 }));
  assert.ok(!isLineInside(ONE_BAY, { x: 2, y: 4 }, { x: 4, y: 4 }));
  assert.ok(!isLineInside(ONE_BAY, { x: 1, y: 1 }, { x: 7, y: 1 }));
});
