import { rotate, scale, scaleOf, translate } from "../view.js";

/**
 * What hands do to a view: moves, zooms and turns as arithmetic, without a browser.
 *
 * Points are in pixels from the top left of the map; angles in radians, clockwise as
 * one sees them, since y points down on a screen.
 */

/** @typedef {import('../view.js').Matrix} Matrix */
/** @typedef {import('../view.js').Point} Point */

/** @typedef {{min: number, max: number}} Zoom Least and greatest pixels per metre. */

/** The pixels that one "line" and one "page" of a wheel stand for (WheelEvent.deltaMode). */
const PIXELS = [1, 16, 400];

/** Farther than this in pixels a press has become a drag, and its end is no click. */
export const DRAG_THRESHOLD = 4;

/**
 * Zoom and turn about a point that stays where it is.
 *
 * @param {Matrix} view
 * @param {Point} point
 * @param {number} factor
 * @param {number} angle
 * @returns {Matrix}
 */
export function zoomAndTurn(view, { x, y }, factor, angle) {
  // `rotate` counts in degrees, counter-clockwise.
  return rotate(scale(view, factor, x, y), (-angle * 180) / Math.PI, x, y);
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
  const now = scaleOf(view);
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
  return translate(
    turned,
    after.middle.x - before.middle.x,
    after.middle.y - before.middle.y,
  );
}

/** @param {readonly [Point, Point]} points */
function between([one, other]) {
  const [dx, dy] = [other.x - one.x, other.y - one.y];
  return {
    middle: { x: one.x + dx / 2, y: one.y + dy / 2 },
    length: Math.hypot(dx, dy),
    angle: Math.atan2(dy, dx),
  };
}
