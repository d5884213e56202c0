import {
  along,
  between,
  cleaned,
  holds,
  longestSide,
  nearestOn,
  problemOf,
  sidesOf,
  signedArea,
  SweepNet,
} from "./polygon.js";

/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('./polygon.js').Piece} Piece */
/** @typedef {import('./polygon.js').Entry} Entry */
/** @typedef {import('../../web/view.js').Point} Point */

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
 * @param {Leg[]} legs
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
  /** @param {Leg} leg @returns {[Point, Point]} */
  const asSweep = ({ from, to }) => [frame.outOf(from), frame.outOf(to)];
  return { problem: "", points, sweeps: legs.map(asSweep) };
}

/** @param {Point} from @param {Point} to @returns {number} Along the sweeps if both are one. */
function headingTo(from, to) {
  return between(from, to) > SAME ? Math.atan2(to.y - from.y, to.x - from.x) : 0;
}

/** From so many ends of the first and last line at most an order is tried. */
const MOST_STARTS = 8;

/**
 * A piece of the way, and how one gets to it from the one before.
 *
 * @typedef {object} Leg
 * @property {Point[]} via Places on the way, where the straight one would leave the area.
 * @property {Point} from
 * @property {Point} to
 */

/**
 * An order, with the paths of the net to each piece: both of their ends too.
 *
 * @typedef {{steps: {entry: Entry, path: Point[]}[], jumps: number, between: number}} Walk
 */

/**
 * Put the pieces of an area into an order.
 *
 * From each one goes to a piece beside it, and to the nearest that is left if there is
 * none; ways between them stay in the area wherever one is found there. Several
 * beginnings are tried: the one that leaves the area least is taken, of these the one
 * with the shortest ways between pieces, of these the one nearest to the first corner.
 *
 * @param {Point[]} area Its corners.
 * @param {Piece[]} pieces
 * @returns {Leg[]}
 */
function inOrder(area, pieces) {
  const net = new SweepNet(area, pieces);
  /** @type {Walk | null} */
  let best = null;
  for (const start of startsOf(area[0], pieces)) {
    const walk = walked(area, net, start);
    if (best === null || isBetter(walk, best)) best = walk;
  }
  const steps = best?.steps ?? [];
  return steps.map(({ entry, path }) => ({
    via: shortened(area, path),
    from: net.placeOf(entry),
    to: net.placeOf(net.exitOf(entry)),
  }));
}

/**
 * @param {Point} first
 * @param {Piece[]} pieces
 * @returns {Entry[]} The nearest to the first corner is the first.
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
function walked(area, net, start) {
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
    if (!holds(area, here, net.placeOf(entry))) walk.jumps += 1;
    walk.between += between(here, net.placeOf(entry));
  }
}

/**
 * @param {SweepNet} net
 * @param {Point} from
 * @param {Set<number>} todo
 * @returns {Entry} As the crow flies.
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
 * @returns {Point[]} What is left between its ends, where straight ways stay in the area.
 */
function shortened(area, path) {
  /** @type {Point[]} */
  const via = [];
  const last = path.length - 1;
  for (let here = 0; here < last; ) {
    let there = last;
    while (there > here + 1 && !holds(area, path[here], path[there])) there -= 1;
    if (there < last) via.push(path[there]);
    here = there;
  }
  return via;
}
