import { fit, translate } from "../view.js";
import {
  DRAG_THRESHOLD,
  allowedFactor,
  pinch,
  wheelAngle,
  wheelFactor,
  zoomAndTurn,
} from "./gestures.js";

/** @typedef {import('../view.js').Matrix} Matrix */
/** @typedef {import('../view.js').Point} Point */
/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../halves.js').Half} Half */

/** What a key press zooms by, and turns by in radians. */
const KEY_FACTOR = 1.25;
const KEY_ANGLE = Math.PI / 24;

/**
 * Move, zoom and turn the view by mouse, wheel, fingers and keys.
 *
 * Drag moves, the wheel zooms about the pointer and turns with shift; two fingers do
 * all three. With the map focused: `+ - [ ]`, and `0` shows everything.
 *
 * Options: `min_zoom` and `max_zoom` in pixels per metre.
 *
 * @param {MapCanvas} map
 * @param {{min_zoom?: number, max_zoom?: number}} options
 * @returns {Half}
 */
export default function attach(map, options) {
  const control = new MouseViewControl(map, options);
  return { destroy: () => control.destroy() };
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
     * Where the fingers are, or the mouse while its button is down.
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
    // An image under the pointer would be dragged out of the map instead.
    svg.addEventListener("dragstart", (event) => event.preventDefault(), { signal });
  }

  /** @param {PointerEvent} event */
  _down(event) {
    if (event.pointerType === "mouse" && event.button > 1) return;
    // The middle button scrolls the page by itself otherwise.
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
      // The button went up where nobody told us.
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
    // Not before: a captured press would click the map rather than what lies there.
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
    const { view, world, width, height } = this._map;
    const box = world.getBBox();
    if (box.width === 0 && box.height === 0) return;
    const [right, top] = [box.x + box.width, box.y + box.height];
    this._map.setView(fit(view, [box.x, box.y, right, top], width, height));
  }
}
