import { SweepNet } from "./sweep_net.js";
import { between, holds } from "./polygon.js";

/** @typedef {import('../view.js').Point} Point */
/** @typedef {import('./sweep_net.js').Piece} Piece */
/** @typedef {import('./sweep_net.js').Entry} Entry */

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
export function inOrder(area, pieces) {
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
