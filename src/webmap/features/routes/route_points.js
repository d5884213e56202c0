import { LONGEST_NAME } from "../../web/constants.js";
import { onScreen } from "../../web/tools/aim.js";
import { button, html, setAttribute, setHidden, setText, svg } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { toolDrawing } from "../../web/tools/tool.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/tools/aim.js').Pose} Pose */

/** @param {...Node} children Of a row in the body of the tool for routes. */
export function row(...children) {
  return html("div", "webmap-row wraps webmap-route-row", {}, ...children);
}

/** A ring with a nose for the heading. */
const NOSE = "M12-6 22 0 12 6z";

/** Numbered points over a map, which can be dragged, and the lines between them. */
export class RoutePoints {
  /**
   * @param {MapCanvas} map
   * @param {(index: number, pose: Pose) => void} moved
   */
  constructor(map, moved) {
    this._map = map;
    this._moved = moved;
    /** @type {Pose[]} */
    this._points = [];
    this._line = svg("polyline", { class: "webmap-route-line webmap-line" });
    this._group = svg("g", {});
    this._drawing = toolDrawing("webmap-route-drawing", this._line, this._group);
    this.destroy = endOf(lay(map, this._drawing), map.onView(() => this._place()));
  }

  /**
   * @param {Pose[]} points
   * @param {{loop: boolean, current: number | null, movable: boolean}} how `current`:
   *     the point that the robot drives to.
   */
  show(points, { loop, current, movable }) {
    this._points = points;
    this._loop = loop;
    this._drawing.classList.toggle("movable", movable);
    while (this._group.childElementCount > points.length) this._group.lastChild?.remove();
    while (this._group.childElementCount < points.length) this._add();
    for (const [index, element] of [...this._group.children].entries()) {
      element.classList.toggle("current", index === current);
    }
    this._place();
  }

  _add() {
    const index = this._group.childElementCount;
    const number = svg("text", {});
    number.textContent = `${index + 1}`;
    const point = svg(
      "g",
      { class: "webmap-route-point webmap-point" },
      svg("path", { d: NOSE }),
      svg("circle", { r: "12" }),
      number,
    );
    point.addEventListener("pointerdown", (event) => this._down(event, point, index));
    this._group.append(point);
  }

  /**
   * @param {PointerEvent} down
   * @param {SVGGElement} point
   * @param {number} index
   */
  _down(down, point, index) {
    if (down.button !== 0) return;
    down.preventDefault();
    down.stopPropagation();
    point.setPointerCapture(down.pointerId);
    const ending = new AbortController();
    const { signal } = ending;
    const move = (/** @type {PointerEvent} */ event) => {
      this._moved(index, { ...this._points[index], ...this._map.worldOf(event) });
    };
    point.addEventListener("pointermove", move, { signal });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      point.addEventListener(end, () => ending.abort(), { signal });
    }
  }

  _place() {
    const places = this._points.map((pose) => onScreen(this._map.view, pose));
    for (const [index, { x, y, degrees }] of places.entries()) {
      const element = this._group.children[index];
      element.setAttribute("transform", `translate(${x} ${y})`);
      element.firstElementChild?.setAttribute("transform", `rotate(${degrees})`);
    }
    const line = this._loop && places.length > 2 ? [...places, places[0]] : places;
    setAttribute(this._line, "points", line.map(({ x, y }) => `${x},${y}`).join(" "));
  }
}

/** The routes stored on the server: their names and buttons. */
export class SavedRoutes {
  /**
   * @param {boolean} saves Whether this page may change them.
   * @param {(message: object) => void} send
   * @param {() => {points: Pose[], loop: boolean}} route The route to save.
   */
  constructor(saves, send, route) {
    this._send = send;
    this._route = route;
    this._chosen = html("select", "webmap-route-chosen", { "aria-label": "Saved routes" });
    this._load = button("webmap-route-load", "Load", () => this._ask("load"));
    this._delete = button("webmap-route-delete", "Delete", () => this._ask("delete"));
    this._name = html("input", "webmap-route-name", {
      type: "text",
      maxlength: `${LONGEST_NAME}`,
      placeholder: "Name",
      "aria-label": "Name of the route",
    });
    this._save = button("webmap-route-save", "Save", () => this._keep());
    this._message = html("p", "webmap-route-word", { role: "status" });
    this._there = row(this._chosen, this._load, ...(saves ? [this._delete] : []));
    const keep = row(this._name, this._save);
    this.element = html(
      "div",
      "webmap-route-saved",
      {},
      this._there,
      ...(saves ? [keep] : []),
      this._message,
    );
    this._there.hidden = true;
  }

  /** @param {any} message */
  receive(message) {
    const { routes, loaded, saved, problem } = message ?? {};
    if (Array.isArray(routes)) {
      const { value } = this._chosen;
      this._chosen.replaceChildren(
        ...routes.map((name) => html("option", "", { value: name }, name)),
      );
      if (routes.includes(saved ?? value)) this._chosen.value = saved ?? value;
      setHidden(this._there, routes.length === 0);
      setText(this._message, saved ? `Saved as ${saved}.` : "");
    }
    if (loaded) {
      this._name.value = loaded.name;
      setText(this._message, `Loaded ${loaded.name}.`);
    }
    if (typeof problem === "string") setText(this._message, problem);
  }

  /** @param {'load' | 'delete'} op */
  _ask(op) {
    if (this._chosen.value !== "") this._send({ op, name: this._chosen.value });
  }

  _keep() {
    const { points, loop } = this._route();
    if (points.length === 0) setText(this._message, "There are no points to save.");
    else if (this._name.value.trim() === "") setText(this._message, "Give the route a name.");
    else this._send({ op: "save", name: this._name.value.trim(), route: { points, loop } });
  }
}
