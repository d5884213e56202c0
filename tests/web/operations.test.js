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

const said = (operation, ...args) => operated(VIEW, SIZE, operation, args);

test("what only moves, grows or turns the view leaves the following alone", () => {
  assert.deepEqual(said("translate", 10, 20), { view: translate(VIEW, 10, 20) });
  assert.deepEqual(said("scale", 2, 30, 40), { view: scale(VIEW, 2, 30, 40) });
  assert.deepEqual(said("rotate", 90, 30, 40), { view: rotate(VIEW, 90, 30, 40) });
});

test("the middle is meant where no point is given", () => {
  for (const operation of ["scale", "rotate"]) {
    const { view } = said(operation, 3);
    assert.ok(view);
    assert.deepEqual(apply(view, 0, 0), { x: 350, y: 250 });
  }
});

test("a view that is set or fitted ends the following", () => {
  const fitted = fit(VIEW, [-1, -2, 3, 4], 700, 500);
  assert.deepEqual(said("fit", -1, -2, 3, 4), { view: fitted, follow: 0 });
  const view = { a: 2, b: 0, c: 0, d: -2, e: 11, f: 12 };
  assert.deepEqual(said("set", 2, 0, 0, -2, 11, 12), { view, follow: 0 });
});

test("following leaves the view alone", () => {
  assert.deepEqual(said("follow", 17), { follow: 17 });
});

test("an operation of another version does nothing", () => {
  assert.deepEqual(said("somersault", 1), {});
});

test("an operation counts once, however often it comes", () => {
  const operations = new Operations();
  assert.deepEqual(
    [1, 2, 2, 1, 3].map((number) => operations.reach(number)),
    [true, true, false, false, true],
  );
  assert.equal(operations.applied, 3);
});

test("operations wait for a size and are then carried out in order, once", () => {
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
