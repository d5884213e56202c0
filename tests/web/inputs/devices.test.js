import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { devicesOf } from "../../../src/webmap/web/inputs/devices.js";

let reported = [];

beforeEach(() => {
  reported = [];
  globalThis.window = new EventTarget();
  globalThis.Element = class {};
  globalThis.document = {
    getElementsByTagName: () => [],
    querySelector: () => null,
    querySelectorAll: () => [],
  };
  globalThis.reportError = (error) => reported.push(error);
});

afterEach(() => {
  for (const name of ["window", "Element", "document", "reportError"]) delete globalThis[name];
});

/** Press Escape once with these claims on it, and return what was stopped. */
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

/**
 * Press a key on a page with this status, and return the resulting inputs of the page.
 *
 * @param {object} status
 * @param {(event: Event) => boolean} use The key handler of a tool.
 */
function keyAt(status, use) {
  const inputs = [];
  const desk = devicesOf({
    status: { driven: null, taking: false, choice: "r1", ...status },
    robots: new Map(),
    on: () => () => {},
    stop() {},
    choose() {},
    goNeutral() {},
    setInput: (name, axes) => inputs.push(axes),
  });
  Object.assign(document, { visibilityState: "visible", hasFocus: () => true, activeElement: null });
  const remove = desk.addMap({ map: {}, robot: () => "r1", holonomic: false, onActive() {} });
  desk.claimKeys(use);
  const key = { code: "ArrowUp", key: "ArrowUp" };
  window.dispatchEvent(Object.assign(new Event("keydown"), key));
  const held = inputs.at(-1);
  remove();
  return held ?? null;
}

test("a key that a tool uses drives no robot", () => {
  assert.equal(
    keyAt({}, () => true),
    null,
  );
  assert.equal(keyAt({}, () => false)?.x, 1);
});

test("no tool uses a key while another input is held", () => {
  const never = () => assert.fail("the tool was asked");
  assert.equal(keyAt({ driven: "r1", pressed: true }, never)?.x, 1);
  assert.equal(keyAt({ taking: true, pressed: true }, never)?.x, 1);
  assert.deepEqual(reported, []);
});

test("a tool uses a key under control of a robot while no input is held", () => {
  assert.equal(
    keyAt({ driven: "r1", pressed: false }, () => true),
    null,
  );
});

test("a key drives although a tool fails", () => {
  assert.equal(keyAt({}, fails)?.x, 1);
  assert.equal(reported.length, 1);
});
