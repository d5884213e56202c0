import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { watchAttention } from "../../../src/webmap/web/inputs/focus.js";

beforeEach(() => {
  globalThis.window = new EventTarget();
  globalThis.document = new EventTarget();
});

afterEach(() => {
  delete globalThis.window;
  delete globalThis.document;
});

/** Watch the attention during a drag, and return the number of doubts. */
function doubtsOfDrag() {
  let doubts = 0;
  const stop = watchAttention(
    () => (doubts += 1),
    () => {},
  );
  const drag = () => window.dispatchEvent(new Event("dragstart", { cancelable: true }));
  drag();
  stop();
  drag();
  return doubts;
}

test("dragging an element is reported as lost attention", () => {
  assert.equal(doubtsOfDrag(), 1);
});

test("a prevented drag is not reported as lost attention", () => {
  window.addEventListener("dragstart", (event) => event.preventDefault());
  assert.equal(doubtsOfDrag(), 0);
});
