import assert from "node:assert/strict";
import { test } from "node:test";

import { planSweeps, SPACING } from "../../../src/webmap/features/routes/sweeps.js";
import { along, awayFrom, BAYS, isIn, numbersFrom, placed } from "./areas.js";
import { roundArea, shortestSide, sizeOf, spread, starArea } from "./areas.js";

const ROOM = 500;
const HALL = [
  [0, 0],
  [6, 0],
  [6, 3],
  [0, 3],
];

function plan(area, how = {}) {
  return planSweeps(area, { spacing: 1, room: ROOM, ...how });
}

/** Many areas for which sweeps exist, each with a spacing. */
function* plans(areaOf, seed, count = 80) {
  const number = numbersFrom(seed);
  for (let i = 0; i < count; i++) {
    const area = areaOf(number);
    const spacing = 0.3 + 1.5 * number();
    const across = number() < 0.5;
    // Areas too small to press, and sides so short that two corners are one.
    if (sizeOf(area) < 0.2 || shortestSide(area) < 0.05) continue;
    const made = plan(area, { spacing, across, room: Infinity });
    assert.equal(made.problem, "", JSON.stringify(area));
    yield { area, spacing, across, ...made, inputs: JSON.stringify({ area, spacing, across }) };
  }
}

/** How far a point is across the sweeps of an area, in metres. */
function acrossOf(area, across) {
  let [longest, yaw] = [0, 0];
  for (const [i, p] of area.entries()) {
    const q = area[(i + 1) % area.length];
    const length = Math.hypot(q.x - p.x, q.y - p.y);
    if (length > longest + 1e-6) [longest, yaw] = [length, Math.atan2(q.y - p.y, q.x - p.x)];
  }
  if (across) yaw += Math.PI / 2;
  return ({ x, y }) => Math.cos(yaw) * y - Math.sin(yaw) * x;
}

function rounded(points) {
  return points.map(({ x, y, yaw }) =>
    [x, y, Math.abs(yaw)].map((n) => Math.round(n * 1e6) / 1e6 + 0),
  );
}

const BACK = Math.round(Math.PI * 1e6) / 1e6;

test("sweeps run along the longest side, half a spacing from the edges", () => {
  assert.deepEqual(rounded(plan(placed(HALL)).points), [
    [0.5, 0.5, 0],
    [5.5, 0.5, 0],
    [5.5, 1.5, BACK],
    [0.5, 1.5, BACK],
    [0.5, 2.5, 0],
    [5.5, 2.5, 0],
  ]);
});

test("sweeps run across the longest side with the across option", () => {
  const { points, sweeps } = plan(placed(HALL), { across: true, spacing: 2 });
  assert.equal(sweeps.length, 3);
  assert.deepEqual(
    rounded(points).map(([x, y]) => [x, y]),
    [
      [1, 1],
      [1, 2],
      [3, 2],
      [3, 1],
      [5, 1],
      [5, 2],
    ],
  );
  for (const { yaw } of points) assert.ok(Math.abs(Math.abs(yaw) - Math.PI / 2) < 1e-9);
});

test("an area narrower than the spacing gets one sweep in its middle", () => {
  const strip = placed([
    [0, 0],
    [8, 0],
    [8, 0.6],
    [0, 0.6],
  ]);
  assert.deepEqual(rounded(plan(strip).points), [
    [0.5, 0.3, 0],
    [7.5, 0.3, 0],
  ]);
});

test("a bay splits a sweep into one part on each side", () => {
  const { sweeps } = plan(placed(BAYS["two arms"]), { spacing: 2 });
  const parts = sweeps
    .filter(([{ y }]) => y > 3.5)
    .map(([p, q]) => [Math.min(p.x, q.x), Math.max(p.x, q.x)]);
  assert.deepEqual(
    parts.sort(([a], [b]) => a - b),
    [
      [1, 2],
      [1, 2],
      [10, 11],
      [10, 11],
    ],
  );
});

test("points at both ends of a sweep have its heading", () => {
  for (const yaw of [0, 1, -2.5]) {
    const { points, sweeps } = plan(placed(BAYS["two arms"], yaw));
    for (const [p, q] of sweeps) {
      const heading = Math.atan2(q.y - p.y, q.x - p.x);
      for (const end of [p, q]) {
        const there = points.filter(({ x, y }) => x === end.x && y === end.y);
        const turned = there.map((pose) => Math.cos(pose.yaw - heading));
        assert.ok(Math.max(...turned) > 1 - 1e-9, JSON.stringify({ p, q, there }));
      }
    }
  }
});

test("every point is in the area or on its edge", () => {
  for (const areaOf of [roundArea, starArea]) {
    for (const { area, points, inputs } of plans(areaOf, 1)) {
      assert.ok(points.every((point) => isIn(area, point)), inputs);
    }
  }
});

test("every sweep is completely inside the area", () => {
  for (const areaOf of [roundArea, starArea]) {
    for (const { area, sweeps, inputs } of plans(areaOf, 2, 60)) {
      const places = sweeps.flatMap(([p, q]) => along(p, q));
      assert.ok(places.every((point) => isIn(area, point)), inputs);
    }
  }
});

