import assert from "node:assert/strict";
import { test } from "node:test";

import {
  between,
  matrixOf,
  moved,
  normal,
  rounded,
  turned,
} from "../../../src/webmap/features/align/align_drawing.js";
import { apply, multiply } from "../../../src/webmap/web/view.js";

function near(actual, expected) {
  assert.ok(Math.abs(actual - expected) < 1e-9, `${actual} is not near ${expected}`);
}

test("the transform between two alignments maps one onto the other", () => {
  const [before, now] = [
    { x: 3, y: -1, angle: 20 },
    { x: -7, y: 4, angle: 130 },
  ];
  const there = multiply(between(before, now), matrixOf(before));
  for (const [x, y] of [[0, 0], [2, 1], [-5, 9]]) {
    const [got, wanted] = [apply(there, x, y), apply(matrixOf(now), x, y)];
    near(got.x, wanted.x);
    near(got.y, wanted.y);
  }
});

test("a rotation keeps its centre in place", () => {
  const before = { x: 3, y: -1, angle: 170 };
  const now = turned(before, 35, { x: 6, y: 2 });
  const point = apply(between(before, now), 6, 2);
  near(point.x, 6);
  near(point.y, 2);
  near(now.angle, -155);
});

test("a move follows the axes of the common map at any angle of the moved map", () => {
  assert.deepEqual(moved({ x: 1, y: 2, angle: 90 }, 0.5, -1), {
    x: 1.5,
    y: 1,
    angle: 90,
  });
});

test("angles wrap to at most 180 degrees, and values are rounded for saving", () => {
  assert.deepEqual([190, -190, 540, 180].map(normal), [-170, 170, 180, 180]);
  assert.deepEqual(rounded({ x: 1.23456, y: -0.0001, angle: 359.999 }), {
    x: 1.235,
    y: 0,
    angle: 0,
  });
});
