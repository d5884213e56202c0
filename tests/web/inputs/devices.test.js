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
    moves: () => false,
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
    moves: () => false,
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

/**
 * Press a key on a page, and return what was stopped.
 *
 * @param {object} key
 * @param {{target?: object, before?: string[], drives?: boolean}} [where] `target`: the
 *     focused element; `before`: earlier events, such as "pointerdown" or "Tab".
 */
function stoppedAt(key, { target = null, before = [], drives = false } = {}) {
  const stopped = [];
  const desk = devicesOf({
    status: { driven: null, taking: false, choice: "r1" },
    drives,
    moves: () => drives,
    robots: new Map(),
    on: () => () => {},
    stop: (robot) => stopped.push(robot),
    goNeutral() {},
    setInput() {},
  });
  const close = desk.open();
  const dispatch = (kind, fields) => {
    const event = new Event(kind, { cancelable: true });
    Object.defineProperty(event, "target", { value: target });
    window.dispatchEvent(Object.assign(event, fields));
    return event.defaultPrevented;
  };
  for (const each of before) {
    if (each === "pointerdown") dispatch(each, {});
    else dispatch("keydown", { key: each, code: each });
  }
  const down = dispatch("keydown", key);
  const up = dispatch("keyup", key);
  close();
  return { stopped, prevented: [down, up] };
}

const STOPS = [
  [{ code: "", key: "Escape" }, ["r1"]],
  [{ code: "", key: "Esc" }, ["r1"]],
  [{ code: "", key: "Escape", shiftKey: true }, ["*"]],
  [{ code: "", key: " " }, ["r1"]],
  [{ code: "", key: " ", shiftKey: true }, ["r1"]],
  [{ code: "", key: "\u00a0", shiftKey: true }, ["r1"]],
  [{ code: "", key: "Spacebar" }, ["r1"]],
  [{ code: "CapsLock", key: "Escape" }, ["r1"]],
  [{ code: "Space", key: "Unidentified" }, ["r1"]],
  [{ code: "", key: " ", ctrlKey: true }, []],
  [{ code: "", key: "Escape", altKey: true }, []],
  [{ code: "", key: " ", metaKey: true }, []],
  [{ code: "", key: " ", isComposing: true }, []],
  [{ code: "", key: "Unidentified" }, []],
];
for (const [key, robots] of STOPS) {
  test(`${JSON.stringify(key)} stops ${robots.join() || "nothing"}`, () => {
    assert.deepEqual(stoppedAt(key).stopped, robots);
  });
}

const SPACE = { code: "Space", key: " " };

/** A focused element that matches one of these selectors. */
function element(matched) {
  return Object.assign(new Element(), {
    matches: (selectors) => selectors.includes(matched),
    closest: () => null,
  });
}

test("Space is STOP on a check box unless the Tab key moved the focus after the pointer", () => {
  globalThis.HTMLInputElement = globalThis.HTMLElement = class {};
  const target = element("input[type=checkbox]");
  const at = (...before) => stoppedAt(SPACE, { target, before }).stopped;
  assert.deepEqual(at("pointerdown"), ["r1"]);
  assert.deepEqual(at("pointerdown", "KeyW"), ["r1"]);
  assert.deepEqual(at("Tab", "pointerdown"), ["r1"]);
  assert.deepEqual(at("pointerdown", "Tab"), []);
  assert.deepEqual(stoppedAt(SPACE, { target, before: ["Tab"], drives: true }).stopped, ["r1"]);
});

test("Space types in a text field, however the focus got there", () => {
  globalThis.HTMLInputElement = globalThis.HTMLElement = class {};
  const target = element("textarea");
  for (const before of [["pointerdown"], ["Tab"]]) {
    const { stopped, prevented } = stoppedAt(SPACE, { target, before, drives: true });
    assert.deepEqual([stopped, prevented], [[], [false, false]]);
  }
});

test("the release of Space presses no button after STOP", () => {
  assert.deepEqual(stoppedAt(SPACE).prevented, [true, true]);
  assert.deepEqual(stoppedAt({ ...SPACE, ctrlKey: true }).prevented, [false, false]);
});
