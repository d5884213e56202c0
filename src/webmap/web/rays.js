/** @typedef {import('./wire.js').Reader} Reader */

/** Flags of the form; this file is the other side of `webmap/scene/wire/rays.py`. */
const PLACED = 1;
const MOVED = 2;
/** Zeros before a whole number, and its bits. */
const LONGEST = 12;
const WHOLE = 18;

/** Metres in one unit of dots, while all points fit in 16 bits. */
const UNIT = 0.001;
const MOST = 32767;

/** Reads single bits, from the highest of each byte. */
class Bits {
  /** @param {Reader} reader */
  constructor(reader) {
    this._reader = reader;
    this._byte = 0;
    this._left = 0;
  }

  bit() {
    if (this._left === 0) {
      this._byte = this._reader.u8();
      this._left = 8;
    }
    this._left -= 1;
    return (this._byte >> this._left) & 1;
  }

  /** @param {number} count */
  number(count) {
    let found = 0;
    for (let left = count; left > 0; left--) found = (found << 1) | this.bit();
    return found;
  }

  /** @param {number} bits */
  rice(bits) {
    let zeros = 0;
    while (this.bit() === 0) zeros += 1;
    if (zeros >= LONGEST) return this.number(WHOLE);
    return (zeros << bits) | this.number(bits);
  }
}

/**
 * @param {Reader} r
 * @param {number} count
 * @returns {number[]}
 */
function numbers(r, count) {
  const last = r.u8();
  const bits = new Bits(r);
  return Array.from({ length: count }, () => bits.rice(last));
}

/**
 * @param {Reader} r
 * @param {number} kept Rays that were sent.
 * @returns {boolean[]} Whether each of them hit nothing.
 */
function missed(r, kept) {
  /** @type {boolean[]} */
  const found = new Array(kept).fill(false);
  const count = r.upTo(kept);
  if (count === 0) return found;
  let ray = -1;
  for (const hits of numbers(r, count)) {
    ray += hits + 1;
    if (ray < kept) found[ray] = true;
  }
  return found;
}

/**
 * @param {Reader} r
 * @param {number} count
 * @returns {number[]} Distances, in units of the detail.
 */
function distances(r, count) {
  if (count === 0) return [];
  const order = r.u8();
  const base = r.varint();
  let [before, slope] = [base, 0];
  return numbers(r, count).map((zigzag) => {
    const left = zigzag % 2 ? -(zigzag + 1) / 2 : zigzag / 2;
    const reach = (order === 0 ? base : before + (order === 2 ? slope : 0)) + left;
    slope = reach - before;
    before = reach;
    return reach;
  });
}

/**
 * Read a scan as the points that its rays hit.
 *
 * @param {Reader} r
 * @returns {[number, Int16Array]} Metres in one unit, and the points in units.
 */
export function rays(r) {
  const detail = r.f32();
  const [total, chosen, every] = [r.varint(), r.varint(), r.varint()];
  const [first, turn, form] = [r.f32(), r.f32(), r.u8()];
  const [a, b, c, d, e, f] = form & PLACED ? r.f32s(6) : [1, 0, 0, 1, 0, 0];
  const [moveX, moveY, moveYaw] = form & MOVED ? r.f32s(3) : [0, 0, 0];
  // Each ray takes a bit at least.
  const kept = chosen === 0 ? 0 : r.bitsLeftFor(Math.ceil(chosen / every));
  const misses = missed(r, kept);
  const reaches = distances(r, kept - misses.filter(Boolean).length);
  const points = new Float64Array(2 * reaches.length);
  let [at, farthest] = [0, 0];
  for (let i = 0; i < kept; i++) {
    if (misses[i]) continue;
    const ray = Math.floor(i * every * (total / chosen));
    const [bearing, reach] = [first + turn * ray, reaches[at / 2] * detail];
    let [x, y] = [reach * Math.cos(bearing), reach * Math.sin(bearing)];
    if (form & MOVED) {
      const share = ray / total;
      const [cos, sin] = [Math.cos(share * moveYaw), Math.sin(share * moveYaw)];
      [x, y] = [cos * x - sin * y + share * moveX, sin * x + cos * y + share * moveY];
    }
    points[at] = a * x + c * y + e;
    points[at + 1] = b * x + d * y + f;
    farthest = Math.max(farthest, Math.abs(points[at]), Math.abs(points[at + 1]));
    at += 2;
  }
  const unit = Math.max(UNIT, farthest / MOST);
  return [unit, Int16Array.from(points, (length) => Math.round(length / unit))];
}