test("sweeps are at most the spacing apart and half the spacing from the bounds", () => {
  for (const areaOf of [roundArea, starArea]) {
    for (const { area, sweeps, spacing, across, inputs } of plans(areaOf, 3)) {
      const over = acrossOf(area, across);
      const bounds = area.map(over);
      const lines = sweeps
        .filter(([p, q]) => Math.abs(over(p) - over(q)) < 1e-6)
        .map(([p]) => over(p))
        .sort((a, b) => a - b);
      const ends = [Math.min(...bounds) - spacing / 2, Math.max(...bounds) + spacing / 2];
      const all = [ends[0], ...lines, ends[1]];
      const gaps = all.slice(1).map((line, i) => line - all[i]);
      assert.ok(Math.max(...gaps) <= spacing + 1e-6, `${Math.max(...gaps)} ${inputs}`);
    }
  }
});

test("every place in an area without bays is within one spacing of a sweep", () => {
  for (const { area, sweeps, spacing, inputs } of plans(roundArea, 4, 80)) {
    for (const point of spread(area)) {
      const away = Math.min(...sweeps.map((sweep) => awayFrom(sweep, point)));
      assert.ok(away <= spacing + 1e-6, `${away} ${JSON.stringify(point)} ${inputs}`);
    }
  }
});

for (const [name, corners] of Object.entries(BAYS)) {
  test(`${name}: no path between successive points leaves the area`, () => {
    const number = numbersFrom(5);
    for (let i = 0; i < 12; i++) {
      const area = placed(corners, number() * 7, [number() * 50, number() * 50]);
      const how = { spacing: 0.4 + number() * 0.9, across: i % 2 === 1 };
      const { points, problem } = plan(area, how);
      assert.equal(problem, "");
      for (const [k, point] of points.slice(1).entries()) {
        const way = along(points[k], point, 40);
        assert.ok(
          way.every((place) => isIn(area, place)),
          JSON.stringify({ how, area, from: points[k], point }),
        );
      }
    }
  });
}

test("the route follows every sweep exactly once", () => {
  const { points, sweeps } = plan(placed(BAYS["a comb"]));
  for (const [p, q] of sweeps) {
    const times = points.filter(
      (point, i) =>
        point.x === p.x && point.y === p.y && points[i + 1]?.x === q.x && points[i + 1].y === q.y,
    );
    assert.equal(times.length, 1, JSON.stringify([p, q]));
  }
});

test("among equally good orders the route begins at the first corner", () => {
  for (const [i, { x, y }] of placed(HALL).entries()) {
    const turned = placed([...HALL.slice(i), ...HALL.slice(0, i)]);
    const [first] = plan(turned).points;
    assert.ok(Math.hypot(first.x - x, first.y - y) < 1, JSON.stringify({ i, first }));
  }
});

test("the distance of an area from the map origin does not change its route", () => {
  const near = plan(placed(BAYS["a comb"], 1));
  const far = plan(placed(BAYS["a comb"], 1, [9e5, -9e5]));
  assert.equal(far.points.length, near.points.length);
  for (const [i, { x, y }] of far.points.entries()) {
    const away = Math.hypot(x - 9e5 - near.points[i].x, y + 9e5 - near.points[i].y);
    assert.ok(away < 1e-6, `${away}`);
  }
});

test("a corner pressed twice does not change the route", () => {
  const [a, b, c, d] = placed(HALL);
  assert.deepEqual(plan([a, b, b, c, d, a]), plan([a, b, c, d]));
});

for (const [spacing, got] of [
  [0.1, "0.1 m"],
  [21, "21 m"],
  [-1, "-1 m"],
  [NaN, "no number"],
]) {
  test(`a spacing of ${got} is refused with the allowed range`, () => {
    const { problem, points } = plan(placed(HALL), { spacing });
    assert.equal(
      problem,
      `Got ${got}, expected a spacing of ${SPACING.least} to ${SPACING.most} m.`,
    );
    assert.deepEqual(points, []);
  });
}

test("too many points for the route are refused with their number and the limit", () => {
  assert.equal(plan(placed(HALL), { room: 6 }).points.length, 6);
  const { problem, points } = plan(placed(HALL), { room: 5 });
  assert.equal(
    problem,
    "Got 6 points, expected at most 5. " +
      "Use a larger spacing or a smaller area.",
  );
  assert.deepEqual(points, []);
});

test("an area as large as a country is refused with an estimate of its points", () => {
  const country = placed(HALL.map(([x, y]) => [x * 1e5, y * 1e5]));
  assert.match(plan(country).problem, /^Got at least 300000 points/);
});

test("an invalid area is refused with its own reason", () => {
  const bow = placed([HALL[0], HALL[1], HALL[3], HALL[2]]);
  assert.match(plan(bow).problem, /^Sides 2 and 4 cross or touch/);
  assert.equal(plan(placed(HALL.slice(0, 2))).problem, "Got 2 corners, expected at least 3. Add corners.");
});
