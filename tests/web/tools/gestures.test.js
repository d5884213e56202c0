import assert from "node:assert/strict";
import { test } from "node:test";

import { apply, scaleOf, unapply } from "../../../src/webmap/web/view.js";
import * as gestures from "../../../src/webmap/features/view/mouse_view_control.js";

const VIEW = { a: 40, b: 5, c: 5, d: -40, e: 300, f: 200 };
const ZOOM = { min: 1, max: 2000 };
const wheel = { deltaX: 0, deltaY: 0, deltaMode: 0, ctrlKey: false, shiftKey: false };

/** Pseudo-random numbers in [low, high), the same in every run. */
function* random(low, high, seed = 1) {
  for (let state = seed; ;) {
    state = (state * 48271) % 2147483647;
    yield low + ((high - low) * state) / 2147483647;
  }
}

function near(actual, expected, tolerance = 1e-6) {
  actual.forEach((value, i) => {
    assert.ok(
      Math.abs(value - expected[i]) <= tolerance,
      `${actual} is not near ${expected}`,
    );
  });
}

/** Check that a view shows a point of the world where it should be. */
function shows(view, world, point, tolerance = 1e-6) {
  const at = apply(view, world.x, world.y);
  near([at.x, at.y], [point.x, point.y], tolerance);
}

test("the point under the pointer stays at any zoom and rotation", () => {
  const numbers = random(-1000, 1000);
  const next = () => numbers.next().value;
  for (let i = 0; i < 500; i++) {
    const point = { x: next(), y: next() };
    const world = unapply(VIEW, point.x, point.y);
    const factor = 2 ** (next() / 300);
    const view = gestures.zoomAndTurn(VIEW, point, factor, next() / 100);
    shows(view, world, point, 1e-6);
    near([scaleOf(view)], [scaleOf(VIEW) * factor], 1e-6 * factor);
  }
});

test("the two points under two fingers stay under the fingers", () => {
  const numbers = random(0, 700, 7);
  const point = () => ({ x: numbers.next().value, y: numbers.next().value });
  for (let i = 0; i < 500; i++) {
    const from = [point(), point()];
    const to = [point(), point()];
    const view = gestures.pinch(VIEW, from, to, { min: 0, max: Infinity });
    shows(view, unapply(VIEW, from[0].x, from[0].y), to[0], 1e-5);
    shows(view, unapply(VIEW, from[1].x, from[1].y), to[1], 1e-5);
  }
});

test("two fingers on one point only move the view", () => {
  const [from, to] = [
    { x: 5, y: 5 },
    { x: 9, y: 7 },
  ];
  const view = gestures.pinch(VIEW, [from, from], [to, to], ZOOM);
  assert.deepEqual(view, { ...VIEW, e: VIEW.e + 4, f: VIEW.f + 2 });
});

test("a thousand wheel steps stay within the zoom limits", () => {
  for (const factor of [0.8, 1.25]) {
    let view = VIEW;
    for (let i = 0; i < 1000; i++) {
      view = gestures.zoomAndTurn(
        view,
        [100, 100],
        gestures.allowedFactor(view, factor, ZOOM),
        0,
      );
    }
    const scale = scaleOf(view);
    assert.ok(scale >= 0.999 && scale <= 2000.1, `${scale}`);
  }
});

test("a view beyond the zoom limits can zoom back and does not jump", () => {
  const far = { ...VIEW, a: 0.1, b: 0, c: 0, d: -0.1 };
  assert.equal(gestures.allowedFactor(far, 0.5, ZOOM), 1);
  assert.equal(gestures.allowedFactor(far, 1.2, ZOOM), 1.2);
});

test("a zoom factor that is not a positive number changes nothing", () => {
  for (const factor of [0, -1, NaN, Infinity]) {
    assert.equal(gestures.allowedFactor(VIEW, factor, ZOOM), 1);
  }
});

test("opposite wheel steps cancel each other in every unit", () => {
  for (const deltaMode of [0, 1, 2]) {
    const there = gestures.wheelFactor({ ...wheel, deltaY: 3, deltaMode });
    const back = gestures.wheelFactor({ ...wheel, deltaY: -3, deltaMode });
    near([there * back], [1]);
    assert.ok(there < 1 && there > 0.1);
  }
});

test("shift and wheel rotate the view, also with a horizontal wheel delta", () => {
  const vertical = gestures.wheelAngle({ ...wheel, shiftKey: true, deltaY: 100 });
  const horizontal = gestures.wheelAngle({ ...wheel, shiftKey: true, deltaX: 100 });
  assert.equal(vertical, horizontal);
  near([vertical], [Math.PI / 20]);
});

test("horizontal scrolling without shift does nothing", () => {
  assert.equal(gestures.wheelFactor({ ...wheel, deltaX: 100 }), 1);
});
