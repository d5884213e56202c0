import { apply, multiply, unapply } from "../../web/view.js";
import { poseOf } from "../../web/tools/aim.js";
import { svg } from "../../web/tools/elements.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/view.js').Matrix} Matrix */
/** @typedef {import('../../web/view.js').Point} Point */

/** Pixels from the robot to the rotation handle. */
const REACH = 84;

let names = 0;

/**
 * The preview of an alignment: a shadow of the aligned things, and the rotation handle.
 */
export class AlignDrawing {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    /** @type {Element[]} Elements that got an `id` so that they can be shown twice. */
    this._named = [];
    /** The point of rotation, on the common map. @type {Point | null} */
    this.pivot = null;
    this._shadow = svg("g", { class: "webmap-align-shadow", "aria-hidden": "true" });
    this._arm = svg("path", { class: "webmap-align-arm webmap-line", "aria-hidden": "true" });
    /** Rotates the alignment when dragged; receives the keys. */
    this.handle = svg(
      "g",
      {
        class: "webmap-align-handle",
        tabindex: "0",
        role: "slider",
        "aria-label": "Alignment: arrow keys move, q and e turn, Enter saves",
        "aria-valuemin": "-180",
        "aria-valuemax": "180",
      },
      svg("circle", { class: "webmap-align-reach", r: "22" }),
      svg("circle", { class: "webmap-align-knob webmap-point", r: "13" }),
      svg("path", { class: "webmap-align-sign webmap-line", d: "M-6 2a6 6 0 1 0 2-6M-7-7l3 3-3 3" }),
    );
    this.element = svg(
      "svg",
      { class: "webmap-align-drawing", hidden: "" },
      this._arm,
      this.handle,
    );
  }

  /**
   * @param {string[]} robots The robots that are aligned.
   * @param {string | null} mark `data-bridge` of the layers that are aligned too; a
   *     robot's own layers are aligned with the robot.
   */
  show(robots, mark) {
    this._unname();
    const robot = (/** @type {string} */ id) =>
      `.robot[data-robot="${CSS.escape(id)}"], [data-layer-of="${CSS.escape(id)}"]`;
    const wanted = [
      ...(mark === null ? [] : [`[data-bridge="${CSS.escape(mark)}"]`]),
      ...robots.map(robot),
    ];
    const found = wanted.flatMap((one) => [...this._map.world.querySelectorAll(one)]);
    this._shadow.replaceChildren(...found.map((element) => this._twice(element)));
    // Inside the map's own `<svg>`, because its styles set the sizes of drawn things.
    this._map.overlay.append(this._shadow);
    this.element.removeAttribute("hidden");
  }

  hide() {
    this._unname();
    this._shadow.replaceChildren();
    this._shadow.remove();
    this.element.setAttribute("hidden", "");
    this.pivot = null;
  }

  /**
   * @param {string} robot The robot that is the point of rotation.
   * @param {Alignment} before
   * @param {Alignment} now
   */
  draw(robot, before, now) {
    const there = between(before, now);
    const onScreen = multiply(this._map.view, there);
    this._shadow.setAttribute("transform", text(onScreen));
    const at = poseOf(this._map, robot) ?? before;
    this.pivot = this._inSight(apply(there, at.x, at.y));
    const turn = matrixOf({ x: 0, y: 0, angle: now.angle - before.angle });
    const up = apply(turn, 0, 1);
    const center = apply(this._map.view, this.pivot.x, this.pivot.y);
    const tip = apply(this._map.view, this.pivot.x + up.x, this.pivot.y + up.y);
    const far = Math.hypot(tip.x - center.x, tip.y - center.y);
    const x = center.x + ((tip.x - center.x) * REACH) / far;
    const y = center.y + ((tip.y - center.y) * REACH) / far;
    this._arm.setAttribute("d", `M${center.x} ${center.y}L${x} ${y}`);
    this.handle.setAttribute("transform", `translate(${x} ${y})`);
    this.handle.setAttribute("aria-valuenow", String(now.angle));
    this.handle.setAttribute(
      "aria-valuetext",
      `x ${now.x} metres, y ${now.y} metres, turned by ${now.angle} degrees`,
    );
  }

  /**
   * @param {Point} place On the common map.
   * @returns {Point} The same point, or the middle of the visible map, so that the
   *     handle is visible.
   */
  _inSight(place) {
    const { width, height, view } = this._map;
    const { x, y } = apply(view, place.x, place.y);
    const seen = x >= 0 && y >= 0 && x <= width && y <= height;
    return seen ? place : unapply(view, width / 2, height / 2);
  }

  /**
   * @param {Element} element
   * @returns {SVGUseElement} A copy that follows all changes of the element.
   */
  _twice(element) {
    if (!element.id) {
      element.id = `webmap-align-${++names}`;
      this._named.push(element);
    }
    return svg("use", { href: `#${element.id}` });
  }

  _unname() {
    for (const element of this._named.splice(0)) element.removeAttribute("id");
  }
}

/** @param {Matrix} matrix */
function text({ a, b, c, d, e, f }) {
  return `matrix(${a} ${b} ${c} ${d} ${e} ${f})`;
}

/**
 * The position of a map on the common map: metres, metres, and degrees
 * counter-clockwise, as in fleet files.
 *
 * @typedef {{x: number, y: number, angle: number}} Alignment
 */


/**
 * @param {Alignment} alignment
 * @returns {Matrix} The transform from points of the map to the common map.
 */
export function matrixOf({ x, y, angle }) {
  const yaw = (angle * Math.PI) / 180;
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return { a: cos, b: sin, c: -sin, d: cos, e: x, f: y };
}

/**
 * @param {Alignment} before
 * @param {Alignment} now
 * @returns {Matrix} The transform from the old to the new position of all aligned
 *     things.
 */
export function between(before, now) {
  const turn = matrixOf({ x: 0, y: 0, angle: now.angle - before.angle });
  const { a, b, c, d } = turn;
  return {
    ...turn,
    e: now.x - a * before.x - c * before.y,
    f: now.y - b * before.x - d * before.y,
  };
}

/**
 * @param {Alignment} alignment
 * @param {number} dx Metres along the common map's x.
 * @param {number} dy
 * @returns {Alignment}
 */
export function moved(alignment, dx, dy) {
  return { ...alignment, x: alignment.x + dx, y: alignment.y + dy };
}

/**
 * Rotate about a point.
 *
 * @param {Alignment} alignment
 * @param {number} degrees Counter-clockwise.
 * @param {Point} about On the common map.
 * @returns {Alignment}
 */
export function turned(alignment, degrees, about) {
  const { a, b, c, d } = matrixOf({ x: 0, y: 0, angle: degrees });
  const [dx, dy] = [alignment.x - about.x, alignment.y - about.y];
  return {
    x: about.x + a * dx + c * dy,
    y: about.y + b * dx + d * dy,
    angle: normal(alignment.angle + degrees),
  };
}

/**
 * @param {number} degrees
 * @returns {number} The same direction, above -180 and up to 180.
 */
export function normal(degrees) {
  const rest = ((degrees % 360) + 360) % 360;
  return rest > 180 ? rest - 360 : rest;
}

/**
 * @param {Alignment} alignment
 * @returns {Alignment} Rounded to the millimetre and the hundredth of a degree, as
 *     saved.
 */
export function rounded({ x, y, angle }) {
  return {
    x: Math.round(x * 1000) / 1000 + 0,
    y: Math.round(y * 1000) / 1000 + 0,
    angle: Math.round(normal(angle) * 100) / 100 + 0,
  };
}
