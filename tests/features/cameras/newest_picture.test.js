import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { NewestPicture } from "../../../src/webmap/features/cameras/camera_cell.js";

const settled = () => new Promise((resolve) => setImmediate(resolve));

describe("the newest picture", () => {
  let now, loads, shown, picture;
  beforeEach(() => {
    [now, loads, shown] = [0, [], []];
    const load = (url) =>
      new Promise((resolve, reject) => loads.push({ url, end: () => resolve(url), fail: reject }));
    picture = new NewestPicture(load, (one) => shown.push(one), () => now);
  });

  test("loads one picture at a time and skips to the latest offer", async () => {
    for (const url of ["a", "b", "c"]) picture.offer(url, 0);
    assert.deepEqual(loads.map(({ url }) => url), ["a"]);
    loads[0].end();
    await settled();
    assert.deepEqual(loads.map(({ url }) => url), ["a", "c"]);
    loads[1].end();
    await settled();
    assert.deepEqual(shown, ["a", "c"]);
  });

  test("has the age of its offer plus the time since then", async () => {
    picture.offer("a", 300);
    now = 200;
    loads[0].end();
    await settled();
    assert.equal(picture.age, 500);
    now = 1200;
    assert.equal(picture.age, 1500);
  });

  test("has the waiting time as its age before the first picture", () => {
    now = 1234;
    assert.equal(picture.age, 1234);
    assert.ok(!picture.shown);
  });

  test("is loaded from the next offer when loading fails", async () => {
    picture.offer("a", 0);
    picture.offer("b", 0);
    now = 500;
    loads[0].fail(new Error("404"));
    await settled();
    assert.equal(picture.age, 500);
    loads[1].end();
    await settled();
    assert.deepEqual(shown, ["b"]);
  });

  test("is loaded although an earlier load does not finish in time", async () => {
    picture.offer("a", 0);
    now = 2000;
    picture.offer("b", 0);
    loads[1].end();
    loads[0].end();
    await settled();
    assert.deepEqual(shown, ["b"]);
  });

  test("of the previous camera is not shown after a restart", async () => {
    picture.offer("a", 0);
    now = 700;
    picture.restart();
    loads[0].end();
    await settled();
    assert.deepEqual(shown, []);
    assert.equal(picture.age, 0);
    picture.offer("b", 0);
    loads[1].end();
    await settled();
    assert.deepEqual(shown, ["b"]);
  });
});
