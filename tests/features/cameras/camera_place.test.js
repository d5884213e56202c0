import assert from "node:assert/strict";
import { afterEach, describe, test } from "node:test";

import {
  cameraAt,
  nextCamera,
  nextCorner,
  placeOf,
  readState,
  storeState,
} from "../../../src/webmap/features/cameras/camera_view.js";

const MEANT = {
  open: false,
  dock: "side",
  camera: "",
  x: 0,
  y: 0,
  wall: false,
  cells: [],
};

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
    const cells = [{ robot: "a", name: "Al", camera: "Front", id: 4 }];
    const place = { dock: "float", x: 0.25, y: 1 };
    const kept = { ...MEANT, ...place, open: true, camera: "Front", wall: true, cells };
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
    '{"wall": 1, "cells": "Front"}',
    '{"cells": [null, 7, {}, {"robot": "a", "name": "Al", "camera": 1, "id": 2}]}',
  ]) {
    test(`falls back to defaults for ${text || "nothing"}`, () => {
      storage(text);
      assert.deepEqual(readState(), MEANT);
    });
  }
});

test("no more than four cameras of a wall are restored", () => {
  const cell = { robot: "a", name: "Al", camera: "Front", id: 4 };
  storage(JSON.stringify({ cells: Array(9).fill(cell) }));
  assert.equal(readState().cells.length, 4);
  delete globalThis.localStorage;
});

describe("the cameras of a wall", () => {
  const robots = [
    { robot: "a", name: "Al", cameras: [{ id: 1, name: "Front" }, { id: 2, name: "Front" }] },
    { robot: "b", name: "Bob", cameras: [{ id: 3, name: "Front" }] },
    { robot: "c", name: "Cid", cameras: [{ id: 4, name: "Rear" }] },
  ];

  test("are found by the robot and the name, and by the id if names are equal", () => {
    const place = placeOf(robots, 2);
    assert.deepEqual(place, { robot: "a", name: "Al", camera: "Front", id: 2 });
    assert.equal(cameraAt(robots, place).camera.id, 2);
    // After a restart the ids are those of other cameras.
    assert.equal(cameraAt(robots, { ...place, id: 3 }).camera.id, 1);
    assert.equal(cameraAt([], place).camera, null);
    assert.equal(placeOf(robots, 9), null);
  });

  test("begin with the selected robot, and show each robot before another camera", () => {
    const targets = [];
    for (const id of [3, 1, 4, 2]) {
      const next = nextCamera(robots, targets, "b");
      assert.equal(next.id, id);
      targets.push(cameraAt(robots, next));
    }
    assert.equal(nextCamera(robots, targets, "b"), null);
  });
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
