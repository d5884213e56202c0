/** @typedef {import('../view.js').Point} Point */

/** With more corners than this a preview would not keep up with the pointer. */
export const MOST_CORNERS = 60;

/** The smallest area that is one, in m². */
export const LEAST_AREA = 0.1;

/** Corners nearer to each other are one: a double press, in metres. */
const SAME = 0.01;

/** What is nearer to a line than this lies on it, in metres. */
const ON = 1e-6;

/**
 * @param {Point[]} corners
 * @returns {Point[]} The corners without those that repeat the one before.
 */
export function cleaned(corners) {
  /** @type {Point[]} */
  const kept = [];
  for (const corner of corners) {
    const last = kept.at(-1);
    if (!last || between(last, corner) >= SAME) kept.push(corner);
  }
  while (kept.length > 1 && between(kept[0], kept[kept.length - 1]) < SAME) kept.pop();
  return kept;
}

/**
 * Say why these corners make no area.
 *
 * @param {Point[]} corners As {@link cleaned} returns them, in metres.
 * @returns {string} What was got and what is needed; empty if they make one.
 */
export function problemOf(corners) {
  const count = corners.length;
  if (count < 3) return `Got ${count} ${count === 1 ? "corner" : "corners"}: 3 are needed.`;
  if (count > MOST_CORNERS) {
    return `Got ${count} corners: an area has ${MOST_CORNERS} at most.`;
  }
  const sides = sidesOf(corners);
  for (let i = 0; i < count; i++) {
    for (let j = i + 2; j < count; j++) {
      const neighbours = i === 0 && j === count - 1;
      if (neighbours || !meet(sides[i], sides[j])) continue;
      return (
        `Sides ${i + 1} and ${j + 1} cross or touch: ` +
        "sides that meet only at their corners are needed."
      );
    }
  }
  const area = Math.abs(signedArea(corners));
  if (area >= LEAST_AREA) return "";
  return `Got ${area.toFixed(2)} m²: an area has ${LEAST_AREA} m² at least.`;
}

/**
 * @param {Point[]} corners
 * @returns {[Point, Point][]} The sides; the last one leads back to the first corner.
 */
export function sidesOf(corners) {
  return corners.map((corner, i) => [corner, corners[(i + 1) % corners.length]]);
}

/**
 * @param {Point[]} corners
 * @returns {number} In m²; positive if they go counter-clockwise.
 */
export function signedArea(corners) {
  const [{ x: x0, y: y0 }] = corners;
  return (
    sidesOf(corners).reduce(
      (sum, [p, q]) => sum + (p.x - x0) * (q.y - y0) - (q.x - x0) * (p.y - y0),
      0,
    ) / 2
  );
}

/**
 * @param {Point[]} corners
 * @returns {number} The direction of the longest side, in radians.
 */
export function longestSide(corners) {
  let longest = 0;
  let yaw = 0;
  for (const [p, q] of sidesOf(corners)) {
    const length = between(p, q);
    // Of sides that are as long but for rounding the first one counts.
    if (length <= longest * (1 + 1e-9)) continue;
    longest = length;
    yaw = Math.atan2(q.y - p.y, q.x - p.x);
  }
  return yaw;
}

/**
 * @param {Point[]} corners Of an area that {@link problemOf} has nothing against.
 * @param {Point} point
 * @returns {boolean} Whether it lies in the area, or on a side of it.
 */
export function contains(corners, point) {
  let inside = false;
  for (const [p, q] of sidesOf(corners)) {
    if (awayFrom([p, q], point) <= ON) return true;
    if (p.y > point.y === q.y > point.y) continue;
    const x = p.x + ((point.y - p.y) / (q.y - p.y)) * (q.x - p.x);
    if (point.x < x) inside = !inside;
  }
  return inside;
}

/**
 * @param {Point[]} corners Of an area that {@link problemOf} has nothing against.
 * @param {Point} from In the area.
 * @param {Point} to
 * @returns {boolean} Whether the straight way between them stays in the area.
 */
export function holds(corners, from, to) {
  // Between two places where it meets sides it is inside as a whole, or outside.
  const cuts = [0, 1];
  for (const side of sidesOf(corners)) cuts.push(...cutsOf(from, to, side));
  cuts.sort((a, b) => a - b);
  return cuts.every((cut, i) => {
    const middle = (cut + (cuts[i + 1] ?? cut)) / 2;
    return contains(corners, along(from, to, middle));
  });
}

/**
 * @param {Point} from
 * @param {Point} to
 * @param {[Point, Point]} side
 * @returns {number[]} Where a way meets a side, as parts of the way.
 */
function cutsOf(from, to, [p, q]) {
  const [dx, dy, ex, ey] = [to.x - from.x, to.y - from.y, q.x - p.x, q.y - p.y];
  const turn = dx * ey - dy * ex;
  const length2 = dx * dx + dy * dy;
  if (length2 === 0) return [];
  /** @param {Point} point */
  const part = ({ x, y }) => ((x - from.x) * dx + (y - from.y) * dy) / length2;
  /** @type {number[]} */
  let cuts = [];
  if (Math.abs(turn) < 1e-12) cuts = [part(p), part(q)];
  else {
    const [fx, fy] = [p.x - from.x, p.y - from.y];
    const onSide = (fx * dy - fy * dx) / turn;
    if (onSide > -ON && onSide < 1 + ON) cuts = [(fx * ey - fy * ex) / turn];
  }
  return cuts.filter((cut) => cut > 0 && cut < 1);
}

/**
 * @param {[Point, Point]} one
 * @param {[Point, Point]} other
 * @returns {boolean} Whether two sides cross or touch.
 */
function meet(one, other) {
  const [a, b] = one;
  const [c, d] = other;
  const crossed =
    sideOf(one, c) * sideOf(one, d) < 0 && sideOf(other, a) * sideOf(other, b) < 0;
  return (
    crossed ||
    Math.min(awayFrom(one, c), awayFrom(one, d), awayFrom(other, a), awayFrom(other, b)) <=
      ON
  );
}

/** @param {[Point, Point]} side @param {Point} point */
function sideOf([p, q], { x, y }) {
  return Math.sign((q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x));
}

/**
 * @param {[Point, Point]} line From one point to another, which may be the same.
 * @param {Point} point
 * @returns {Point} What of the line is nearest to the point.
 */
export function nearestOn([p, q], { x, y }) {
  const [dx, dy] = [q.x - p.x, q.y - p.y];
  const length2 = dx * dx + dy * dy;
  if (length2 === 0) return p;
  const part = ((x - p.x) * dx + (y - p.y) * dy) / length2;
  return along(p, q, Math.min(1, Math.max(0, part)));
}

/** @param {[Point, Point]} line @param {Point} point */
function awayFrom(line, point) {
  return between(point, nearestOn(line, point));
}

/** @param {Point} p @param {Point} q @param {number} part From 0 to 1. @returns {Point} */
export function along(p, q, part) {
  return { x: p.x + (q.x - p.x) * part, y: p.y + (q.y - p.y) * part };
}

/** @param {Point} p @param {Point} q @returns {number} In metres. */
export function between(p, q) {
  return Math.hypot(q.x - p.x, q.y - p.y);
}
