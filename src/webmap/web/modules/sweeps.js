import { along, between, cleaned, holds, longestSide } from "./polygon.js";
import { nearestOn, problemOf, sidesOf, signedArea } from "./polygon.js";
import { inOrder } from "./sweep_order.js";

/** @typedef {import('../view.js').Point} Point */
/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('./sweep_net.js').Piece} Piece */

/** How far sweeps may be apart, and are if nobody says, in metres. */
export const SPACING = { least: 0.2, most: 20, usual: 1 };

/** What is nearer than this is one place, in metres. */
const SAME = 1e-6;

/**
 * How an area is gone over, back and forth.
 *
 * @typedef {object} Plan
 * @property {string} problem Why there is none, in a sentence; empty if there is one.
 * @property {Pose[]} points What a robot goes to: both ends of each sweep, heading along
 *     it, and where a way between two sweeps turns.
 * @property {[Point, Point][]} sweeps Each from where it begins to where it ends.
 */

/**
 * Lay parallel sweeps over an area, in metres of the map.
 *
 * The first and the last keep half of the spacing from the area's bounds, and each ends
 * as long before the side that it comes to; where there is less room, in the middle of
 * it. A corner that would be farther from all sweeps than the spacing gets one of its
 * own. Of an area without bays all is within the spacing of a sweep then: half of it
 * between sweeps, and half of it at the sides.
 *
 * @param {Point[]} corners
 * @param {object} how
 * @param {number} how.spacing Metres from sweep to sweep, at most.
 * @param {boolean} [how.across] Whether they go across the longest side, not along it.
 * @param {number} how.room As many points as there may be.
 * @returns {Plan}
 */
export function planSweeps(corners, { spacing, across = false, room }) {
  const area = cleaned(corners);
  const problem = problemOf(area) || problemOfSpacing(spacing);
  if (problem) return none(problem);
  const frame = frameOf(area[0], longestSide(area) + (across ? Math.PI / 2 : 0));
  const local = area.map(frame.into);
  const lines = linesOver(local, spacing);
  // Every line has a point at least; what is too much anyway is not laid first.
  if (lines.count > room) return none(tooMany(lines.count, room, "at least "));
  const straight = Array.from({ length: lines.count }, (_, line) =>
    clipped(local, lines.at(line), spacing / 2).map(([a, b]) => ({ line, a, b })),
  ).flat();
  if (straight.length > room) return none(tooMany(straight.length, room, "at least "));
  const pieces = [...straight, ...intoCorners(local, straight, spacing)];
  const plan = asPlan(inOrder(local, pieces), frame);
  const { length } = plan.points;
  return length > room ? none(tooMany(length, room, "")) : plan;
}

/** @param {string} problem @returns {Plan} */
function none(problem) {
  return { problem, points: [], sweeps: [] };
}

/** @param {number} spacing */
function problemOfSpacing(spacing) {
  if (spacing >= SPACING.least && spacing <= SPACING.most) return "";
  const got = Number.isFinite(spacing) ? `${spacing} m` : "no number";
  return `Got ${got}: sweeps are ${SPACING.least} to ${SPACING.most} m apart.`;
}

/** @param {number} count @param {number} room @param {string} least */
function tooMany(count, room, least) {
  return (
    `These sweeps need ${least}${count} points, and the route has room for ${room}: ` +
    "a larger distance or a smaller area is needed."
  );
}

/**
 * @param {Point} origin
 * @param {number} yaw
 * @returns {{yaw: number, into: (p: Point) => Point, outOf: (p: Point) => Point}} To a
 *     frame with x along the sweeps, and back. Its origin is near, as the map's may be
 *     so far away that little is left of a number's digits.
 */
function frameOf(origin, yaw) {
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return {
    yaw,
    into: ({ x, y }) => {
      const [dx, dy] = [x - origin.x, y - origin.y];
      return { x: cos * dx + sin * dy, y: cos * dy - sin * dx };
    },
    outOf: ({ x, y }) => ({
      x: origin.x + cos * x - sin * y,
      y: origin.y + sin * x + cos * y,
    }),
  };
}

/**
 * @param {Point[]} area
 * @param {number} spacing
 * @returns {{count: number, at: (line: number) => number}} The lines, and where they lie.
 */
