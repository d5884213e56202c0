import assert from "node:assert/strict";
import { test } from "node:test";

import * as gestures from "../../../src/webmap/web/modules/gestures.js";

const VIEW = { a: 40, b: 5, c: 5, d: -40, e: 300, f: 200 };
const ZOOM = { min: 1, max: 2000 };
const wheel = { deltaX: 0, deltaY: 0, deltaMode: 0, ctrlKey: false, shiftKey: false };

/** Numbers in [low, high) that are the same in every run. */
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

const apply = ({ a, b, c, d, e, f }, [x, y]) => [a * x + c * y + e, b * x + d * y + f];

function invert({ a, b, c, d, e, f }, [x, y]) {
  const det = a * d - b * c;
  return [(d * (x - e) - c * (y - f)) / det, (a * (y - f) - b * (x - e)) / det];
}

test("the point under the pointer stays, whatever the zoom and the turn", () => {
  const numbers = random(-1000, 1000);
  const next = () => numbers.next().value;
  for (let i = 0; i < 500; i++) {
    const point = [next(), next()];
    const world = invert(VIEW, point);
    const factor = 2 ** (next() / 300);
    const view = gestures.zoomAndTurn(VIEW, point, factor, next() / 100);
    near(apply(view, world), point);
    near(
      [gestures.pixelsPerMetre(view)],
      [gestures.pixelsPerMetre(VIEW) * factor],
      1e-6 * factor,
    );
  }
});

test("what was under two fingers stays under them", () => {
  const numbers = random(0, 700, 7);
  const point = () => [numbers.next().value, numbers.next().value];
  for (let i = 0; i < 500; i++) {
    const from = [point(), point()];
    const to = [point(), point()];
    const view = gestures.pinch(VIEW, from, to, { min: 0, max: Infinity });
    near(apply(view, invert(VIEW, from[0])), to[0], 1e-5);
    near(apply(view, invert(VIEW, from[1])), to[1], 1e-5);
  }
});

test("two fingers on one spot only move", () => {
  const view = gestures.pinch(
    VIEW,
    [
      [5, 5],
      [5, 5],
    ],
    [
      [9, 7],
      [9, 7],
    ],
    ZOOM,
  );
  assert.deepEqual(view, { ...VIEW, e: VIEW.e + 4, f: VIEW.f + 2 });
});

test("a thousand notches of the wheel do not lose the world", () => {
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
    const scale = gestures.pixelsPerMetre(view);
    assert.ok(scale >= 0.999 && scale <= 2000.1, `${scale}`);
  }
});

test("a view beyond the limits may come back and does not jump", () => {
  const far = { ...VIEW, a: 0.1, b: 0, c: 0, d: -0.1 };
  assert.equal(gestures.allowedFactor(far, 0.5, ZOOM), 1);
  assert.equal(gestures.allowedFactor(far, 1.2, ZOOM), 1.2);
});

test("a factor that is no positive number changes nothing", () => {
  for (const factor of [0, -1, NaN, Infinity]) {
    assert.equal(gestures.allowedFactor(VIEW, factor, ZOOM), 1);
  }
});

test("a wheel zooms the same there and back, in any of its units", () => {
  for (const deltaMode of [0, 1, 2]) {
    const there = gestures.wheelFactor({ ...wheel, deltaY: 3, deltaMode });
    const back = gestures.wheelFactor({ ...wheel, deltaY: -3, deltaMode });
    near([there * back], [1]);
    assert.ok(there < 1 && there > 0.1);
  }
});

test("shift and wheel turn, also where shift makes the wheel a horizontal one", () => {
  const vertical = gestures.wheelAngle({ ...wheel, shiftKey: true, deltaY: 100 });
  const horizontal = gestures.wheelAngle({ ...wheel, shiftKey: true, deltaX: 100 });
  assert.equal(vertical, horizontal);
  near([vertical], [Math.PI / 20]);
});

test("sideways scrolling without shift does nothing", () => {
  assert.equal(gestures.wheelFactor({ ...wheel, deltaX: 100 }), 1);
});

test("what is fitted lies within the map, in its middle", () => {
  const box = { x: -10, y: 3, width: 30, height: 12 };
  for (const angle of [0, 0.4, 2, -3]) {
    const view = gestures.zoomAndTurn(VIEW, [0, 0], 1, angle);
    const fitted = gestures.fit(view, box, 700, 500, ZOOM);
    near(apply(fitted, [5, 9]), [350, 250]);
    for (const corner of [
      [-10, 3],
      [20, 3],
      [-10, 15],
      [20, 15],
    ]) {
      const [x, y] = apply(fitted, corner);
      assert.ok(x >= 0 && x <= 700 && y >= 0 && y <= 500);
    }
  }
});

test("nothing to fit leaves the view as it is", () => {
  const box = { x: 0, y: 0, width: 0, height: 0 };
  assert.equal(gestures.fit(VIEW, box, 700, 500, ZOOM), VIEW);
});
