import assert from "node:assert/strict";
import { test } from "node:test";

import { axesOf } from "../../../src/webmap/web/inputs/keys.js";

const cases = [
  [["KeyW"], { x: 1, y: 0, turn: 0 }],
  [["KeyS"], { x: -1, y: 0, turn: 0 }],
  [["KeyA"], { x: 0, y: 0, turn: 1 }],
  [["KeyD"], { x: 0, y: 0, turn: -1 }],
  [["ArrowUp", "ArrowLeft"], { x: 1, y: 0, turn: 1 }],
  [["KeyW", "ArrowUp"], { x: 1, y: 0, turn: 0 }],
  [["KeyW", "KeyS"], { x: 0, y: 0, turn: 0 }],
  [["KeyX", "toString"], { x: 0, y: 0, turn: 0 }],
  [[], { x: 0, y: 0, turn: 0 }],
];

for (const [codes, axes] of cases) {
  test(`${codes.join(" and ") || "no key"} asks for ${JSON.stringify(axes)}`, () => {
    assert.deepEqual(axesOf(codes), axes);
  });
}

test("A turns counter-clockwise also in reverse", () => {
  assert.deepEqual(axesOf(["KeyS", "KeyA"]), { x: -1, y: 0, turn: 1 });
});

test("Q and E move only a holonomic base sideways", () => {
  assert.deepEqual(axesOf(["KeyQ"]), { x: 0, y: 0, turn: 0 });
  assert.deepEqual(axesOf(["KeyQ"], { holonomic: true }), { x: 0, y: 1, turn: 0 });
  assert.deepEqual(axesOf(["KeyE"], { holonomic: true }), { x: 0, y: -1, turn: 0 });
});
