import assert from "node:assert/strict";
import { test } from "node:test";

import { Listeners } from "../../../src/webmap/web/motion/drive_events.js";

test("a listener receives its events until its removal", () => {
  const listeners = new Listeners();
  /** @type {string[]} */
  const heard = [];
  const end = listeners.on("stop", (robot) => heard.push(robot));
  listeners.emit("stop", "r1");
  listeners.emit("gone", "r2");
  end();
  listeners.emit("stop", "r3");
  assert.deepEqual(heard, ["r1"]);
});

test("an error in a listener is reported and does not affect other listeners", () => {
  /** @type {unknown[]} */
  const reported = [];
  globalThis.reportError = (error) => reported.push(error);
  const listeners = new Listeners();
  const failure = new Error("broken display");
  const heard = [];
  listeners.on("drop", () => {
    throw failure;
  });
  listeners.on("drop", () => heard.push("drop"));
  listeners.emit("drop", null);
  assert.deepEqual(heard, ["drop"]);
  assert.deepEqual(reported, [failure]);
});
