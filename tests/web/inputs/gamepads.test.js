import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { Gamepads, Pads, SILENT } from "../../../src/webmap/web/inputs/gamepads.js";
import { PadMaps, STANDARD } from "../../../src/webmap/web/inputs/pad_maps.js";

const AHEAD = [0, -1, 0, 0];

let pads;
let now;

/** A gamepad whose data is as old as the reading, unless `fields` has a timestamp. */
function pad(held, fields = {}) {
  const buttons = Array.from({ length: 17 }, () => ({ pressed: false }));
  buttons[STANDARD.hold] = { pressed: held };
  const base = { index: 0, id: "Pad", connected: true, mapping: "standard" };
  return { ...base, timestamp: now, axes: AHEAD, buttons, ...fields };
}

function read(...list) {
  now += 50;
  return pads.read(list, now);
}

beforeEach(() => {
  pads = new Pads();
  now = 0;
});

test("a gamepad drives only while its dead-man button is held", () => {
  assert.equal(read(pad(false)), null);
  assert.deepEqual(read(pad(true)), { x: 1, y: 0, turn: 0 });
  assert.equal(read(pad(false)), null);
});

test("a dead-man button held when the gamepad connects does nothing until released", () => {
  assert.equal(read(pad(true)), null);
  assert.equal(pads.spent, true);
  read(pad(false));
  assert.notEqual(read(pad(true)), null);
  assert.equal(pads.spent, false);
});

test("after an input block the dead-man button must be released", () => {
  read(pad(false));
  read(pad(true));
  pads.drop();
  assert.equal(read(pad(true)), null);
});

for (const [what, fields] of Object.entries({
  "that is not connected": { connected: false },
  "whose buttons are not known": { mapping: "" },
  "with too few buttons": { buttons: [] },
})) {
  test(`a gamepad ${what} does nothing`, () => {
    read(pad(false));
    assert.equal(read(pad(true, fields)), null);
  });
}

test("a gamepad without the standard mapping is named, with what to do, until it is gone", () => {
  const other = (mapping) => pad(true, { index: 1, id: "Joystick", mapping });
  assert.equal(read(pad(true), other("")), null);
  assert.match(pads.refusal, /^Gamepad "Joystick" has no standard layout and cannot drive: /);
  assert.match(pads.refusal, /open Gamepad settings and assign its sticks, .* and STOP\.$/);
  read(pad(true), { ...other(""), connected: false });
  assert.equal(pads.refusal, "");
});

/** Assignments that a test changes. */
function mapsOf(map) {
  return { map, of: () => map };
}

test("a gamepad without the standard mapping drives when its sticks and STOP are assigned", () => {
  const map = { ...STANDARD, ahead: { axis: 3, sign: 1 }, hold: 9, stop: 8 };
  for (const [missing, expected] of [[{}, 1], [{ side: null }, null], [{ stop: null }, null]]) {
    pads = new Pads(mapsOf({ ...map, ...missing }));
    const one = pad(false, { mapping: "", axes: [0, 0, 0, 1] });
    read(one);
    one.buttons[9] = { pressed: true };
    assert.equal(read({ ...one, timestamp: now })?.x ?? null, expected);
    assert.equal(pads.refusal === "", expected === 1);
  }
});

/** A gamepad on which the button of STOP is pressed or not. */
function stopping(pressed, fields = {}) {
  const one = pad(false, fields);
  one.buttons[STANDARD.stop] = { pressed };
  return one;
}

test("each press of STOP's button is one STOP, without the dead-man button", () => {
  const stops = [false, true, true, false, true].map((pressed) => {
    read(stopping(pressed));
    return pads.stopped;
  });
  assert.deepEqual(stops, [false, true, false, false, true]);
});

test("the press that connects a gamepad, or assigns its button, is no STOP", () => {
  const maps = mapsOf(STANDARD);
  pads = new Pads(maps);
  read(stopping(true));
  assert.equal(pads.stopped, false);
  read(stopping(false));
  maps.of = () => ({ ...STANDARD });
  read(stopping(true));
  assert.equal(pads.stopped, false);
});

test("STOP's button works on a gamepad that cannot drive, and while inputs are blocked", () => {
  pads = new Pads(mapsOf({ ...STANDARD, ahead: null }));
  read(stopping(false, { mapping: "" }));
  pads.drop();
  read(stopping(true, { mapping: "" }));
  assert.equal(pads.stopped, true);
});

test("a changed assignment moves nothing until the dead-man button is released", () => {
  const maps = mapsOf(STANDARD);
  pads = new Pads(maps);
  read(pad(false));
  assert.notEqual(read(pad(true)), null);
  const changed = { ...STANDARD, zone: 0.3 };
  maps.of = () => changed;
  assert.equal(read(pad(true)), null);
  assert.equal(pads.spent, true);
});

/** What a page does with the gamepads of `list`: its notices, STOPs and events. */
function pageWith(list, { focus = true, drives = false } = {}) {
  const found = { shown: [], stops: 0, on: {} };
  globalThis.window = Object.assign(new EventTarget(), { setInterval });
  globalThis.document = { hasFocus: () => focus, visibilityState: "hidden" };
  const browser = { value: { getGamepads: () => list }, configurable: true };
  Object.defineProperty(globalThis, "navigator", browser);
  const drive = {
    drives,
    status: { choice: "r1" },
    on: (kind, fn) => ((found.on[kind] = fn), () => {}),
    setInput: (name, axes) => assert.equal(axes, null),
    showGamepad: ({ kind, text }) => found.shown.push([kind, text]),
  };
  const owner = {
    ...{ maps: new PadMaps(), wanted: () => true, holonomic: () => false },
    ...{ stopByPad: () => (found.stops += 1), settings: () => () => {} },
  };
  found.gamepads = new Gamepads(drive, owner);
  return found;
}

