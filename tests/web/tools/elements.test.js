import "./fake_elements.js";

import assert from "node:assert/strict";
import { test } from "node:test";

import { clock, stopButton } from "../../../src/webmap/web/tools/elements.js";

function makeButton() {
  const button = stopButton("own", "Stop", () => (button.stops += 1));
  button.stops = 0;
  return button;
}

test("a STOP button sends STOP on pointerdown, once per press", () => {
  const button = makeButton();
  button.fire("pointerdown", { button: 0, pointerId: 7 });
  assert.equal(button.stops, 1);
  button.fire("pointerup", { button: 0, pointerId: 7 });
  button.fire("click", { button: 0, pointerId: 7 });
  assert.equal(button.stops, 1);
});

test("a STOP button sends STOP again on the next press", () => {
  const button = makeButton();
  for (const pointerId of [7, 8, 8]) {
    button.fire("pointerdown", { button: 0, pointerId });
    button.fire("click", { button: 0, pointerId });
  }
  assert.equal(button.stops, 3);
});

test("a STOP button sends STOP on every click without a pointer", () => {
  const button = makeButton();
  button.fire("click", { pointerId: -1 });
  assert.equal(button.stops, 1);
  // The press of a second finger does not end in a click.
  button.fire("pointerdown", { button: 0, pointerId: 7 });
  button.fire("click", { pointerId: -1 });
  // Some browsers give no pointer ID for a click; one STOP too many is no harm.
  button.fire("click");
  assert.equal(button.stops, 4);
});

test("a disabled STOP button or another mouse button sends no STOP", () => {
  const button = makeButton();
  button.fire("pointerdown", { button: 2, pointerId: 1 });
  button.disabled = true;
  button.fire("pointerdown", { button: 0, pointerId: 1 });
  assert.equal(button.stops, 0);
});

test("a click after a pointerleave or without its own pointerdown sends STOP", () => {
  const button = makeButton();
  const mouse = { button: 0, pointerId: 1, pointerType: "mouse" };
  button.fire("pointerdown", mouse);
  button.fire("click", mouse);
  // While another mouse button is held, a press sends only a click event.
  button.fire("click", mouse);
  assert.equal(button.stops, 2);
  button.fire("pointerdown", mouse);
  button.fire("pointerleave", mouse);
  button.fire("click", mouse);
  assert.equal(button.stops, 4);
});

test("a time of today is shown as the time of day, another one with its date", () => {
  const now = new Date();
  now.setHours(13, 5, 9, 400);
  assert.equal(clock(now / 1000), "13:05");
  assert.equal(clock(now / 1000, true), "13:05:09");
  const other = new Date(2025, 0, 7, 3, 45, 2);
  assert.equal(clock(other / 1000), "2025-01-07 03:45");
  assert.equal(clock(other / 1000, true), "2025-01-07 03:45:02");
});
