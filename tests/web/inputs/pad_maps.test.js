import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import {
  Finder,
  PadMaps,
  STANDARD,
  assign,
  axesOfPad,
  axisName,
  buttonName,
  controlsOf,
  isComplete,
  nameOf,
} from "../../../src/webmap/web/inputs/pad_maps.js";

const PAD = { index: 0, id: "Pad", connected: true, mapping: "standard", axes: [], buttons: [] };
const OTHER = { ...PAD, id: "Joystick", mapping: "" };

/** Buttons of which those with these numbers are pressed. */
const buttons = (...held) => Array.from({ length: 17 }, (_, i) => ({ pressed: held.includes(i) }));

let kept;

beforeEach(() => {
  kept = new Map();
  globalThis.localStorage = {
    getItem: (key) => kept.get(key) ?? null,
    setItem: (key, value) => kept.set(key, value),
  };
});

afterEach(() => {
  delete globalThis.localStorage;
});

test("assigned axes drive, with their own direction", () => {
  const map = { ...STANDARD, ahead: { axis: 3, sign: 1 }, side: { axis: 2, sign: 1 } };
  const pad = { ...PAD, axes: [0.9, 0.9, 0, 1] };
  assert.deepEqual(axesOfPad(pad, map, false), { x: 1, y: 0, turn: 0 });
  assert.equal(axesOfPad({ ...PAD, axes: [0, 0, 1, 0] }, map, false).turn, 1);
});

test("an axis that the gamepad does not have, or that is not assigned, is neutral", () => {
  const map = { ...STANDARD, ahead: { axis: 9, sign: 1 }, side: null, spin: null };
  for (const holonomic of [false, true]) {
    const axes = axesOfPad({ ...PAD, axes: [1, 1, 1, 1] }, map, holonomic);
    assert.deepEqual(axes, { x: 0, y: 0, turn: 0 });
  }
});

test("the dead zone of the gamepad holds for every stick", () => {
  const map = { ...STANDARD, zone: 0.4 };
  const neutral = { x: 0, y: 0, turn: 0 };
  const slight = { ...PAD, axes: [0.39, -0.39, 0.39, 0] };
  assert.deepEqual(axesOfPad(slight, map, true), neutral);
  assert.deepEqual(axesOfPad(slight, map, false), neutral);
  assert.notDeepEqual(axesOfPad(slight, STANDARD, false), neutral);
});

test("STOP keeps its button when another action is given that button", () => {
  assert.equal(assign(STANDARD, "hold", STANDARD.stop), null);
});

test("STOP moved to the dead-man button swaps the two", () => {
  const { stop, hold } = assign(STANDARD, "stop", STANDARD.hold);
  assert.deepEqual([stop, hold], [STANDARD.hold, STANDARD.stop]);
  assert.equal(assign(STANDARD, "stop", 7).hold, STANDARD.hold);
});

test("two actions that would have one axis swap their axes", () => {
  const { ahead, side, spin } = assign(STANDARD, "ahead", { axis: 0, sign: 1 });
  assert.deepEqual([ahead, side, spin], [{ axis: 0, sign: 1 }, STANDARD.ahead, STANDARD.spin]);
});

test("a button that is held already is assigned only when it is pressed again", () => {
  const finder = new Finder("button");
  const found = [[3], [3], [], [3]].map((held) => finder.read({ axes: [], buttons: buttons(...held) }, 0));
  assert.deepEqual(found, [null, null, null, 3]);
});

/** Read the values of axes every 50 ms, and return what is found. */
function find(...readings) {
  const finder = new Finder("axis");
  return readings.map((axes, i) => finder.read({ axes, buttons: [] }, 50 * i)).find(Boolean);
}

const times = (count, value) => Array.from({ length: count }, () => value);

test("an axis is assigned when it was pushed and rests in its middle again", () => {
  const rest = times(8, [0.05, 0]);
  assert.equal(find([0, 0], [0, -0.9], [0, -0.9]), undefined);
  assert.deepEqual(find([0, 0], [0, -0.9], ...rest), { axis: 1, sign: -1 });
});

test("a trigger, which rests at its end, is not assigned as an axis", () => {
  assert.equal(find([0], [1], [0.2], [-0.2], ...times(20, [-1])), undefined);
  assert.equal(find(...times(4, [-1]), [1], ...times(20, [-1])), undefined);
});

test("names are those that are printed on the gamepad", () => {
  const sony = { ...PAD, id: "Wireless Controller (STANDARD GAMEPAD Vendor: 054c Product: 09cc)" };
  assert.deepEqual([PAD, sony, OTHER].map((pad) => buttonName(pad, 1)), ["B", "Circle", "button 2"]);
  assert.deepEqual([PAD, OTHER].map((pad) => axisName(pad, STANDARD.ahead)), [
    "left stick up, down",
    "axis 2",
  ]);
  assert.equal(nameOf(sony), "Wireless Controller");
  assert.equal(nameOf({ id: "045e-028e-Xbox 360 Pad" }), "Xbox 360 Pad");
  assert.equal(controlsOf(sony, STANDARD), "L1 and the left stick");
  assert.equal(controlsOf(OTHER, STANDARD), "button 5 and axis 2 and axis 1");
});

test("assignments are kept for each gamepad, also for another page", () => {
  const map = { ...STANDARD, stop: 7, zone: 0.3 };
  new PadMaps().keep(PAD, map);
  const maps = new PadMaps();
  assert.deepEqual(maps.of(PAD), map);
  assert.equal(maps.of(PAD), maps.of(PAD));
  assert.equal(maps.of({ ...PAD, id: "Another" }), STANDARD);
  maps.restore(PAD);
  assert.equal(maps.of(PAD).stop, STANDARD.stop);
});

test("a gamepad without the standard mapping keeps its STOP when defaults are restored", () => {
  const maps = new PadMaps();
  assert.equal(isComplete(maps.of(OTHER)), false);
  maps.keep(OTHER, { ...STANDARD, stop: 6 });
  maps.restore(OTHER);
  assert.deepEqual([maps.of(OTHER).ahead, maps.of(OTHER).stop], [null, 6]);
});

for (const what of ["full", "forbidden"]) {
  test(`assignments last as long as the page if storage is ${what}`, () => {
    const refuse = () => {
      throw new Error(what);
    };
    const getItem = what === "full" ? () => null : refuse;
    globalThis.localStorage = { getItem, setItem: refuse };
    const maps = new PadMaps();
    maps.keep(PAD, { ...STANDARD, stop: 9 });
    assert.equal(maps.of(PAD).stop, 9);
  });
}

for (const [what, text] of Object.entries({
  "no JSON": "{",
  "no list": "{}",
  "no assignments": '[["Pad", null]]',
  "no STOP": JSON.stringify([["Pad", { ...STANDARD, stop: null }]]),
  "one button for both": JSON.stringify([["Pad", { ...STANDARD, stop: 4 }]]),
  "an axis that is none": JSON.stringify([["Pad", { ...STANDARD, ahead: { axis: -1, sign: 1 } }]]),
  "a direction that is none": JSON.stringify([["Pad", { ...STANDARD, side: { axis: 0, sign: 9 } }]]),
})) {
  test(`kept assignments with ${what} are not used`, () => {
    kept.set("webmap.gamepads", text);
    assert.equal(new PadMaps().of(PAD), STANDARD);
  });
}

test("a kept dead zone out of its range is not used", () => {
  kept.set("webmap.gamepads", JSON.stringify([["Pad", { ...STANDARD, zone: 7 }]]));
  assert.deepEqual(new PadMaps().of(PAD), STANDARD);
});
