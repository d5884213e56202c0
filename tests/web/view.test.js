import assert from "node:assert/strict";
import test from "node:test";

import {
  adapt,
  LARGEST,
  SMALLEST,
  apply,
  fit,
  initialView,
  isView,
  multiply,
  rotate,
  scale,
  scaleOf,
  translate,
  unapply,
} from "../../src/webmap/web/view.js";

/** Pseudo-random numbers, the same in every run. */
function* numbers(seed) {
  for (let state = seed; ; ) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    yield state / 2 ** 32;
  }
}

const random = numbers(42);
const between = (low, high) => low + (high - low) * random.next().value;

function someView() {
  const moved = translate(initialView(700, 500), between(-1e3, 1e3), between(-1e3, 1e3));
  const turned = rotate(moved, between(-360, 360), between(0, 700), between(0, 500));
  return scale(turned, 10 ** between(-2, 3), between(0, 700), between(0, 500));
}

function near(actual, expected, tolerance = 1e-6) {
  const off = Math.hypot(actual.x - expected.x, actual.y - expected.y);
  assert.ok(off < tolerance, `${JSON.stringify(actual)} ≠ ${JSON.stringify(expected)}`);
}

const repeat = (fn) => Array.from({ length: 500 }).forEach(fn);

test("the first view has the world origin in its centre, and y points up", () => {
  const view = initialView(700, 500);
  near(apply(view, 0, 0), { x: 350, y: 250 });
  near(apply(view, 1, 2), { x: 351, y: 248 });
});

test("a point is the same after apply and unapply", () => {
  repeat(() => {
    const [view, x, y] = [someView(), between(-100, 100), between(-100, 100)];
    const screen = apply(view, x, y);
    near(unapply(view, screen.x, screen.y), { x, y });
  });
});

test("the point under the pointer stays when zooming", () => {
  repeat(() => {
    const [view, x, y] = [someView(), between(0, 700), between(0, 500)];
    const world = unapply(view, x, y);
    near(apply(scale(view, 10 ** between(-2, 2), x, y), world.x, world.y), { x, y });
  });
});

test("the point under the pointer stays when turning", () => {
  repeat(() => {
    const [view, x, y] = [someView(), between(0, 700), between(0, 500)];
    const world = unapply(view, x, y);
    const turned = rotate(view, between(-720, 720), x, y);
    near(apply(turned, world.x, world.y), { x, y });
    assert.ok(Math.abs(scaleOf(turned) / scaleOf(view) - 1) < 1e-9);
  });
});

test("a rotation is counter-clockwise on the screen", () => {
  const turned = rotate(initialView(0, 0), 90, 0, 0);
  near(apply(turned, 1, 0), { x: 0, y: -1 });
});

/** A place of a map on a page; only some values matter. */
const place = (left, top, width, height, window = "1440 900") => ({
  left,
  top,
  width,
  height,
  window,
});

test("with another size of the window the middle stays in the middle", () => {
  repeat(() => {
    const view = someView();
    const before = place(300, 40, between(1, 2000), between(1, 2000));
    const after = place(300, 40, between(1, 2000), between(1, 2000), "800 600");
    const world = unapply(view, before.width / 2, before.height / 2);
    const middle = { x: after.width / 2, y: after.height / 2 };
    near(apply(adapt(view, before, after, false), world.x, world.y), middle);
  });
});

test("beside a panel that opens the map shows everything at the same place", () => {
  const [view, before] = [someView(), place(300, 40, 1100, 800)];
  const point = unapply(view, 500, 200); // at 800, 240 of the page
  for (const after of [
    place(300, 40, 700, 800), // a panel at the right
    place(500, 40, 900, 800), // a panel at the left
    place(300, 140, 1100, 700), // a notice above
  ]) {
    const { x, y } = apply(adapt(view, before, after, false), point.x, point.y);
    near({ x: x + after.left, y: y + after.top }, { x: 800, y: 240 });
  }
});

test("the middle stays for a followed robot, a first size and a scrolled part", () => {
  const [view, before] = [someView(), place(300, 40, 1100, 800)];
  const after = place(500, 40, 900, 800);
  const centred = translate(view, -100, 0);
  assert.deepEqual(adapt(view, before, after, true), centred);
  const scrolled = place(300, -400, 900, 800);
  assert.deepEqual(adapt(view, before, scrolled, false), centred);
  const first = adapt(view, place(0, 0, 0, 0), after, false);
  assert.deepEqual(first, translate(view, 450, 400));
});

test("fit shows the whole rectangle, as large as possible and centred", () => {
  repeat(() => {
    const [width, height] = [between(50, 2000), between(50, 2000)];
    const [x0, y0] = [between(-100, 100), between(-100, 100)];
    const [x1, y1] = [x0 + between(2, 50), y0 + between(2, 50)];
    const view = fit(someView(), [x0, y0, x1, y1], width, height, 10);
    near(apply(view, (x0 + x1) / 2, (y0 + y1) / 2), { x: width / 2, y: height / 2 });
    const corners = [apply(view, x0, y0), apply(view, x1, y0), apply(view, x0, y1)];
    corners.push(apply(view, x1, y1));
    const free = corners.map(({ x, y }) => Math.min(x, width - x, y, height - y));
    assert.ok(Math.abs(Math.min(...free) - 10) < 1e-6, String(free));
  });
});

test("a point and a line can be fitted", () => {
  assert.ok(isView(fit(someView(), [3, 4, 3, 4], 700, 500)));
  assert.ok(isView(fit(someView(), [3, 4, 3, 9], 700, 500)));
});

test("zooming stops at the limits", () => {
  let view = initialView(700, 500);
  for (let i = 0; i < 100; i++) view = scale(view, 10, 350, 250);
  assert.ok(Math.abs(scaleOf(view) / LARGEST - 1) < 1e-6);
  for (let i = 0; i < 100; i++) view = scale(view, 0.1, 350, 250);
  assert.ok(Math.abs(scaleOf(view) / SMALLEST - 1) < 1e-6);
  assert.ok(isView(view));
});

test("a matrix with NaN, with infinity or with only zeros is not a view", () => {
  assert.ok(!isView({ ...initialView(1, 1), e: NaN }));
  assert.ok(!isView({ ...initialView(1, 1), a: Infinity }));
  assert.ok(!isView({ a: 0, b: 0, c: 0, d: 0, e: 0, f: 0 }));
});

test("multiply applies one view after the other", () => {
  const [m, n] = [someView(), someView()];
  const inner = apply(n, 3, 4);
  near(apply(multiply(m, n), 3, 4), apply(m, inner.x, inner.y), 1e-3);
});
