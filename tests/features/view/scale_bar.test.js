import assert from "node:assert/strict";
import { test } from "node:test";

import { lengthText, roundLength } from "../../../src/webmap/features/view/scale_bar.js";

test("the bar has a round length and fills 40 to 100 percent of the available width", () => {
  for (let scale = 0.01; scale < 1e5; scale *= 1.07) {
    const length = roundLength(scale, 120);
    assert.match(length.toExponential(6), /^[125]\.0+e/);
    assert.ok(length * scale <= 120 * 1.000001 && length * scale >= 120 * 0.4);
  }
});

test("an invalid scale has no bar", () => {
  for (const scale of [0, -1, NaN, Infinity])
    assert.equal(roundLength(scale, 120), null);
});

test("lengths are shown in mm, cm, m or km", () => {
  assert.deepEqual([0.002, 0.5, 1, 20, 5000].map(lengthText), [
    "2 mm",
    "50 cm",
    "1 m",
    "20 m",
    "5 km",
  ]);
});
