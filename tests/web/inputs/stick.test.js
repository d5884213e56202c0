import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { Stick } from "../../../src/webmap/web/inputs/sticks.js";

/** A fake of the pad with the parts that a stick needs. */
class Pad extends EventTarget {
  constructor() {
    super();
    this.captured = new Set();
    this.classList = { add() {}, remove() {} };
    this.style = { setProperty() {} };
  }

  getBoundingClientRect() {
    return { left: 0, top: 0, width: 100, height: 100 };
  }

  hasPointerCapture(id) {
    return this.captured.has(id);
  }

  setPointerCapture(id) {
    this.captured.add(id);
  }

  releasePointerCapture(id) {
    this.captured.delete(id);
  }

  fire(kind, fields) {
    const event = { pointerId: 1, button: 0, clientX: 50, clientY: 20, ...fields };
    this.dispatchEvent(Object.assign(new Event(kind, { cancelable: true }), event));
  }
}

let pad, asked;

beforeEach(() => {
  globalThis.document = { activeElement: null };
  globalThis.HTMLElement = class {};
  asked = [];
  pad = new Pad();
  const drive = { on: () => () => {}, setInput: (_, axes) => asked.push(axes) };
  new Stick(drive, pad, () => false);
});

test("a press on the stick drives, and its release is neutral", () => {
  pad.fire("pointerdown", { buttons: 1 });
  assert.ok(asked.at(-1).x > 0);
  pad.fire("pointerup", { buttons: 0 });
  assert.equal(asked.at(-1), null);
});

test("releasing the first mouse button releases the stick while another button is held", () => {
  pad.fire("pointerdown", { buttons: 1 });
  pad.fire("pointermove", { button: 1, buttons: 5 });
  assert.ok(asked.at(-1).x > 0);
  pad.fire("pointermove", { buttons: 4 });
  assert.equal(asked.at(-1), null);
  pad.fire("pointermove", { buttons: 4, clientY: 10 });
  assert.equal(asked.at(-1), null);
});
