import assert from "node:assert/strict";
import { test } from "node:test";
import { onBeat } from "../../../src/webmap/web/tools/elements.js";

test("functions of one beat are called by one timer, each in its period", (t) => {
  t.mock.timers.enable({ apis: ["setInterval"] });
  const errors = [];
  globalThis.reportError = (error) => errors.push(error.message);
  const called = [];
  const offs = [
    onBeat(() => called.push("each")),
    onBeat(() => {
      throw new Error("broken");
    }, 4),
    onBeat(() => called.push("every other"), 2),
  ];
  t.mock.timers.tick(1000);
  assert.equal(called.filter((name) => name === "each").length, 4);
  assert.equal(called.filter((name) => name === "every other").length, 2);
  assert.deepEqual(errors, ["broken"]);
  for (const off of offs) off();
  t.mock.timers.tick(1000);
  assert.equal(called.length, 6);
});
