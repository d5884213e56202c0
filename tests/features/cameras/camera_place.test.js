import assert from "node:assert/strict";
import { afterEach, describe, test } from "node:test";

import { nextCorner, readState, storeState } from "../../../src/webmap/features/cameras/camera_view.js";

const MEANT = { open: false, dock: "side", camera: "", x: 0, y: 0 };

/** @param {string | null} text */
function storage(text) {
  globalThis.localStorage = {
    getItem: () => text,
    setItem: (_key, value) => {
      text = value;
    },
  };
}

describe("the saved state of the camera panel", () => {
  afterEach(() => {
    delete globalThis.localStorage;
  });

  test("is restored unchanged", () => {
    storage(null);
    const kept = { open: true, dock: "float", camera: "Front", x: 0.25, y: 1 };
    storeState(kept);
    assert.deepEqual(readState(), kept);
  });

  test("has default values without storage", () => {
    assert.deepEqual(readState(), MEANT);
    storeState({ ...MEANT, open: true });
  });

  for (const text of [
    "",
    "{",
    "null",
    "7",
    "[]",
    '"open"',
    '{"open": 1, "dock": "moon", "camera": 7, "x": "0", "y": null}',
    '{"x": -1, "y": 1.5}',
    '{"x": 1e999}',
  ]) {
    test(`falls back to defaults for ${text || "nothing"}`, () => {
      storage(text);
      assert.deepEqual(readState(), MEANT);
    });
  }
});

test("the panel moves to the next corner clockwise from any position", () => {
  const round = [];
  let place = { x: 0.2, y: 0.4 };
  for (let turn = 0; turn < 5; turn++) {
    place = nextCorner(place.x, place.y);
    round.push(`${place.x}${place.y}`);
  }
  assert.deepEqual(round, ["10", "11", "01", "00", "10"]);
});
