import assert from "node:assert/strict";
import { test } from "node:test";

import { BLIND, PictureAges } from "../../../src/webmap/web/motion/commands.js";

test("a robot without a camera has no picture age and is not blind", () => {
  const pictures = new PictureAges();
  assert.equal(pictures.age("r1"), undefined);
  assert.equal(pictures.blind("r1"), false);
});

test("a picture is too old after a second", () => {
  const pictures = new PictureAges();
  let age = BLIND;
  pictures.goBy("r1", () => age);
  assert.equal(pictures.blind("r1"), false);
  age = BLIND + 1;
  assert.equal(pictures.blind("r1"), true);
  assert.equal(pictures.blind("r2"), false);
});

test("a picture age is a finite whole number", () => {
  const pictures = new PictureAges();
  for (const [age, shown] of [
    [12.6, 13],
    [-5, 0],
    [Infinity, 1e9],
  ]) {
    pictures.goBy("r1", () => age);
    assert.equal(pictures.age("r1"), shown);
  }
});

test("the end of one camera does not end the camera selected after it", () => {
  const pictures = new PictureAges();
  const end = pictures.goBy("r1", () => 1);
  const endOther = pictures.goBy("r1", () => 2);
  end();
  assert.equal(pictures.age("r1"), 2);
  endOther();
  assert.equal(pictures.age("r1"), undefined);
});
