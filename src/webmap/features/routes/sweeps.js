import {
  along,
  between,
  isLineInside,
  longestSide,
  nearestOn,
  problemOf,
  sidesOf,
  signedArea,
  SweepNet,
  withoutRepetitions,
} from "./polygon.js";

/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('./polygon.js').Piece} Piece */
/** @typedef {import('./polygon.js').Entry} Entry */
/** @typedef {import('../../web/view.js').Point} Point */

/** Smallest, greatest and default distance between sweeps, in metres. */
export const SPACING = { least: 0.2, most: 20, usual: 1 };

/** Points closer together than this are one point, in metres. */
const SAME = 1e-6;

/**
 * The sweeps over an area, back and forth.
 *
 * @typedef {object} Plan
 * @property {string} problem Why there is no plan, as a sentence; empty if there is
 *     one.
 * @property {Pose[]} points The robot's goals: both ends of each sweep, with the
 *     heading along it, and the turning points of the path between two sweeps.
 * @property {[Point, Point][]} sweeps Each from its beginning to its end.
 */

/**
 * Lay parallel sweeps over an area, in metres of the map.
 *
 * The first and the last sweep keep a distance of half the spacing from the area's
 * bounds, and each sweep ends at the same distance before a side; where there is less
 * room, in its middle. A corner that would be farther from all sweeps than the spacing
 * gets its own sweep. In an area without bays every point is then within one spacing of
 * a sweep: half a spacing between sweeps, and half a spacing at the sides.
 *
 * @param {Point[]} corners
 * @param {object} how
 * @param {number} how.spacing Greatest distance between sweeps, in metres.
 * @param {boolean} [how.across] Whether sweeps are across the longest side, not along
 *     it.
 * @param {number} how.room Greatest number of points.
 * @returns {Plan}
 */
export function planSweeps(corners, { spacing, across = false, room }) {
  const area = withoutRepetitions(corners);
  const problem = problemOf(area) || problemOfSpacing(spacing);
  if (problem) return noPlan(problem);
  const frame = frameOf(area[0], longestSide(area) + (across ? Math.PI / 2 : 0));
  const local = area.map(frame.into);
  const lines = linesOver(local, spacing);
  // Every line has at least one point; an obviously too large number is not planned.
  if (lines.count > room) return noPlan(tooMany(lines.count, room, "at least "));
  const straight = Array.from({ length: lines.count }, (_, line) =>
    partsInArea(local, lines.at(line), spacing / 2).map(([a, b]) => ({ line, a, b })),
  ).flat();
  if (straight.length > room) return noPlan(tooMany(straight.length, room, "at least "));
  const pieces = [...straight, ...cornerPieces(local, straight, spacing)];
  const plan = planOf(orderPieces(local, pieces), frame);
  const { length } = plan.points;
  return length > room ? noPlan(tooMany(length, room, "")) : plan;
}

/** @param {string} problem @returns {Plan} */
function noPlan(problem) {
  return { problem, points: [], sweeps: [] };
}

/** @param {number} spacing */
function problemOfSpacing(spacing) {
  if (spacing >= SPACING.least && spacing <= SPACING.most) return "";
  const got = Number.isFinite(spacing) ? `${spacing} m` : "no number";
  return `Got ${got}, expected a spacing of ${SPACING.least} to ${SPACING.most} m.`;
}

/** @param {number} count @param {number} room @param {string} least */
function tooMany(count, room, least) {
  return (
    `Got ${least}${count} points, expected at most ${room}. ` +
    "Use a larger spacing or a smaller area."
  );
}

/**
 * @param {Point} origin
 * @param {number} yaw
 * @returns {{yaw: number, into: (p: Point) => Point, outOf: (p: Point) => Point}}
 *     Transforms to a frame with x along the sweeps, and back. The frame's origin is
 *     near the area, because far from the map's origin numbers lose precision.
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
 * @returns {{count: number, at: (line: number) => number}} The number of lines, and
 *     their positions.
 */
function linesOver(area, spacing) {
  const ys = area.map(({ y }) => y);
  const [low, high] = [Math.min(...ys), Math.max(...ys)];
  const rest = high - low - spacing;
  // A rounding error must not add a line.
  const gaps = Math.max(0, Math.ceil(rest / spacing - 1e-9));
  if (gaps === 0) return { count: 1, at: () => (low + high) / 2 };
  return { count: gaps + 1, at: (line) => low + spacing / 2 + (line * rest) / gaps };
}

/**
 * @param {Point[]} area
 * @param {number} y
 * @param {number} inset Length to remove at each end.
 * @returns {[Point, Point][]} The parts of a line in the area, from left to right.
 */