function linesOver(area, spacing) {
  const ys = area.map(({ y }) => y);
  const [low, high] = [Math.min(...ys), Math.max(...ys)];
  const rest = high - low - spacing;
  // What is only rounding needs no line of its own.
  const gaps = Math.max(0, Math.ceil(rest / spacing - 1e-9));
  if (gaps === 0) return { count: 1, at: () => (low + high) / 2 };
  return { count: gaps + 1, at: (line) => low + spacing / 2 + (line * rest) / gaps };
}

/**
 * @param {Point[]} area
 * @param {number} y
 * @param {number} inset By how much it is shorter at each end.
 * @returns {[Point, Point][]} What of a line lies in the area, from left to right.
 */
function clipped(area, y, inset) {
  const xs = sidesOf(area).flatMap(([p, q]) =>
    p.y <= y === q.y <= y ? [] : p.x + ((y - p.y) / (q.y - p.y)) * (q.x - p.x),
  );
  xs.sort((a, b) => a - b);
  /** @type {[Point, Point][]} */
  const parts = [];
  for (let i = 0; i + 1 < xs.length; i += 2) {
    // A corner that the line only touches.
    if (xs[i + 1] - xs[i] < SAME) continue;
    const middle = (xs[i] + xs[i + 1]) / 2;
    parts.push([
      { x: Math.min(xs[i] + inset, middle), y },
      { x: Math.max(xs[i + 1] - inset, middle), y },
    ]);
  }
  return parts;
}

/**
 * @param {Point[]} area
 * @param {Piece[]} straight
 * @param {number} spacing
 * @returns {Piece[]} From sweeps into the corners that these leave out.
 */
function intoCorners(area, straight, spacing) {
  const turn = Math.sign(signedArea(area));
  const pieces = [...straight];
  for (const [i, corner] of area.entries()) {
    const before = area.at(i - 1) ?? corner;
    const after = area[(i + 1) % area.length];
    if (signedArea([before, corner, after]) * turn <= 0) continue;
    const near = nearestSweep(area, pieces, corner);
    if (!near || between(near.at, corner) <= spacing) continue;
    const inset = spacing / 2 / between(near.at, corner);
    const b = along(corner, near.at, inset);
    pieces.push({ line: null, a: near.at, b, of: near.piece });
  }
  return pieces.slice(straight.length);
}

/**
 * @param {Point[]} area
 * @param {Piece[]} pieces
 * @param {Point} corner
 * @returns {{at: Point, piece: number} | undefined} The nearest place on a sweep to
 *     which the straight way stays in the area.
 */
function nearestSweep(area, pieces, corner) {
  return pieces
    .map(({ a, b }, piece) => ({ at: nearestOn([a, b], corner), piece }))
    .sort((p, q) => between(p.at, corner) - between(q.at, corner))
    .find(({ at }) => holds(area, corner, at));
}

/**
 * @param {import('./sweep_order.js').Leg[]} legs
 * @param {ReturnType<typeof frameOf>} frame
 * @returns {Plan}
 */
function asPlan(legs, frame) {
  /** @type {Pose[]} */
  const points = [];
  const add = (/** @type {Point} */ at, /** @type {number} */ heading) => {
    const [cos, sin] = [Math.cos(heading + frame.yaw), Math.sin(heading + frame.yaw)];
    points.push({ ...frame.outOf(at), yaw: Math.atan2(sin, cos) });
  };
  /** @type {Point | null} */
  let last = null;
  for (const { via, from, to } of legs) {
    for (const [i, at] of via.entries()) add(at, headingTo(at, via[i + 1] ?? from));
    const heading = headingTo(from, to);
    // A sweep into a corner may begin where the one before has ended.
    if (via.length > 0 || !last || between(last, from) > SAME) add(from, heading);
    if (between(from, to) > SAME) add(to, heading);
    last = to;
  }
  /** @param {import('./sweep_order.js').Leg} leg @returns {[Point, Point]} */
  const asSweep = ({ from, to }) => [frame.outOf(from), frame.outOf(to)];
  return { problem: "", points, sweeps: legs.map(asSweep) };
}

/** @param {Point} from @param {Point} to @returns {number} Along the sweeps if both are one. */
function headingTo(from, to) {
  return between(from, to) > SAME ? Math.atan2(to.y - from.y, to.x - from.x) : 0;
}
