import { stoppingDistance } from "../motion/figures.js";
import { svg } from "./elements.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../drive.js').Drive} Drive */

/**
 * Circles around the robots that are driven: as far as each of them can get, at the speed
 * of now, before it stands.
 */
export class Halos {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    /** @type {Drive} */
    this._drive = map.drive;
    /** @type {Map<string, SVGCircleElement>} */
    this._circles = new Map();
    this._frame = 0;
  }

  /** Look again which robots move, and how fast; without a connection nobody knows. */
  show() {
    if (this._drive.state === "lost") {
      this._removeAll();
      return;
    }
    for (const report of this._drive.robots.values()) {
      const distance = stoppingDistance(report);
      if (distance === null) this._remove(report.robot);
      else this._circle(report.robot).setAttribute("r", distance.toFixed(3));
    }
    for (const robot of [...this._circles.keys()]) {
      if (!this._drive.robots.has(robot)) this._remove(robot);
    }
    if (this._circles.size > 0 && this._frame === 0) this._follow();
  }

  destroy() {
    cancelAnimationFrame(this._frame);
    this._removeAll();
  }

  _removeAll() {
    for (const robot of [...this._circles.keys()]) this._remove(robot);
  }

  /** @param {string} robot */
  _circle(robot) {
    const known = this._circles.get(robot);
    if (known?.isConnected) return known;
    const circle = svg("circle", { class: "stopping-halo", "data-halo-of": robot });
    // Behind the robots, so that it hides none and is in nobody's way.
    const robots = this._map.world.querySelector(":scope > .robots");
    this._map.world.insertBefore(circle, robots);
    this._circles.set(robot, circle);
    return circle;
  }

  /** @param {string} robot */
  _remove(robot) {
    this._circles.get(robot)?.remove();
    this._circles.delete(robot);
  }

  /** Keep every circle with its robot, for as long as there are any. */
  _follow() {
    for (const [robot, circle] of this._circles) {
      const place = placeOf(this._map, robot);
      circle.style.display = place === null ? "none" : "";
      if (place === null) continue;
      circle.setAttribute("cx", `${place.x}`);
      circle.setAttribute("cy", `${place.y}`);
    }
    this._frame = this._circles.size > 0 ? requestAnimationFrame(() => this._follow()) : 0;
  }
}

/**
 * @param {MapCanvas} map
 * @param {string} robot
 * @returns {{x: number, y: number} | null} Metres; null where the map does not show it.
 */
function placeOf(map, robot) {
  const element = map.world.querySelector(`.robot[data-robot="${CSS.escape(robot)}"]`);
  if (!(element instanceof SVGGraphicsElement)) return null;
  if (element.classList.contains("unplaced")) return null;
  // Read without consolidating: the scene keeps hold of the items of the list.
  const list = element.transform.baseVal;
  if (list.numberOfItems === 0) return null;
  let matrix = list.getItem(0).matrix;
  for (let i = 1; i < list.numberOfItems; i++) {
    matrix = matrix.multiply(list.getItem(i).matrix);
  }
  return { x: matrix.e, y: matrix.f };
}
