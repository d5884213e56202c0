import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { DEAD_MAN, Gamepads, Pads, SILENT } from "../../../src/webmap/web/inputs/sticks.js";

const AHEAD = [0, -1, 0, 0];

let pads;
let now;

/** A gamepad whose data is as old as the reading, unless `fields` has a timestamp. */
function pad(held, fields = {}) {
  const buttons = Array.from({ length: 17 }, () => ({ pressed: false }));
  buttons[DEAD_MAN] = { pressed: held };
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
  assert.match(pads.refusal, /^The gamepad "Joystick" cannot drive: .* reports no mapping /);
  assert.match(pads.refusal, /expected "standard"\. Switch it to another mode/);
  read(other("xr-standard"));
  assert.match(pads.refusal, /reports the mapping "xr-standard"/);
  read(pad(true), { ...other(""), connected: false });
  assert.equal(pads.refusal, "");
});

test("the page shows a refused gamepad once, and removes that when it is gone", () => {
  globalThis.window = new EventTarget();
  globalThis.document = { hasFocus: () => false, querySelector: () => null };
  const shown = [];
  const on = {};
  const gamepads = new Gamepads(
    {
      on: (kind, fn) => ((on[kind] = fn), () => {}),
      setInput: (name, axes) => assert.equal(axes, null),
      refuseGamepad: (why) => shown.push(why !== ""),
    },
    { wanted: () => true, holonomic: () => false },
  );
  const list = [pad(true, { mapping: "" })];
  const browser = { value: { getGamepads: () => list }, configurable: true };
  Object.defineProperty(globalThis, "navigator", browser);
  on.read();
  on.read();
  assert.deepEqual(shown, [true]);
  list.pop();
  on.read();
  assert.deepEqual(shown, [true, false]);
  gamepads.destroy();
  assert.deepEqual(shown, [true, false]);
  for (const name of ["window", "document", "navigator"]) delete globalThis[name];
});

test("a reconnected gamepad does nothing until its dead-man button is released", () => {
  read(pad(false));
  read(pad(true));
  assert.equal(read(null), null);
  assert.equal(pads.present, false);
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