function endPage({ gamepads }) {
  gamepads.destroy();
  for (const name of ["window", "document", "navigator"]) delete globalThis[name];
}

test("the page shows a refused gamepad once, and removes that when it is gone", () => {
  const list = [pad(true, { mapping: "" })];
  const page = pageWith(list, { focus: false });
  const states = () => page.shown.map(([kind, text]) => [kind, text !== ""]);
  page.on.read();
  page.on.read();
  assert.deepEqual(states(), [["refused", true]]);
  list.pop();
  page.on.read();
  assert.deepEqual(states(), [["refused", true], ["refused", false]]);
  endPage(page);
  assert.equal(page.shown.length, 2);
});

test("the page shows once what the buttons of a gamepad do", () => {
  const id = "Xbox Pad (STANDARD GAMEPAD Vendor: 045e Product: 028e)";
  const list = [pad(false, { id })];
  const page = pageWith(list);
  page.on.read();
  const words = "Hold LB and move the left stick to drive. Release to stop. B is STOP.";
  assert.deepEqual(page.shown, [["hint", `Gamepad connected: Xbox Pad. ${words}`]]);
  const [one] = list.splice(0);
  page.on.read();
  assert.deepEqual(page.shown.at(-1), ["hint", ""]);
  list.push(one);
  page.on.read();
  assert.equal(page.shown.length, 2);
  endPage(page);
});

test("a press of STOP's button stops, but not from another window", () => {
  for (const [how, stops] of [
    [{}, 1],
    [{ focus: false }, 0],
    [{ focus: false, drives: true }, 1],
  ]) {
    const list = [stopping(false)];
    const page = pageWith(list, how);
    page.on.read();
    list[0] = stopping(true);
    page.on.read();
    assert.equal(page.stops, stops);
    endPage(page);
  }
});

test("gamepads vibrate at STOP ALL, and when the chosen robot is stopped", () => {
  const effects = [];
  const able = { playEffect: (...args) => (effects.push(args), Promise.reject(new Error())) };
  const poor = { pulse() {} };
  const list = [able, poor, undefined].map((vibrationActuator, index) => {
    return pad(false, { index, vibrationActuator });
  });
  const page = pageWith([null, ...list]);
  const latch = (robot, latched) => page.on.robot({ robot, latched, state: "free" });
  for (const robot of ["r1", "r2"]) latch(robot, false);
  latch("r2", true);
  page.on.stop("r2");
  assert.equal(effects.length, 0);
  page.on.stop("*");
  assert.equal(effects.length, 1);
  for (const latched of [true, true, false, true]) latch("r1", latched);
  assert.equal(effects.length, 3);
  const [kind, { duration }] = effects[0];
  assert.deepEqual([kind, duration], ["dual-rumble", 300]);
  endPage(page);
});

test("a reconnected gamepad does nothing until its dead-man button is released", () => {
  read(pad(false));
  read(pad(true));
  assert.equal(read(null), null);
  assert.equal(pads.current, null);
  assert.equal(read(pad(true)), null);
});

test("a gamepad with an old timestamp is blocked, also when its timestamp changes again", () => {
  read(pad(false));
  const { timestamp } = pad(true);
  for (let t = 0; t < SILENT - 100; t += 50) {
    assert.notEqual(read(pad(true, { timestamp })), null);
  }
  for (let t = 0; t < 200; t += 50) read(pad(true, { timestamp }));
  assert.equal(read(pad(true, { timestamp })), null);
  assert.equal(pads.spent, true);
  assert.equal(read(pad(true)), null);
});

test("of two gamepads the one with the held dead-man button drives", () => {
  const other = (held) => pad(held, { index: 1, axes: [0, 1, 0, 0] });
  read(pad(false), other(false));
  assert.equal(read(pad(false), other(true)).x, -1);
});

test("of two held gamepads the one that was pressed last drives, and the other not after it", () => {
  const other = (held) => pad(held, { index: 1, axes: [0, 1, 0, 0] });
  read(pad(false), other(false));
  assert.equal(read(pad(true), other(false)).x, 1);
  assert.equal(read(pad(true), other(true)).x, -1);
  assert.equal(pads.spent, false);
  assert.equal(read(pad(true), other(false)), null);
  assert.equal(read(pad(true), null), null);
  assert.equal(pads.spent, true);
  read(pad(false), null);
  assert.equal(read(pad(true), null).x, 1);
});

test("when the gamepad that drives is gone, another that is held does not drive", () => {
  const other = (held) => pad(held, { index: 1, axes: [0, 1, 0, 0] });
  read(pad(false), other(false));
  read(pad(true), other(false));
  read(pad(true), other(true));
  assert.equal(read(pad(true), null), null);
});

test("on a holonomic base the left stick moves sideways and the right stick turns", () => {
  read(pad(false));
  const axes = [-1, 0, -1, 0];
  const asked = pads.read([pad(true, { axes })], now + 50, { holonomic: true });
  assert.deepEqual(asked, { x: 0, y: 1, turn: 1 });
});

test("a gamepad without axes is neutral", () => {
  read(pad(false));
  const asked = read(pad(true, { axes: [] }));
  assert.deepEqual(asked, { x: 0, y: 0, turn: 0 });
});
