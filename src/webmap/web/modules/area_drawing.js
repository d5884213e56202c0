import { apply } from "../view.js";
import { svg } from "./elements.js";
import { lay } from "./overlay.js";

/** @typedef {import('../view.js').Point} Point */
/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/** An area over a map, its corners, and the sweeps that would go over it. */
export class AreaDrawing {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    /** @type {Point[]} */
    this._corners = [];
    this._outline = svg("path", { class: "webmap-area-outline" });
    this._ways = svg("path", { class: "webmap-area-ways" });
    this._sweeps = svg("path", { class: "webmap-area-sweeps" });
    // In metres, as the plan is: only the view moves it.
    this._world = svg("g", {}, this._outline, this._ways, this._sweeps);
    this._marks = svg("g", {});
    this._drawing = svg(
      "svg",
      { class: "webmap-route-drawing webmap-area-drawing", "aria-hidden": "true" },
      this._world,
      this._marks,
    );
    this._offs = [lay(map, this._drawing), map.onView(() => this._place())];
    this._place();
  }

  destroy() {
    for (const off of this._offs) off();
  }

  /**
   * @param {Point[]} corners In metres.
   * @param {object} how
   * @param {boolean} how.closed Whether no further corner is pressed.
   * @param {Point[]} how.points What the robot would go to, in this order.
   * @param {[Point, Point][]} how.sweeps
   */
  show(corners, { closed, points, sweeps }) {
    const shut = corners.length > 0 && (closed || points.length > 0);
    this._corners = closed ? [] : corners;
    this._outline.setAttribute("d", path(corners) + (shut ? "Z" : ""));
    this._ways.setAttribute("d", path(points));
    this._sweeps.setAttribute("d", sweeps.map(path).join(""));
    while (this._marks.childElementCount > this._corners.length) {
      this._marks.lastChild?.remove();
    }
    while (this._marks.childElementCount < this._corners.length) {
      this._marks.append(svg("circle", { class: "webmap-area-corner" }));
    }
    this._place();
  }

  _place() {
    const { a, b, c, d, e, f } = this._map.view;
    this._world.setAttribute("transform", `matrix(${a} ${b} ${c} ${d} ${e} ${f})`);
    for (const [i, { x, y }] of this._corners.entries()) {
      const place = apply(this._map.view, x, y);
      const mark = this._marks.children[i];
      mark.setAttribute("cx", `${place.x}`);
      mark.setAttribute("cy", `${place.y}`);
      // The first is pressed again to close the area.
      mark.setAttribute("r", i === 0 ? "10" : "6");
    }
  }
}

/** @param {Point[]} points */
function path(points) {
  const places = points.map(({ x, y }) => `${x} ${y}`);
  return places.length > 0 ? `M${places.join("L")}` : "";
}
