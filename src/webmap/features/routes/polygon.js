/** @typedef {import('../../web/view.js').Point} Point */

/** With more corners than this the preview could not follow the pointer. */
export const MOST_CORNERS = 60;

/** Smallest valid area, in m². */
export const LEAST_AREA = 0.1;

/** Corners closer together than this are one corner, from a double press; metres. */
const SAME = 0.01;

/** A point closer to a line than this is on the line; metres. */
const ON = 1e-6;

/**
 * @param {Point[]} corners
 * @returns {Point[]} The corners without repetitions of the previous corner.
 */
export function withoutRepetitions(corners) {
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
 * Return the reason why these corners form no area.
 *
 * @param {Point[]} corners As {@link withoutRepetitions} returns them, in metres.
 * @returns {string} The problem and the requirement; empty if the corners form an area.
 */
export function problemOf(corners) {
  const count = corners.length;
  if (count < 3) {
    const got = count === 1 ? "1 corner" : `${count} corners`;
    return `Got ${got}, expected at least 3. Add corners.`;
  }
  if (count > MOST_CORNERS) {
    return `Got ${count} corners, expected at most ${MOST_CORNERS}. Use fewer corners.`;
  }
  const sides = sidesOf(corners);
  for (let i = 0; i < count; i++) {
    for (let j = i + 2; j < count; j++) {
      const neighbours = i === 0 && j === count - 1;
      if (neighbours || !meet(sides[i], sides[j])) continue;
      return (
        `Sides ${i + 1} and ${j + 1} cross or touch: ` +
        "sides may meet only at corners. Move a corner."
      );
    }
  }
  const area = Math.abs(signedArea(corners));
  if (area >= LEAST_AREA) return "";
  return `Got ${area.toFixed(2)} m², expected at least ${LEAST_AREA} m². Use a larger area.`;
}

/**
 * @param {Point[]} corners
 * @returns {[Point, Point][]} The sides; the last side ends at the first corner.
 */
export function sidesOf(corners) {
  return corners.map((corner, i) => [corner, corners[(i + 1) % corners.length]]);
}

/**
 * @param {Point[]} corners
 * @returns {number} In m²; positive for counter-clockwise corners.
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
    // Of sides that differ only by rounding, the first one counts.
    if (length <= longest * (1 + 1e-9)) continue;
    longest = length;
    yaw = Math.atan2(q.y - p.y, q.x - p.x);
  }
  return yaw;
}

/**
 * @param {Point[]} corners Of a valid area by {@link problemOf}.
 * @param {Point} point
 * @returns {boolean} Whether the point is in the area, or on one of its sides.
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
 * @param {Point[]} corners Of a valid area by {@link problemOf}.
 * @param {Point} from In the area.
 * @param {Point} to
 * @returns {boolean} Whether the straight line between the two points stays in the
 *     area.
 */
export function isLineInside(corners, from, to) {
  // Between two crossings with sides the line is completely inside or outside.
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
 * @returns {number[]} Where a line meets a side, as fractions of the line.
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
 * @param {[Point, Point]} line From one point to another, which may be equal.
 * @param {Point} point
 * @returns {Point} The point of the line that is nearest.
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

/**
 * A straight part of the path over an area, in a frame with x along the sweeps.
 *
 * @typedef {object} Piece
 * @property {number | null} line The line of the piece, counted from 0; null for a
 *     piece into a corner.
 * @property {Point} a The left end; of a piece into a corner, the point where it leaves
 *     its sweep.
 * @property {Point} b
 * @property {number} [of] The piece that a piece into a corner leaves.
 */

/**
 * @typedef {{piece: number, end: number}} Entry A piece and one of its ends: 0 is `a`.
 */
/** @typedef {{entry: Entry, path: Point[], length: number}} Way */

/** Points closer together than this are one node, in metres. */
const SAME_NODE = 1e-9;

/** The paths inside of an area along its pieces, and between neighbouring pieces. */
export class SweepNet {
  /**
   * @param {Point[]} area Its corners.
   * @param {Piece[]} pieces
   */
  constructor(area, pieces) {
    this.pieces = pieces;
    this._area = area;
    /** @type {Point[]} */
    this._nodes = [];
    /** @type {Map<number, number>[]} Distances from each node to its neighbours. */
    this._links = [];
    /** @type {number[][]} The nodes on each piece. */
    this._on = pieces.map(() => []);
    /** @type {Set<number>[]} The neighbours of each piece. */
    this._beside = pieces.map(() => new Set());
    /** @type {number[][]} The nodes at the ends of each piece. */
    this._ends = pieces.map((piece, i) => this._endsOf(piece, i));
    this._join();
    for (const [i, { a }] of pieces.entries()) this._string(i, a);
  }

  /** @param {Entry} entry @returns {Point} */
  placeOf({ piece, end }) {
    return this._nodes[this._ends[piece][end]];
  }

  /** @param {Entry} entry @returns {Entry} The other end. */
  exitOf({ piece, end }) {
    return { piece, end: 1 - end };
  }

  /**
   * Return the next piece: a neighbour, or the nearest piece, on a path inside of the
   * area.
   *
   * @param {Entry} entry How the last piece was entered.
   * @param {Set<number>} todo
   * @returns {Way | null} null if no piece can be reached inside of the area.
   */
  next({ piece, end }, todo) {
    const from = this._ends[piece][1 - end];
    const { of } = this.pieces[piece];
    const beside = [...this._beside[piece], ...(of === undefined ? [] : this._beside[of])];
    const near = new Set(beside.filter((other) => todo.has(other)));
    const way = this._nearest(from, near) ?? this._nearest(from, todo);
    return way && { ...way, entry: this.cornerFirst(way.entry, todo) };
  }

  /**
   * Enter a corner before the sweep that begins at it; afterwards the corner would be
   * far.
   *
   * @param {Entry} entry
   * @param {Set<number>} todo
   * @returns {Entry}
   */
  cornerFirst(entry, todo) {
    const node = this._ends[entry.piece][entry.end];
    for (const piece of this._beside[entry.piece]) {
      const corner = this.pieces[piece].line === null;
      if (corner && todo.has(piece) && this._ends[piece][0] === node) {
        return { piece, end: 0 };
      }
    }
    return entry;
  }

  /** @param {Piece} piece @param {number} i */
  _endsOf({ a, b, of }, i) {
    if (of === undefined) return [this._nodeOn(i, a), this._nodeOn(i, b)];
    const shared = this._nodeOn(of, a);
    this._on[i].push(shared);
    this._beside[i].add(of);
    this._beside[of].add(i);
    return [shared, this._nodeOn(i, b)];
  }

  /** @param {number} piece @param {Point} place */
  _nodeOn(piece, place) {
    const there = this._on[piece].find((node) => between(this._nodes[node], place) < SAME_NODE);
    if (there !== undefined) return there;
    const node = this._nodes.push(place) - 1;
    this._links.push(new Map());
    this._on[piece].push(node);
    return node;
  }

  /** Link each piece to those on the next line. */
  _join() {
    /** @type {number[][]} */
    const lines = [];
    for (const [i, { line }] of this.pieces.entries()) {
      if (line !== null) (lines[line] ??= []).push(i);
    }
    lines.forEach((here, line) => {
      const next = lines[line + 1] ?? [];
      const pairs = here.flatMap((k) => next.map((l) => [k, l]));
      const faced = pairs.filter(([k, l]) => this._overlap(k, l) >= 0);
      const facing = new Set(faced.flat());
      for (const [k, l] of pairs) {
        // Diagonal links only where a piece has no piece opposite: a comb-shaped area
        // has many teeth.
        const aslant = !facing.has(k) || !facing.has(l);
        if (aslant || this._overlap(k, l) >= 0) this._joinTwo(k, l);
      }
    });
  }

  /** @param {number} k @param {number} l @returns {number} In metres; a gap is < 0. */
  _overlap(k, l) {
    const [p, q] = [this.pieces[k], this.pieces[l]];
    return Math.min(p.b.x, q.b.x) - Math.max(p.a.x, q.a.x);
  }

  /** @param {number} k @param {number} l */
  _joinTwo(k, l) {
    const [p, q] = [this.pieces[k], this.pieces[l]];
    const [left, right] = [Math.max(p.a.x, q.a.x), Math.min(p.b.x, q.b.x)];
    const [[ka, kb], [la, lb]] = [this._ends[k], this._ends[l]];
    const links = [this._link(ka, la), this._link(kb, lb)];
    if (left > right) links.push(q.a.x > p.b.x ? this._link(kb, la) : this._link(ka, lb));
    else {
      for (const x of [left, right]) {
        const below = this._nodeOn(k, { x, y: p.a.y });
        links.push(this._link(below, this._nodeOn(l, { x, y: q.a.y })));
      }
    }
    if (!links.some(Boolean)) return;
    this._beside[k].add(l);
    this._beside[l].add(k);
  }

  /**
   * @param {number} m
   * @param {number} n
   * @returns {boolean} Whether the straight line between the nodes stays in the area.
   */
  _link(m, n) {
    const [p, q] = [this._nodes[m], this._nodes[n]];
    if (!isLineInside(this._area, p, q)) return false;
    const length = between(p, q);
    this._links[m].set(n, length);
    this._links[n].set(m, length);
    return true;
  }

  /** @param {number} piece @param {Point} a Where the piece begins. */
  _string(piece, a) {
    const nodes = this._on[piece];
    nodes.sort((m, n) => between(a, this._nodes[m]) - between(a, this._nodes[n]));
    for (let i = 1; i < nodes.length; i++) this._link(nodes[i - 1], nodes[i]);
  }

  /**
   * @param {number} from
   * @param {Set<number>} wanted
   * @returns {Way | null} The shortest path to an end of one of these pieces.
   */
  _nearest(from, wanted) {
    /** @type {Map<number, Entry>} */
    const entries = new Map();
    for (const piece of wanted) {
      for (const end of [1, 0]) entries.set(this._ends[piece][end], { piece, end });
    }
    const lengths = new Map([[from, 0]]);
    /** @type {Map<number, number>} */
    const before = new Map();
    const open = new Set([from]);
    while (entries.size > 0 && open.size > 0) {
      const here = leastOf(open, lengths);
      const length = lengths.get(here) ?? 0;
      const entry = entries.get(here);
      if (entry) return { entry, length, path: this._path(here, before) };
      open.delete(here);
      for (const [there, more] of this._links[here]) {
        if (length + more >= (lengths.get(there) ?? Infinity)) continue;
        lengths.set(there, length + more);
        before.set(there, here);
        open.add(there);
      }
    }
    return null;
  }

  /** @param {number} node @param {Map<number, number>} before */
  _path(node, before) {
    const path = [this._nodes[node]];
    for (let at = before.get(node); at !== undefined; at = before.get(at)) {
      path.unshift(this._nodes[at]);
    }
    return path;
  }
}

/** @param {Set<number>} open @param {Map<number, number>} lengths */
function leastOf(open, lengths) {
  let [least] = open;
  for (const node of open) {
    if ((lengths.get(node) ?? 0) < (lengths.get(least) ?? 0)) least = node;
  }
  return least;
}
