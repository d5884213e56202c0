import assert from "node:assert/strict";
import { test } from "node:test";

import { lengthText, roundLength } from "../../../src/webmap/features/view/scale_bar.js";

test("the bar is a round length, and between two fifths of the room and all of it", () => {
  for (let scale = 0.01; scale < 1e5; scale *= 1.07) {
    const length = roundLength(scale, 120);
    assert.match(length.toExponential(6), /^[125]\.0+e/);
    assert.ok(length * scale <= 120 * 1.000001 && length * scale >= 120 * 0.4);
  }
});

test("a scale that makes no sense has no bar", () => {
  for (const scale of [0, -1, NaN, Infinity])
    assert.equal(roundLength(scale, 120), null);
});

test("lengths read well", () => {
  assert.deepEqual([0.002, 0.5, 1, 20, 5000].map(lengthText), [
    "2 mm",
    "50 cm",
    "1 m",
    "20 m",
    "5 km",
  ]);
});
