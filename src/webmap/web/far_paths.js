import { forgetOthers, svg } from "./tools/elements.js";
import { scaleOf, unapply } from "./view.js";

/** @typedef {import('./view.js').Matrix} Matrix */

/**
 * The size of a robot's drawing in its own frame, in metres.
 *
 * @typedef {{x: number, y: number, width: number, height: number}} Box
 */

/**
 * How a small robot looks. Robots of one `key` share a path.
 *
 * @typedef {object} Look
 * @property {string} key
 * @property {Record<string, string>} attributes Of the path.
 * @property {boolean} round Whether it is drawn as a dot, not as an arrowhead.
 * @property {number} least Least size in pixels.
 */

/** Least size of a robot, and of one that is selected, in pixels. */
export const LEAST = 6;
const LEAST_CHOSEN = 12;

/** Classes of robots that are selected. */
const CHOSEN = ["selected", "marked"];

/** Units of a path in a pixel: whole numbers are written and read faster. */
const FINE = 8;

/** Directions in which an arrowhead is drawn. */
const TURNS = 64;

const CORNERS = 8;

/** The start of an outline from the robot's position, and its other points. */
/** @typedef {{x: number, y: number, rest: string}} Outline In units of a path. */

/**
 * @param {Box} box
 * @param {Look} look
 * @param {number} scale Pixels per metre.
 * @returns {(turn: number) => Outline} The outline of a robot by its heading, which is a
 *     whole number of `TURNS`.
 */
function outlines(box, { round, least }, scale) {
  const size = Math.max(box.width, box.height) * scale;
  const unit = FINE * scale * Math.max(1, least / size);
  const points = (round ? dot(box) : arrowhead(box)).map(([x, y]) => [x * unit, y * unit]);
  /** @type {Outline[]} */
  const known = [];
  return (turn) => (known[turn] ??= outline(points, (2 * Math.PI * turn) / TURNS));
}

/** @param {Box} box */
function dot({ x, y, width, height }) {
  const [cx, cy, r] = [x + width / 2, y + height / 2, Math.max(width, height) / 2];
  return Array.from({ length: CORNERS }, (_, corner) => {
    const angle = (2 * Math.PI * (corner + 0.5)) / CORNERS;
    return [cx + r * Math.cos(angle), cy + r * Math.sin(angle)];
  });
}

/** @param {Box} box */
function arrowhead({ x, y, width, height }) {
  const middle = y + height / 2;
  return [
    [x + width, middle],
    [x, y + height],
    [x + 0.22 * width, middle],
    [x, y],
  ];
}

/**
 * @param {number[][]} points
 * @param {number} yaw
 * @returns {Outline}
 */
function outline(points, yaw) {
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const turned = points.map(([x, y]) => [
    Math.round(x * cos - y * sin),
    Math.round(x * sin + y * cos),
  ]);
  const steps = turned
    .slice(1)
    .map(([x, y], before) => `${x - turned[before][0]} ${y - turned[before][1]}`);
  const [[x, y]] = turned;
  return { x, y, rest: `l${steps.join(" ")}z` };
}

/**
 * The group with one path for each look of small robots, below the other robots.
 *
 * Its unit is an eighth of a pixel, and its origin the middle of the map, so that its
 * numbers are small wherever the map is.
 */
export class FarPaths {
  /** @param {SVGGElement} world */
  constructor(world) {
    this._world = world;
    this.group = svg("g", { class: "far-robots" });
    /** @type {Map<string, {element: SVGPathElement, d: string, count: number}>} */
    this._paths = new Map();
    /** @type {Map<string, (turn: number) => Outline>} */
    this._outlines = new Map();
    this._scale = 0;
    this._origin = { x: 0, y: 0 };
    this._unit = 1;
    /** @type {Map<string, {look: Look, d: string, count: number}>} */
    this._next = new Map();
  }

  /**
   * Begin to draw all small robots.
   *
   * @param {Matrix} view
   * @param {{width: number, height: number}} size Pixels.
   * @param {boolean} moved Whether the view has changed.
   */
  begin(view, { width, height }, moved) {
    this._next = new Map();
    if (!moved && this._scale) return;
    const scale = scaleOf(view);
    if (scale !== this._scale) this._outlines.clear();
    this._scale = scale;
    this._unit = 1 / (FINE * scale);
    this._origin = unapply(view, width / 2, height / 2);
    const [u, { x, y }] = [this._unit, this._origin];
    this.group.setAttribute("transform", `matrix(${u} 0 0 ${u} ${x} ${y})`);
  }

