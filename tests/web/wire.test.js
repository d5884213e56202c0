import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import test from "node:test";

import { OP, VERSION } from "../../src/webmap/web/opcodes.js";
import { WireError, readFrame } from "../../src/webmap/web/wire.js";
import { Tree, bufferOf } from "./tree.mjs";

const GOLDEN = new URL("../scene/wire/golden/", import.meta.url);
const golden = readdirSync(GOLDEN).filter((name) => name.endsWith(".bin"));

function read(name) {
  return bufferOf(readFileSync(new URL(name, GOLDEN)));
}

/** A frame with a valid header. */
function frame(...bytes) {
  const buffer = new ArrayBuffer(15 + bytes.length);
  new DataView(buffer).setUint16(0, VERSION, true);
  new Uint8Array(buffer).set(bytes, 15);
  return buffer;
}

test("there are golden frames", () => assert.ok(golden.length >= 3));

for (const name of golden) {
  test(`${name} is decoded to the content of its JSON file`, () => {
    const expected = JSON.parse(readFileSync(new URL(name.replace(".bin", ".json"), GOLDEN)));
    const tree = new Tree();
    const { reset, frame: number, now } = tree.apply(read(name));
    const picture = tree.picture();
    const state = { reset, frame: number, now, picture, said: tree.said };
    assert.deepEqual(JSON.parse(JSON.stringify(state)), expected);
  });

  test(`a truncated ${name} is refused or ends after a whole record`, () => {
    const whole = read(name);
    for (let length = 0; length < whole.byteLength; length++) {
      try {
        new Tree().apply(whole.slice(0, length));
      } catch (error) {
        if (!(error instanceof WireError)) throw error;
      }
    }
    assert.throws(() => new Tree().apply(whole.slice(0, whole.byteLength - 1)), WireError);
  });
}

test("a frame of another version is refused", () => {
  const buffer = frame();
  new DataView(buffer).setUint16(0, VERSION ^ 1, true);
  assert.throws(() => readFrame(buffer, () => new Tree()), /version/);
});

test("an unknown record is refused with its number", () => {
  assert.throws(() => new Tree().apply(frame(250)), /250/);
});

test("a tag or attribute outside the tables is refused", () => {
  const mount = [OP.MOUNT, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, OP.SNAPSHOT, 1];
  assert.throws(() => new Tree().apply(frame(...mount, OP.CREATE, 9, 0, 0, 254)), /tag/);
  const made = [...mount, OP.CREATE, 9, 0, 0, 0];
  assert.throws(() => new Tree().apply(frame(...made, OP.ATTRIBUTE, 9, 254)), /name/);
});

test("a length beyond the end of the frame is refused before memory is allocated", () => {
  const long = [255, 255, 255, 255, 255, 255, 15];
  for (const record of [
    [OP.ERROR, ...long],
    [OP.DOTS, 1, 0, 0, 0, 0, ...long],
  ]) {
    assert.throws(() => new Tree().apply(frame(...record)), WireError);
  }
});

test("a number too large to be exact is refused", () => {
  const bytes = [OP.UNMOUNT, 255, 255, 255, 255, 255, 255, 255, 255, 1];
  assert.throws(() => new Tree().apply(frame(...bytes)), /too large/);
});

test("a message that is not valid JSON is refused", () => {
  assert.throws(() => new Tree().apply(frame(OP.MESSAGE, 1, 1, 0x7b)), WireError);
});

test("a thousand poses are read within one second", { timeout: 1000 }, () => {
  const record = [OP.POSE, 200, 1, 0, 0, 128, 63, 0, 0, 0, 64, 0, 0, 0, 0];
  const buffer = frame(...Array.from({ length: 1000 }, () => record).flat());
  let poses = 0;
  readFrame(buffer, () => ({
    pose(id, x, y, yaw) {
      assert.deepEqual([id, x, y, yaw], [200, 1, 2, 0]);
      poses += 1;
    },
  }));
  assert.equal(poses, 1000);
});
