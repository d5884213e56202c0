import assert from "node:assert/strict";
import { test } from "node:test";

import { withoutKeys } from "../../../src/webmap/features/drive/teleop.js";

const READY = { state: "ready", title: "Ready", detail: "Hold the stick. Space stops." };
const FINGERS = { touch: true, stick: true };

test("who drives with a finger is told of no key", () => {
  assert.deepEqual(withoutKeys(READY, FINGERS, "the stick"), {
    ...READY,
    detail: "Hold the stick to drive, let go to stop.",
  });
});

test("where there are keys, or no stick, nothing is said otherwise", () => {
  assert.equal(withoutKeys(READY, { touch: false, stick: true }, "it"), READY);
  assert.equal(withoutKeys(READY, { touch: true, stick: false }, "it"), READY);
});

test("only how to drive is said otherwise", () => {
  const lost = { state: "lost", title: "Connection lost", detail: "Reconnecting…" };
  assert.equal(withoutKeys(lost, FINGERS, "the stick"), lost);
});
