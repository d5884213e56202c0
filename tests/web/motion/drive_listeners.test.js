import assert from "node:assert/strict";
import { test } from "node:test";

import { DriveListeners } from "../../../src/webmap/web/motion/session.js";

test("a listener receives its events until its removal", () => {
  const listeners = new DriveListeners();
  /** @type {string[]} */
  const received = [];
  const end = listeners.on("stop", (robot) => received.push(robot));
  listeners.emit("stop", "r1");
  listeners.emit("gone", "r2");
  end();
  listeners.emit("stop", "r3");
  assert.deepEqual(received, ["r1"]);
});

test("an error in a listener is reported and does not affect other listeners", () => {
  /** @type {unknown[]} */
  const reported = [];
  globalThis.reportError = (error) => reported.push(error);
  const listeners = new DriveListeners();
  const failure = new Error("broken display");
  const received = [];
  listeners.on("drop", () => {
    throw failure;
  });
  listeners.on("drop", () => received.push("drop"));
  listeners.emit("drop", null);
  assert.deepEqual(received, ["drop"]);
  assert.deepEqual(reported, [failure]);
});
