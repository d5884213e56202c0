import "./fake_elements.js";

import assert from "node:assert/strict";
import { afterEach, beforeEach, mock, test } from "node:test";

import { TwiceButton } from "../../../src/webmap/web/tools/elements.js";

let now = 0;
beforeEach(() => {
  now = 0;
  mock.method(performance, "now", () => now);
});
afterEach(() => mock.restoreAll());

/** A reset button for these robots that was pressed once, and the resets. */
function pressedOnce(robots) {
  const reset = [];
  const button = new TwiceButton("own", "Reset", "Again", (meant) => reset.push(...meant));
  button.show(true, robots);
  button.element.fire("click");
  assert.equal(button.element.textContent, "Again");
  now = 1000;
  return { button, reset };
}

test("a second press resets the robots of the first press", () => {
  const { button, reset } = pressedOnce(["r1", "r2"]);
  button.element.fire("click");
  assert.deepEqual(reset, ["r1", "r2"]);
  assert.equal(button.element.textContent, "Reset");
});

test("an added robot cancels the first press", () => {
  const { button, reset } = pressedOnce(["r1"]);
  button.show(true, ["r1", "r2"]);
  assert.equal(button.element.textContent, "Reset");
  button.element.fire("click");
  assert.deepEqual(reset, []);
});

test("a different robot cancels the first press", () => {
  const { button, reset } = pressedOnce(["r1"]);
  button.show(true, ["r2"]);
  button.element.fire("click");
  assert.deepEqual(reset, []);
});

test("after one robot is removed the second press resets the others", () => {
  const { button, reset } = pressedOnce(["r1", "r2"]);
  button.show(true, ["r2"]);
  button.element.fire("click");
  assert.deepEqual(reset, ["r2"]);
});

test("a robot that was removed and added again cancels the first press", () => {
  const { button, reset } = pressedOnce(["r1", "r2"]);
  button.show(true, ["r2"]);
  button.show(true, ["r1", "r2"]);
  button.element.fire("click");
  assert.deepEqual(reset, []);
});
