import assert from "node:assert/strict";
import test from "node:test";
import {
  apply,
  fit,
  initialView,
  operated,
  Operations,
  rotate,
  scale,
  translate,
} from "../../src/webmap/web/view.js";


const SIZE = { width: 700, height: 500 };
const VIEW = initialView(700, 500);

const result = (operation, ...args) => operated(VIEW, SIZE, operation, args);

test("translate, scale and rotate do not end the following", () => {
  assert.deepEqual(result("translate", 10, 20), { view: translate(VIEW, 10, 20) });
  assert.deepEqual(result("scale", 2, 30, 40), { view: scale(VIEW, 2, 30, 40) });
  assert.deepEqual(result("rotate", 90, 30, 40), { view: rotate(VIEW, 90, 30, 40) });
});

test("scale and rotate without a point use the centre", () => {
  for (const operation of ["scale", "rotate"]) {
    const { view } = result(operation, 3);
    assert.ok(view);
    assert.deepEqual(apply(view, 0, 0), { x: 350, y: 250 });
  }
});

test("set and fit end the following", () => {
  const fitted = fit(VIEW, [-1, -2, 3, 4], 700, 500);
  assert.deepEqual(result("fit", -1, -2, 3, 4), { view: fitted, follow: 0 });
  const view = { a: 2, b: 0, c: 0, d: -2, e: 11, f: 12 };
  assert.deepEqual(result("set", 2, 0, 0, -2, 11, 12), { view, follow: 0 });
});

test("follow does not change the view", () => {
  assert.deepEqual(result("follow", 17), { follow: 17 });
});

test("an unknown operation does nothing", () => {
  assert.deepEqual(result("somersault", 1), {});
});

test("an operation that arrives twice is applied once", () => {
  const operations = new Operations();
  assert.deepEqual(
    [1, 2, 2, 1, 3].map((number) => operations.reach(number)),
    [true, true, false, false, true],
  );
  assert.equal(operations.applied, 3);
});

test("operations wait until the map has a size and then run once, in order", () => {
  const operations = new Operations();
  const done = [];
  operations.whenSized(false, () => done.push(1));
  operations.whenSized(false, () => done.push(2));
  assert.deepEqual(done, []);
  operations.goOn();
  operations.goOn();
  operations.whenSized(true, () => done.push(3));
  assert.deepEqual(done, [1, 2, 3]);
});
