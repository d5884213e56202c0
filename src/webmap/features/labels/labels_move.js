import { unapply } from "../../web/view.js";
import { button, html } from "../../web/tools/elements.js";
import { claimPresses } from "../../web/tools/tool.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/view.js').Point} Point */

/** Step of an arrow key in a field, in metres. */
const STEP = 0.1;

/**
 * The move of a label: by a drag on the map, or by numbers, which the arrow keys
 * change. A field has the focus, so that no key drives a robot.
 */
export class LabelMove {
  /**
   * @param {MapCanvas} map
   * @param {SVGGraphicsElement} label
   * @param {Point} place Its position, in metres.
   * @param {(to: Point | null) => void} done Called with the new position; with null to
   *     cancel.
   */
  constructor(map, label, place, done) {
    this._map = map;
    this._label = label;
    this._from = place;
    this._to = place;
    this._done = done;
    this._accepted = false;
    /** @type {{id: number, dx: number, dy: number} | null} */
    this._press = null;
    const [x, y] = /** @type {const} */ (["x", "y"]).map((axis) => this._field(axis));
    this._x = x;
    this._y = y;
    /** The fields for the sheet. */
    this.fields = [
      html("label", "webmap-field", {}, "x in m", x),
      html("label", "webmap-field", {}, "y in m", y),
      button("webmap-labels-cancel", "Cancel", () => done(null)),
      button("webmap-labels-keep", "Save", () => done(this._to)),
    ];
    this._ending = new AbortController();
    const { signal } = this._ending;
    // Before all other listeners, so that a drag moves the label and not the map.
    const first = { signal, capture: true };
    const { svg } = map;
    svg.addEventListener("pointerdown", (event) => this._down(event), first);
    svg.addEventListener("pointermove", (event) => this._drag(event), first);
    svg.addEventListener("pointerup", (event) => this._up(event), first);
    svg.addEventListener("pointercancel", () => (this._press = null), first);
    svg.addEventListener("click", (event) => event.stopImmediatePropagation(), first);
    claimPresses(svg, "labels", true);
    label.classList.add("moving");
    this._show();
  }

  /** The display has accepted the move: keep the position. */
  accepted() {
    this._accepted = true;
  }

  destroy() {
    this._ending.abort();
    claimPresses(this._map.svg, "labels", false);
    this._label.classList.remove("moving");
    if (!this._accepted) this._put(this._from);
  }

  focus() {
    this._x.focus({ preventScroll: true });
    this._x.select();
  }

  /** @param {'x' | 'y'} axis */
  _field(axis) {
    const field = html("input", "", {
      type: "number",
      step: String(STEP),
      autocomplete: "off",
      "data-axis": axis,
    });
    field.addEventListener("input", () => {
      const number = field.valueAsNumber;
      if (!Number.isFinite(number)) return;
      this._to = { ...this._to, [axis]: number };
      this._put(this._to);
    });
    field.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && !event.isComposing) this._done(this._to);
    });
    return field;
  }

  /** @param {PointerEvent} event */
  _down(event) {
    event.stopImmediatePropagation();
    event.preventDefault();
    if (this._press || event.button !== 0) {
      // A second finger cancels the drag of the first.
      this._press = null;
      return;
    }
    const at = this._map.pointOf(event);
    const label = this._map.toScreen(this._to.x, this._to.y);
    const on = event.target instanceof Node && this._label.contains(event.target);
    // A label dragged by its rim does not jump; a press elsewhere moves the label
    // there.
    const [dx, dy] = on ? [label.x - at.x, label.y - at.y] : [0, 0];
    this._press = { id: event.pointerId, dx, dy };
    this._map.svg.setPointerCapture(event.pointerId);
    this._drag(event);
  }

  /** @param {PointerEvent} event */
  _drag(event) {
    event.stopImmediatePropagation();
    const press = this._press;
    if (event.pointerId !== press?.id) return;
    const { x, y } = this._map.pointOf(event);
    const place = unapply(this._map.view, x + press.dx, y + press.dy);
    this._to = { x: rounded(place.x), y: rounded(place.y) };
    this._show();
  }

  /** @param {PointerEvent} event */
  _up(event) {
    if (event.pointerId !== this._press?.id) return;
    event.stopImmediatePropagation();
    this._map.suppressNextClick();
    this._press = null;
  }

  _show() {
    this._x.value = String(rounded(this._to.x));
    this._y.value = String(rounded(this._to.y));
    this._put(this._to);
  }

  /** @param {Point} place */
  _put({ x, y }) {
    const list = this._label.transform.baseVal;
    if (list.numberOfItems === 0) return;
    const { matrix } = list.getItem(0);
    matrix.e = x;
    matrix.f = y;
  }
}

/**
 * @param {number} metres
 * @returns {number} Rounded to the centimetre, which is finer than a finger.
 */
function rounded(metres) {
  return Math.round(metres * 100) / 100;
}
