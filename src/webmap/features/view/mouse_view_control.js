import { fit, rotate, scale, scaleOf, translate } from "../../web/view.js";

/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/view.js').Matrix} Matrix */
/** @typedef {import('../../web/view.js').Point} Point */

/** Zoom factor of a key press, and rotation below in radians. */
const KEY_FACTOR = 1.25;
const KEY_ANGLE = Math.PI / 24;

/**
 * Move, zoom and rotate the view by mouse, wheel, fingers and keys.
 *
 * A drag moves, the wheel zooms about the pointer and rotates with Shift; two fingers
 * do all three. While the map has the focus, `+ - [ ]` zoom and rotate, and `0` shows
 * everything.
 *
 * Options: `min_zoom` and `max_zoom` in pixels per metre.
 *
 * @param {MapCanvas} map
 * @param {{min_zoom?: number, max_zoom?: number}} options
 * @returns {BrowserPart}
 */
export default function attach(map, options) {
  return new MouseViewControl(map, options);
}

class MouseViewControl {
  /**
   * @param {MapCanvas} map
   * @param {{min_zoom?: number, max_zoom?: number}} options
   */
  constructor(map, { min_zoom: min = 0.5, max_zoom: max = 2000 }) {
    this._map = map;
    this._zoom = { min, max };
    /**
     * Positions of the fingers, or of the mouse while its button is down.
     * @type {Map<number, Point>}
     */
    this._pointers = new Map();
    /** @type {Point} */
    this._start = { x: 0, y: 0 };
    this._dragging = false;
    this._ending = new AbortController();
    this._listen(map.svg);
    map.svg.classList.add("webmap-view-control");
    this._focusable = map.svg.hasAttribute("tabindex");
    if (!this._focusable) map.svg.setAttribute("tabindex", "0");
  }

  destroy() {
    this._ending.abort();
    this._map.svg.classList.remove("webmap-view-control", "webmap-dragging");
    if (!this._focusable) this._map.svg.removeAttribute("tabindex");
  }

  /** @param {SVGSVGElement} svg */
  _listen(svg) {
    const { signal } = this._ending;
    svg.addEventListener("pointerdown", (event) => this._down(event), { signal });
    svg.addEventListener("pointermove", (event) => this._move(event), { signal });
    svg.addEventListener("pointerup", (event) => this._up(event, true), { signal });
    for (const end of /** @type {const} */ (["pointercancel", "lostpointercapture"])) {
      svg.addEventListener(end, (event) => this._up(event, false), { signal });
    }
    svg.addEventListener("wheel", (event) => this._wheel(event), {
      signal,
      passive: false,
    });
    svg.addEventListener("keydown", (event) => this._key(event), { signal });
    // The browser would drag an image under the pointer out of the map instead.
    svg.addEventListener("dragstart", (event) => event.preventDefault(), { signal });
  }

  /** @param {PointerEvent} event */
  _down(event) {
    if (event.pointerType === "mouse" && event.button > 1) return;
    // The browser would scroll the page with the middle button.
    if (event.button === 1) event.preventDefault();
    this._pointers.set(event.pointerId, this._map.pointOf(event));
    if (this._pointers.size === 1) this._start = this._map.pointOf(event);
    else if (this._pointers.size === 2) this._drag(event);
  }

  /** @param {PointerEvent} event */
  _move(event) {
    const from = this._pointers.get(event.pointerId);
    if (!from) return;
    if (event.buttons === 0) {
      // The button was released without an event for this element.
      this._up(event, false);
      return;
    }
    const to = this._map.pointOf(event);
    if (!this._dragging) {
      const way = Math.hypot(to.x - this._start.x, to.y - this._start.y);
      if (way < DRAG_THRESHOLD) return;
      this._drag(event);
    }
    this._follow(event.pointerId, from, to);
    this._pointers.set(event.pointerId, to);
  }

  /**
   * @param {number} id
   * @param {Point} from
   * @param {Point} to
   */
  _follow(id, from, to) {
    const { view } = this._map;
    const [other] = [...this._pointers].filter(([pointer]) => pointer !== id);
    if (other) {
      this._map.setView(pinch(view, [from, other[1]], [to, other[1]], this._zoom));
    } else this._map.setView(translate(view, to.x - from.x, to.y - from.y));
  }

  /** @param {PointerEvent} event */
  _drag(event) {
    this._dragging = true;
    // Not before: a captured press would click the map, not the element below the
    // pointer.
    this._map.svg.setPointerCapture(event.pointerId);
    this._map.svg.classList.add("webmap-dragging");
  }

