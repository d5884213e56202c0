/**
 * What hands do to a view: moves, zooms and turns as arithmetic, without a browser.
 *
 * Points are in pixels from the top left of the map; angles in radians, clockwise as
 * one sees them, since y points down on a screen.
 */

/**
 * Takes metres to pixels: `x' = a x + c y + e`, `y' = b x + d y + f`.
 *
 * @typedef {{a: number, b: number, c: number, d: number, e: number, f: number}} Matrix
 */

/** @typedef {readonly [number, number]} Point */

/** @typedef {{min: number, max: number}} Zoom Least and greatest pixels per metre. */

/** The pixels that one "line" and one "page" of a wheel stand for (WheelEvent.deltaMode). */
const PIXELS = [1, 16, 400];

/** Farther than this in pixels a press has become a drag, and its end is no click. */
export const DRAG_THRESHOLD = 4;

/**
 * @param {Matrix} view
 * @returns {number} How many pixels a metre is long.
 */
export function pixelsPerMetre(view) {
  return Math.sqrt(Math.abs(view.a * view.d - view.b * view.c));
}

/**
 * @param {Matrix} view
 * @param {number} dx
 * @param {number} dy
 * @returns {Matrix}
 */
export function move(view, dx, dy) {
  return { ...view, e: view.e + dx, f: view.f + dy };
}

/**
 * Zoom and turn about a point that stays where it is.
 *
 * @param {Matrix} view
 * @param {Point} point
 * @param {number} factor
 * @param {number} angle
 * @returns {Matrix}
 */
export function zoomAndTurn(view, [x, y], factor, angle) {
  const cos = factor * Math.cos(angle);
  const sin = factor * Math.sin(angle);
  const { a, b, c, d, e, f } = view;
  return {
    a: cos * a - sin * b,
    b: sin * a + cos * b,
    c: cos * c - sin * d,
    d: sin * c + cos * d,
    e: cos * (e - x) - sin * (f - y) + x,
    f: sin * (e - x) + cos * (f - y) + y,
  };
}

/**
 * Return the part of a zoom that keeps the world in sight.
 *
 * A view that lies outside of the limits already is not pulled in, only not let farther
 * out: a map must not jump because somebody touched it.
 *
 * @param {Matrix} view
 * @param {number} factor
 * @param {Zoom} zoom
 * @returns {number}
 */
export function allowedFactor(view, factor, zoom) {
  const now = pixelsPerMetre(view);
  if (!(factor > 0) || !Number.isFinite(factor) || !(now > 0)) return 1;
  const most = Math.max(1, zoom.max / now);
  const least = Math.min(1, zoom.min / now);
  return Math.min(most, Math.max(least, factor));
}

/**
 * What one turn of a wheel asks for.
 *
 * @typedef {object} WheelLike
 * @property {number} deltaX
 * @property {number} deltaY
 * @property {number} deltaMode
 * @property {boolean} ctrlKey
 * @property {boolean} shiftKey
 */

/**
 * Return the way that a wheel was turned, in pixels of scrolling.
 *
 * With shift most browsers turn a vertical wheel into a horizontal one.
 *
 * @param {WheelLike} event
 */
export function wheelPixels(event) {
  const delta = event.deltaY === 0 && event.shiftKey ? event.deltaX : event.deltaY;
  // A free-spinning wheel must not fling the map out of sight with one event.
  return Math.max(-400, Math.min(400, delta * (PIXELS[event.deltaMode] ?? 1)));
}

/**
 * Return the factor of a turn of the wheel: towards the operator is smaller.
 *
 * A trackpad's pinch comes as a wheel with Ctrl, and with about a tenth of the way.
 *
 * @param {WheelLike} event
 */
export function wheelFactor(event) {
  return 2 ** (-wheelPixels(event) * 0.002 * (event.ctrlKey ? 10 : 1));
}

/**
 * Return the angle of a turn of the wheel: about 9 degrees for one notch.
 *
 * @param {WheelLike} event
 */
export function wheelAngle(event) {
  return (wheelPixels(event) * Math.PI) / 2000;
}

/**
 * Follow two fingers: what was under each stays under it, as far as the zoom's limits
 * let it; between those, the point between the fingers stays.
 *
 * @param {Matrix} view
 * @param {readonly [Point, Point]} from Where the fingers were.
 * @param {readonly [Point, Point]} to Where they are.
 * @param {Zoom} zoom
 * @returns {Matrix}
 */
export function pinch(view, from, to, zoom) {
  const before = between(from);
  const after = between(to);
  // Fingers on one spot say nothing about size or turn.
  const known = before.length > 1 && after.length > 1;
  const factor = known ? allowedFactor(view, after.length / before.length, zoom) : 1;
  const angle = known ? after.angle - before.angle : 0;
  const turned = zoomAndTurn(view, before.middle, factor, angle);
  return move(
    turned,
    after.middle[0] - before.middle[0],
    after.middle[1] - before.middle[1],
  );
}

/**
 * Show a part of the world as large as it goes, turned as the view is now.
 *
 * @param {Matrix} view
 * @param {{x: number, y: number, width: number, height: number}} box In metres.
 * @param {number} width The map's, in pixels.
 * @param {number} height
 * @param {Zoom} zoom
 * @returns {Matrix} The same view when the box is empty.
 */
export function fit(view, box, width, height, zoom) {
  const corners = [0, 1, 2, 3].map((i) =>
    apply(view, box.x + (i & 1) * box.width, box.y + (i >> 1) * box.height),
  );
  const xs = corners.map(([x]) => x);
  const ys = corners.map(([, y]) => y);
  const [left, right, top, bottom] = [
    Math.min(...xs),
    Math.max(...xs),
    Math.min(...ys),
    Math.max(...ys),
  ];
  const room = 0.92 * Math.min(width / (right - left), height / (bottom - top));
  if (!(room > 0) || !Number.isFinite(room)) return view;
  /** @type {Point} */
  const middle = [(left + right) / 2, (top + bottom) / 2];
  const factor = allowedFactor(view, room, zoom);
  return move(
    zoomAndTurn(view, middle, factor, 0),
    width / 2 - middle[0],
    height / 2 - middle[1],
  );
}

/**
 * @param {Matrix} view
 * @param {number} x
 * @param {number} y
 * @returns {Point}
 */
function apply({ a, b, c, d, e, f }, x, y) {
  return [a * x + c * y + e, b * x + d * y + f];
}

/** @param {readonly [Point, Point]} points */
function between([[x0, y0], [x1, y1]]) {
  return {
    /** @type {Point} */
    middle: [(x0 + x1) / 2, (y0 + y1) / 2],
    length: Math.hypot(x1 - x0, y1 - y0),
    angle: Math.atan2(y1 - y0, x1 - x0),
  };
}
