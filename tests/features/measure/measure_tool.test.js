import assert from "node:assert/strict";
import { test } from "node:test";

import { distanceText } from "../../../src/webmap/features/measure/measure_tool.js";

test("a measurement shows the length and the angle counter-clockwise from the x axis", () => {
  const from = { x: 1, y: 1 };
  assert.equal(distanceText(from, { x: 4, y: 5 }), "5.00 m, 53\u00b0");
  assert.equal(distanceText(from, { x: 1, y: -1 }), "2.00 m, 270\u00b0");
  assert.equal(distanceText(from, from), "0.00 m, 0\u00b0");
});
