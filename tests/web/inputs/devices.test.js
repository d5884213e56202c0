import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { devicesOf } from "../../../src/webmap/web/inputs/devices.js";

let reported = [];

beforeEach(() => {
  reported = [];
  globalThis.window = new EventTarget();
  globalThis.Element = class {};
  globalThis.document = { querySelector: () => null, querySelectorAll: () => [] };
  globalThis.reportError = (error) => reported.push(error);
});

afterEach(() => {
  for (const name of ["window", "Element", "document", "reportError"]) delete globalThis[name];
});

/** A desk with these claims on Escape, pressed once; what was stopped. */
function escapeAt(...claims) {
  const stopped = [];
  const desk = devicesOf({
    status: { driven: null, taking: false, choice: "r1" },
    robots: new Map(),
    on: () => () => {},
    stop: (robot) => stopped.push(robot),
    setInput() {},
  });
  for (const claim of claims) desk.claimEscape(claim);
  const close = desk.open();
  window.dispatchEvent(Object.assign(new Event("keydown"), { code: "Escape" }));
  close();
  return stopped;
}

const fails = () => {
  throw new Error("a module of somebody's");
};

test("Escape closes an active tool, and sends STOP without an active tool", () => {
  assert.deepEqual(
    escapeAt(() => true),
    [],
  );
  assert.deepEqual(
    escapeAt(() => false),
    ["r1"],
  );
});

test("a tool that throws does not prevent STOP, and its error is reported", () => {
  assert.deepEqual(escapeAt(fails), ["r1"]);
  assert.equal(reported[0].message, "a module of somebody's");
});

test("a tool that throws does not prevent Escape for another tool", () => {
  let left = 0;
  const leaves = () => {
    left += 1;
    return true;
  };
  assert.deepEqual(escapeAt(fails, leaves), []);
  assert.equal(left, 1);
});