  /**
   * @param {{a: number, b: number, e: number, f: number}} pose In metres.
   * @param {Box} box
   * @param {Look} look
   */
  add({ a, b, e, f }, box, look) {
    const shape = [look.round, look.least, box.x, box.y, box.width, box.height].join(" ");
    let outlineOf = this._outlines.get(shape);
    if (!outlineOf) {
      outlineOf = outlines(box, look, this._scale);
      this._outlines.set(shape, outlineOf);
    }
    const turn = look.round ? 0 : Math.round((Math.atan2(b, a) / (2 * Math.PI) + 1) * TURNS);
    const { x, y, rest } = outlineOf(turn % TURNS);
    const across = Math.round((e - this._origin.x) / this._unit) + x;
    const up = Math.round((f - this._origin.y) / this._unit) + y;
    let path = this._next.get(look.key);
    if (!path) {
      path = { look, d: "", count: 0 };
      this._next.set(look.key, path);
    }
    path.d += `M${across} ${up}${rest}`;
    path.count++;
  }

  /** Write what has changed since the last time. */
  end() {
    forgetOthers(this._paths, this._next, ({ element }) => element.remove());
    for (const [key, { look, d, count }] of this._next) {
      const path = this._paths.get(key) ?? this._make(look);
      this._paths.set(key, path);
      if (path.d !== d) path.element.setAttribute("d", d);
      path.d = d;
      if (path.count === count) continue;
      path.count = count;
      const state = look.attributes["data-state"];
      path.element.setAttribute("aria-label", `${count} robots${state ? `, ${state}` : ""}`);
    }
    this._next = new Map();
    if (this._paths.size === 0) this.group.remove();
    else if (!this.group.isConnected) this._insert();
  }

  _insert() {
    const robots = this._world.querySelector(":scope > .robots");
    this._world.insertBefore(this.group, robots);
  }

  /** @param {Look} look */
  _make({ attributes }) {
    const element = svg("path", { role: "img", ...attributes });
    this.group.append(element);
    return { element, d: "", count: 0 };
  }
}

const SHAPES = "path, circle, ellipse, rect, polygon, polyline, line";

/**
 * Read how a robot looks from its first shape that is painted. This makes the browser
 * compute styles.
 *
 * @param {SVGElement} robot
 * @returns {Look}
 */
export function lookOf(robot) {
  const painted = [...robot.querySelectorAll(SHAPES)].flatMap((shape) => {
    const style = getComputedStyle(shape);
    const { fill, stroke, display, visibility } = style;
    if (display === "none" || visibility !== "visible") return [];
    const colour = [fill, stroke].find(isPaint);
    return colour ? [{ shape, colour, filled: colour === fill }] : [];
  });
  const best = painted.find(({ filled }) => filled) ?? painted[0];
  const colour = best?.colour ?? getComputedStyle(robot).color;
  let opacity = 1;
  /** @type {Element | null} */
  let element = best?.shape ?? robot;
  for (; element && element !== robot.parentElement; element = element.parentElement) {
    opacity *= Number(getComputedStyle(element).opacity);
  }
  /** @type {Record<string, string>} */
  const attributes = { fill: colour };
  if (opacity < 1) attributes.opacity = opacity.toFixed(3);
  const { state } = robot.dataset;
  if (state) attributes["data-state"] = state;
  if (robot.classList.contains("stale")) attributes["data-stale"] = "";
  const chosen = isChosen(robot);
  if (chosen) attributes["data-selected"] = "";
  const circle = best?.shape instanceof SVGCircleElement || best?.shape instanceof SVGEllipseElement;
  // A circle with something else on it may show a heading.
  const round = circle && painted.length === 1;
  const least = chosen ? LEAST_CHOSEN : LEAST;
  return { key: Object.entries(attributes).join(), attributes, round, least };
}

/** @param {Element} robot */
export function isChosen({ classList }) {
  return CHOSEN.some((name) => classList.contains(name));
}

/** @param {string} paint */
function isPaint(paint) {
  return paint !== "none" && !/^rgba\(.*, 0\)$|^transparent$/.test(paint);
}
