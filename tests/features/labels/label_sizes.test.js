import assert from "node:assert/strict";
import { test } from "node:test";

import { namesWithoutRoom } from "../../../src/webmap/features/labels/labels.js";

test("a name that overlaps an earlier visible name is hidden", () => {
  const one = { x: 100, y: 100, across: 60 };
  assert.deepEqual(namesWithoutRoom([one, { ...one, x: 150 }, { ...one, x: 170 }]), [
    false,
    true,
    false,
  ]);
  assert.deepEqual(namesWithoutRoom([one, { ...one, y: 150 }]), [false, false]);
  assert.deepEqual(namesWithoutRoom([]), []);
});

test("a hidden name does not hide other names", () => {
  const names = [0, 30, 60, 90].map((x) => ({ x, y: 0, across: 40 }));
  assert.deepEqual(namesWithoutRoom(names), [false, true, false, true]);
});
