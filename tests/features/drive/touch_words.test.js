import assert from "node:assert/strict";
import { test } from "node:test";

import { withoutKeys } from "../../../src/webmap/features/drive/teleop.js";

const READY = { state: "ready", title: "Ready", detail: "Hold the stick. Space stops." };
const FINGERS = { touch: true, stick: true };

test("the hint for driving by touch names no keys", () => {
  assert.deepEqual(withoutKeys(READY, FINGERS, "the stick"), {
    ...READY,
    detail: "Hold the stick to drive. Release to stop.",
  });
});

test("the hint is unchanged without touch or without a stick", () => {
  assert.equal(withoutKeys(READY, { touch: false, stick: true }, "it"), READY);
  assert.equal(withoutKeys(READY, { touch: true, stick: false }, "it"), READY);
});

test("the text of another state is unchanged for driving by touch", () => {
  const lost = { state: "lost", title: "No connection to WebMap", detail: "Reconnecting…" };
  assert.equal(withoutKeys(lost, FINGERS, "the stick"), lost);
});