function partsInArea(area, y, inset) {
  const xs = sidesOf(area).flatMap(([p, q]) =>
    p.y <= y === q.y <= y ? [] : p.x + ((y - p.y) / (q.y - p.y)) * (q.x - p.x),
  );
  xs.sort((a, b) => a - b);
  /** @type {[Point, Point][]} */
  const parts = [];
  for (let i = 0; i + 1 < xs.length; i += 2) {
    // The line only touches a corner here.
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
 * @returns {Piece[]} Pieces from sweeps into the corners that the sweeps leave out.
 */
function cornerPieces(area, straight, spacing) {
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
 * @returns {{at: Point, piece: number} | undefined} The nearest point on a sweep from
 *     which the straight line to the corner stays in the area.
 */
function nearestSweep(area, pieces, corner) {
  return pieces
    .map(({ a, b }, piece) => ({ at: nearestOn([a, b], corner), piece }))
    .sort((p, q) => between(p.at, corner) - between(q.at, corner))
    .find(({ at }) => isLineInside(area, corner, at));
}

/**
 * @param {Leg[]} legs
 * @param {ReturnType<typeof frameOf>} frame
 * @returns {Plan}
 */
function planOf(legs, frame) {
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
    // A piece into a corner may begin where the last sweep ended.
    if (via.length > 0 || !last || between(last, from) > SAME) add(from, heading);
    if (between(from, to) > SAME) add(to, heading);
    last = to;
  }
  /** @param {Leg} leg @returns {[Point, Point]} */
  const asSweep = ({ from, to }) => [frame.outOf(from), frame.outOf(to)];
  return { problem: "", points, sweeps: legs.map(asSweep) };
}

/**
 * @param {Point} from
 * @param {Point} to
 * @returns {number} In radians; along the sweeps for equal points.
 */
function headingTo(from, to) {
  return between(from, to) > SAME ? Math.atan2(to.y - from.y, to.x - from.x) : 0;
}

/** Greatest number of ends of the first and last line from which an order is tried. */
const MOST_STARTS = 8;

/**
 * A piece of the path, and the connection from the previous piece.
 *
 * @typedef {object} Leg
 * @property {Point[]} via Points on the connection, where the straight line would leave
 *     the area.
 * @property {Point} from
 * @property {Point} to
 */

/**
 * An order of pieces, with the net's paths to each piece, including both ends.
 *
 * @typedef {{steps: {entry: Entry, path: Point[]}[], jumps: number, between: number}}
 *     Walk
 */

/**
 * Find an order of the pieces of an area.
 *
 * The next piece is a neighbour, or the nearest piece if there is no neighbour left;
 * paths between pieces stay in the area where possible. Several starts are tried. The
 * best order leaves the area least often; of equal orders the one with the shortest
 * paths between pieces is taken, then the one nearest to the first corner.
 *
 * @param {Point[]} area Its corners.
 * @param {Piece[]} pieces
 * @returns {Leg[]}
 */
function orderPieces(area, pieces) {
  const net = new SweepNet(area, pieces);
  /** @type {Walk | null} */
  let best = null;
  for (const start of startsOf(area[0], pieces)) {
    const walk = walkFrom(area, net, start);
    if (best === null || isBetter(walk, best)) best = walk;
  }
  const steps = best?.steps ?? [];
  return steps.map(({ entry, path }) => ({
    via: withoutDetours(area, path),
    from: net.placeOf(entry),
    to: net.placeOf(net.exitOf(entry)),
  }));
}

/**
 * @param {Point} first
 * @param {Piece[]} pieces
 * @returns {Entry[]} The nearest to the first corner comes first.
 */
function startsOf(first, pieces) {
  const last = Math.max(...pieces.map(({ line }) => line ?? 0));
  return pieces
    .flatMap(({ line, a, b }, piece) =>
      line === 0 || line === last
        ? [
            { piece, end: 0, away: between(first, a) },
            { piece, end: 1, away: between(first, b) },
          ]
        : [],
    )
    .sort((one, other) => one.away - other.away)
    .slice(0, MOST_STARTS);
}

/** @param {Walk} one @param {Walk} other */
function isBetter(one, other) {
  if (one.jumps !== other.jumps) return one.jumps < other.jumps;
  return one.between < other.between - 1e-6;
}

/**
 * @param {Point[]} area
 * @param {SweepNet} net
 * @param {Entry} start
 * @returns {Walk}
 */
function walkFrom(area, net, start) {
  const todo = new Set(net.pieces.keys());
  /** @type {Walk} */
  const walk = { steps: [], jumps: 0, between: 0 };
  let entry = net.cornerFirst(start, todo);
  /** @type {Point[]} */
  let path = [];
  for (;;) {
    todo.delete(entry.piece);
    walk.steps.push({ entry, path });
    if (todo.size === 0) return walk;
    const way = net.next(entry, todo);
    if (way) {
      ({ entry, path } = way);
      walk.between += way.length;
      continue;
    }
    const here = net.placeOf(net.exitOf(entry));
    entry = nearest(net, here, todo);
    path = [];
    if (!isLineInside(area, here, net.placeOf(entry))) walk.jumps += 1;
    walk.between += between(here, net.placeOf(entry));
  }
}

/**
 * @param {SweepNet} net
 * @param {Point} from
 * @param {Set<number>} todo
 * @returns {Entry} The nearest by straight distance.
 */
function nearest(net, from, todo) {
  const entries = [...todo].flatMap((piece) => [
    { piece, end: 0 },
    { piece, end: 1 },
  ]);
  const away = entries.map((entry) => between(from, net.placeOf(entry)));
  return entries[away.indexOf(Math.min(...away))];
}

/**
 * @param {Point[]} area
 * @param {Point[]} path
 * @returns {Point[]} The necessary points between the ends, where straight lines stay
 *     in the area.
 */
function withoutDetours(area, path) {
  /** @type {Point[]} */
  const via = [];
  const last = path.length - 1;
  for (let here = 0; here < last; ) {
    let there = last;
    while (there > here + 1 && !isLineInside(area, path[here], path[there])) there -= 1;
    if (there < last) via.push(path[there]);
    here = there;
  }
  return via;
}
