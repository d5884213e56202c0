import { scaleOf } from "../view.js";
import { onScreen } from "./aim.js";
import { svg } from "./elements.js";

/** @typedef {import('../view.js').Matrix} Matrix */
/** @typedef {import('./aim.js').Pose} Pose */

/**
 * How sure a pose is that a robot is told: variances of x and y in m² along the axes of
 * the robot's own map, of yaw in rad², and how far those axes are turned on this map.
 *
 * @typedef {{x: number, y: number, yaw: number, turn: number}} Variances
 */

/** Standard deviations that are drawn and said, as those of a robot's own doubt are. */
export const DEVIATIONS = 2;

/** Pixels that a wedge is long at least, so that it is seen beyond the outline. */
const WEDGE = 64;

/** The ellipse and the wedge of a pose that is aimed. */
export class Doubt {
  constructor() {
    this._ellipse = svg("ellipse", { class: "webmap-locate-ellipse" });
    this._wedge = svg("path", { class: "webmap-locate-wedge" });
    this.element = svg("g", {}, this._ellipse, this._wedge);
    /** @type {Variances | null} */
    this._variances = null;
    this.draw(null, null);
  }

  /** @param {Variances | null} variances */
  know(variances) {
    this._variances = variances;
  }

  /** What is drawn, in words; empty while it is not known. */
  get words() {
    if (!this._variances) return "";
    const { x, y, yaw } = this._variances;
    const [along, across] = [x, y].map((variance) => metres(deviation(variance)));
    const degrees = Math.round(Math.min(180, (deviation(yaw) * 180) / Math.PI));
    const places = along === across ? [along] : [along, across];
    // No line ends between a number and its unit.
    return [...places, `${degrees}°`].map((each) => `±\u00a0${each}`).join(", ");
  }

  /**
   * @param {Matrix | null} view
   * @param {Pose | null} pose
   */
  draw(view, pose) {
    const variances = this._variances;
    this.element.toggleAttribute("hidden", !view || !pose || !variances);
    if (!view || !pose || !variances) return;
    const scale = scaleOf(view);
    const [rx, ry] = [variances.x, variances.y].map((v) => deviation(v) * scale);
    const own = onScreen(view, { ...pose, yaw: variances.turn });
    this._ellipse.setAttribute("rx", rx.toFixed(2));
    this._ellipse.setAttribute("ry", ry.toFixed(2));
    this._ellipse.setAttribute("transform", transform(own));
    const half = Math.min(deviation(variances.yaw), Math.PI - 1e-3);
    this._wedge.setAttribute("d", sector(Math.max(WEDGE, rx, ry), half));
    this._wedge.setAttribute("transform", transform(onScreen(view, pose)));
  }
}

/** @param {number} variance */
function deviation(variance) {
  return DEVIATIONS * Math.sqrt(variance);
}

/** @param {number} length In metres. */
function metres(length) {
  return `${length.toFixed(length < 0.995 ? 2 : 1)}\u00a0m`;
}

/** @param {{x: number, y: number, degrees: number}} place */
function transform({ x, y, degrees }) {
  return `translate(${x} ${y}) rotate(${degrees})`;
}

/**
 * @param {number} radius In pixels.
 * @param {number} half Half its angle, in radians.
 * @returns {string} The path of a sector about x.
 */
function sector(radius, half) {
  const [x, y] = [radius * Math.cos(half), radius * Math.sin(half)].map((n) => n.toFixed(2));
  const [low, far] = [`${x} -${y}`, `${x} ${y}`];
  const large = half > Math.PI / 2 ? 1 : 0;
  return `M0 0L${low}A${radius} ${radius} 0 ${large} 1 ${far}z`;
}
