/** Areas for sweeps, and their geometry computed without the code under test. */

/** Areas with bays; a robot can reach all parts without leaving the area. */
export const BAYS = {
  "two arms": [
    [0, 0],
    [12, 0],
    [12, 8],
    [9, 8],
    [9, 3],
    [3, 3],
    [3, 8],
    [0, 8],
  ],
  "a stem": [
    [0, 0],
    [12, 0],
    [12, 3],
    [7, 3],
    [7, 10],
    [5, 10],
    [5, 3],
    [0, 3],
  ],
  "a comb": [
    [0, 0],
    [15, 0],
    [15, 7],
    [13, 7],
    [13, 2],
    [9, 2],
    [9, 7],
    [6, 7],
    [6, 2],
    [2, 2],
    [2, 7],
    [0, 7],
  ],
  "a coil": [
    [0, 0],
    [12, 0],
    [12, 10],
    [3, 10],
    [3, 5],
    [6, 5],
    [6, 7.5],
    [9, 7.5],
    [9, 2.5],
    [0, 2.5],
  ],
};

/** Numbers from 0 to 1 that are the same in every run. */
export function numbersFrom(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** Return corners given as [x, y], turned by a yaw and moved to a place on the map. */
export function placed(corners, yaw = 0, [x0, y0] = [0, 0]) {
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return corners.map(([x, y]) => ({ x: x0 + cos * x - sin * y, y: y0 + sin * x + cos * y }));
}

/** Without bays: on an ellipse, some of them with sharp corners. */
export function roundArea(number) {
  const count = 3 + Math.floor(number() * 7);
  const angles = Array.from({ length: count }, () => number() * 2 * Math.PI);
  angles.sort((a, b) => a - b);
  const [across, down] = [2 + number() * 12, 1 + number() * 8];
  const corners = angles.map((angle) => [across * Math.cos(angle), down * Math.sin(angle)]);
  const where = [number() * 200 - 100, number() * 200 - 100];
  return placed(corners, number() * 7, where);
}

/** With bays: each corner is in its own direction from the middle, near or far. */
export function starArea(number) {
  const count = 5 + Math.floor(number() * 9);
  const corners = Array.from({ length: count }, (_, i) => {
    const angle = ((i + 0.2 + 0.6 * number()) / count) * 2 * Math.PI;
    const away = 2 + number() * 8;
    return [away * Math.cos(angle), away * Math.sin(angle)];
  });
  return placed(corners, number() * 7, [number() * 200 - 100, number() * 200 - 100]);
}

/** In metres. */
export function shortestSide(area) {
  const sides = area.map((p, i) => {
    const q = area[(i + 1) % area.length];
    return Math.hypot(q.x - p.x, q.y - p.y);
  });
  return Math.min(...sides);
}

/** In m², by the shoelace formula. */
export function sizeOf(area) {
  const sum = area.reduce((all, p, i) => {
    const q = area[(i + 1) % area.length];
    return all + p.x * q.y - q.x * p.y;
  }, 0);
  return Math.abs(sum) / 2;
}

/** Metres from a point to the straight line between two other points. */
export function awayFrom([p, q], { x, y }) {
  const [dx, dy] = [q.x - p.x, q.y - p.y];
  const length2 = dx * dx + dy * dy;
  const part = length2 === 0 ? 0 : ((x - p.x) * dx + (y - p.y) * dy) / length2;
  const t = Math.max(0, Math.min(1, part));
  return Math.hypot(x - p.x - t * dx, y - p.y - t * dy);
}

/** Whether a point is in an area or on its edge, by the winding number. */
export function isIn(area, point) {
  let turned = 0;
  for (const [i, p] of area.entries()) {
    const q = area[(i + 1) % area.length];
    if (awayFrom([p, q], point) < 1e-6) return true;
    const from = Math.atan2(p.y - point.y, p.x - point.x);
    const to = Math.atan2(q.y - point.y, q.x - point.x);
    turned += Math.atan2(Math.sin(to - from), Math.cos(to - from));
  }
  return Math.abs(turned) > Math.PI;
}

/** Points along a straight line, including both ends. */
export function along(p, q, count = 20) {
  return Array.from({ length: count + 1 }, (_, i) => {
    const t = i / count;
    return { x: p.x + t * (q.x - p.x), y: p.y + t * (q.y - p.y) };
  });
}

/** Points all over an area and along its edge. */
export function spread(area, count = 25) {
  const edge = area.flatMap((p, i) => along(p, area[(i + 1) % area.length]));
  const [xs, ys] = [area.map(({ x }) => x), area.map(({ y }) => y)];
  const [low, high] = [
    { x: Math.min(...xs), y: Math.min(...ys) },
    { x: Math.max(...xs), y: Math.max(...ys) },
  ];
  const grid = along({ x: low.x, y: 0 }, { x: high.x, y: 0 }, count).flatMap(({ x }) =>
    along({ x, y: low.y }, { x, y: high.y }, count),
  );
  return [...edge, ...grid.filter((point) => isIn(area, point))];
}