  /**
   * @param {PointerEvent} event
   * @param {boolean} clicks Whether a click may follow.
   */
  _up(event, clicks) {
    if (!this._pointers.delete(event.pointerId) || this._pointers.size > 0) return;
    if (this._dragging && clicks) this._map.suppressNextClick();
    this._dragging = false;
    this._map.svg.classList.remove("webmap-dragging");
  }

  /** @param {WheelEvent} event */
  _wheel(event) {
    event.preventDefault();
    const turning = event.shiftKey && !event.ctrlKey;
    const factor = turning ? 1 : wheelFactor(event);
    this._about(this._map.pointOf(event), factor, turning ? wheelAngle(event) : 0);
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return;
    const middle = { x: this._map.width / 2, y: this._map.height / 2 };
    if (event.key === "+" || event.key === "=") this._about(middle, KEY_FACTOR, 0);
    else if (event.key === "-") this._about(middle, 1 / KEY_FACTOR, 0);
    else if (event.key === "[") this._about(middle, 1, -KEY_ANGLE);
    else if (event.key === "]") this._about(middle, 1, KEY_ANGLE);
    else if (event.key === "0") this._showAll();
    else return;
    event.preventDefault();
  }

  /**
   * @param {Point} point
   * @param {number} factor
   * @param {number} angle
   */
  _about(point, factor, angle) {
    const { view } = this._map;
    this._map.setView(
      zoomAndTurn(view, point, allowedFactor(view, factor, this._zoom), angle),
    );
  }

  _showAll() {
    const { crowd, view, world, width, height } = this._map;
    crowd.drawAll();
    const box = world.getBBox();
    if (box.width === 0 && box.height === 0) return;
    const [right, top] = [box.x + box.width, box.y + box.height];
    this._map.setView(fit(view, [box.x, box.y, right, top], width, height));
  }
}

/**
 * Arithmetic of moving, zooming and rotating a view, without a browser.
 *
 * Points are in pixels from the top left of the map; angles in radians, clockwise on
 * the screen, because y points down.
 */


/** @typedef {{min: number, max: number}} Zoom Least and greatest pixels per metre. */

/** Pixels of one "line" and one "page" of a wheel (WheelEvent.deltaMode). */
const PIXELS = [1, 16, 400];

/**
 * A press that moves farther than this, in pixels, is a drag, and its end is no click.
 */
const DRAG_THRESHOLD = 4;

/**
 * Zoom and rotate about a fixed point.
 *
 * @param {Matrix} view
 * @param {Point} point
 * @param {number} factor
 * @param {number} angle
 * @returns {Matrix}
 */
export function zoomAndTurn(view, { x, y }, factor, angle) {
  // `rotate` takes degrees, counter-clockwise.
  return rotate(scale(view, factor, x, y), (-angle * 180) / Math.PI, x, y);
}

/**
 * Return the part of a zoom factor that keeps the world visible.
 *
 * A view that is outside of the limits already is not corrected, but cannot go farther
 * out: a map must not jump at a touch.
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
 * The fields of a wheel event that are used here.
 *
 * @typedef {object} WheelLike
 * @property {number} deltaX
 * @property {number} deltaY
 * @property {number} deltaMode
 * @property {boolean} ctrlKey
 * @property {boolean} shiftKey
 */

/**
 * Return the rotation of a wheel, in pixels of scrolling.
 *
 * With Shift most browsers turn vertical scrolling into horizontal scrolling.
 *
 * @param {WheelLike} event
 */
function wheelPixels(event) {
  const delta = event.deltaY === 0 && event.shiftKey ? event.deltaX : event.deltaY;
  // One event of a free-spinning wheel must not move the map out of sight.
  return Math.max(-400, Math.min(400, delta * (PIXELS[event.deltaMode] ?? 1)));
}

/**
 * Return the zoom factor of a wheel's rotation: towards the user is smaller.
 *
 * A trackpad's pinch is a wheel event with Ctrl, with about a tenth of the distance.
 *
 * @param {WheelLike} event
 */
export function wheelFactor(event) {
  return 2 ** (-wheelPixels(event) * 0.002 * (event.ctrlKey ? 10 : 1));
}

/**
 * Return the angle of a wheel's rotation: about 9 degrees for one notch.
 *
 * @param {WheelLike} event
 */
export function wheelAngle(event) {
  return (wheelPixels(event) * Math.PI) / 2000;
}

/**
 * Follow two fingers: the points under the fingers stay under them, as far as the zoom
 * limits allow; beyond the limits the point between the fingers stays.
 *
 * @param {Matrix} view
 * @param {readonly [Point, Point]} from Previous positions of the fingers.
 * @param {readonly [Point, Point]} to Present positions of the fingers.
 * @param {Zoom} zoom
 * @returns {Matrix}
 */
export function pinch(view, from, to, zoom) {
  const before = between(from);
  const after = between(to);
  // Fingers at the same point define neither size nor angle.
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
