import { scaleOf } from "../../web/view.js";
import { onScreen, PressAim } from "../../web/tools/aim.js";
import { button, html, setText, svg } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { showNote, tool, toolDrawing } from "../../web/tools/tool.js";

/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('../../web/view.js').Matrix} Matrix */

const SENT = "Pose sent.";

/** @typedef {(message: object) => void} Send */

/** A robot's outline, with an arrow along x for the heading. */
const OUTLINE = "M-14-11H8l9 11-9 11h-22zM17 0h26M43 0l-9-6M43 0l-9 6";

/**
 * Set the initial pose of the selected robot: press there, drag for the heading,
 * release.
 *
 * The tool begins with its button, with `i`, or with a message `{active: true}`; Escape
 * ends it. Sends `{pose: {robot, x, y, yaw}}` when the gate has accepted the pose.
 * Sends `{covariance: robot}` to request the variances of the pose. The answer is
 * `{covariance: {robot, x, y, yaw, turn}}` with variances in m² and rad², or null, and
 * the rotation of the robot's own map on this map, in radians.
 *
 * Options: `button` (true), whether there is a button; `key` ("i").
 *
 * @param {MapCanvas} map
 * @param {{button?: boolean, key?: string}} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new InitialPoseTool(map, options, send);
}

class InitialPoseTool {
  /**
   * @param {MapCanvas} map
   * @param {{button?: boolean, key?: string}} options
   * @param {Send} send
   */
  constructor(map, { button: buttons = true, key = "i" }, send) {
    this._map = map;
    /** @type {import('../../web/drive.js').Drive} */
    this._drive = map.drive;
    this._send = send;
    /** @type {Pose | null} */
    this._pose = null;
    this._aim = new PressAim(map, key, {
      mayBegin: () => this._may(),
      changed: (active) => this._changed(active),
      preview: (pose) => this._preview(pose),
      done: (pose) => this._done(pose),
    });
    this._go = button("webmap-aim-go webmap-locate-go", "Set pose", () => this._aim.toggle());
    this._go.title = `Set pose (${key.toUpperCase()})`;
    this._message = html("span", "webmap-muted webmap-aim-word webmap-locate-word", { role: "status" });
    this._panel = tool("webmap-aim webmap-locate", "Initial pose", this._go, this._message);
    this._uncertainty = new PoseUncertainty();
    this._outline = svg("path", { d: OUTLINE, class: "webmap-locate-arrow" });
    const parts = [this._uncertainty.element, this._outline];
    this._drawing = toolDrawing("webmap-aim-drawing", ...parts);
    this.destroy = endOf(
      this._aim,
      lay(map, this._drawing),
      ...(buttons ? [lay(map, this._panel, "top-left")] : []),
      map.onSelect(() => this._selected()),
      map.onView(() => this._draw()),
      this._drive.on("stop", () => this._aim.leave()),
      this._drive.on("robot", ({ robot }) => robot === map.selected && this._show()),
    );
    this._show();
  }

  /** @param {any} message */
  receive(message) {
    if (message && "covariance" in message) {
      const { covariance } = message;
      this._uncertainty.setVariances(covariance?.robot === this._map.selected ? covariance : null);
      this._explain();
      this._draw();
    }
    if (typeof message?.active !== "boolean") return;
    this._aim.activate(message.active);
    if (message.active && !this._aim.active) {
      setText(this._message, "This robot has no topic for an initial pose.");
    }
  }

  _may() {
    const { selected } = this._map;
    return selected !== null && this._drive.robots.get(selected)?.locates === true;
  }

  /** @param {boolean} active */
  _changed(active) {
    if (active) this._send({ covariance: this._map.selected });
    if (!active) setText(this._message, "");
    this._explain();
    this._show();
  }

  _explain() {
    if (!this._aim.active) return;
    const sure = this._uncertainty.text;
    const text = "Press where the robot is and drag for the heading, or use the arrow keys and Enter";
    setText(this._message, sure === "" ? `${text}.` : `${text} (${sure}).`);
  }

  /** @param {Pose | null} pose */
  _preview(pose) {
    this._pose = pose;
    this._draw();
  }

  /** @param {Pose} pose */
  _done(pose) {
    const { selected: robot } = this._map;
    this._aim.activate(false);
    if (robot !== null) void this._setPose(robot, pose);
  }

  /**
   * @param {string} robot
   * @param {Pose} pose
   */
  async _setPose(robot, pose) {
    try {
      await this._drive.locate(robot, pose);
      setText(this._message, SENT);
      setTimeout(() => this._message.textContent === SENT && setText(this._message, ""), 4000);
      this._send({ pose: { robot, ...pose } });
    } catch (error) {
      const why = error instanceof Error ? error.message : String(error);
      showNote(this._message, `Pose not sent: ${why}`, this._drive, [robot]);
    }
    this._preview(null);
  }

  _selected() {
    this._uncertainty.setVariances(null);
    this._aim.leave();
    setText(this._message, "");
    this._show();
  }

  _show() {
    this._go.disabled = !this._may();
    this._go.setAttribute("aria-pressed", String(this._aim.active));
    this._draw();
  }

  _draw() {
    this._uncertainty.draw(this._map.view, this._pose);
    this._outline.toggleAttribute("hidden", this._pose === null);
    if (this._pose === null) return;
    const { x, y, degrees } = onScreen(this._map.view, this._pose);
    this._outline.setAttribute("transform", `translate(${x} ${y}) rotate(${degrees})`);
  }
}

/**
 * The variances of an initial pose: x and y in m² along the axes of the robot's own
 * map, yaw in rad², and the rotation of those axes on this map.
 *
 * @typedef {{x: number, y: number, yaw: number, turn: number}} Variances
 */

/**
 * Number of standard deviations that are drawn and written, as for a robot's own pose.
 */
const DEVIATIONS = 2;

/** Least length of the wedge in pixels, so that it is visible beyond the outline. */
const WEDGE = 64;

/** The ellipse and the wedge of an aimed pose. */
export class PoseUncertainty {
  constructor() {
    this._ellipse = svg("ellipse", { class: "webmap-locate-ellipse" });
    this._wedge = svg("path", { class: "webmap-locate-wedge" });
    this.element = svg("g", {}, this._ellipse, this._wedge);
    /** @type {Variances | null} */
    this._variances = null;
    this.draw(null, null);
  }

  /** @param {Variances | null} variances */
  setVariances(variances) {
    this._variances = variances;
  }

  /** The drawn standard deviations as text; empty while unknown. */
  get text() {
    if (!this._variances) return "";
    const { x, y, yaw } = this._variances;
    const [along, across] = [x, y].map((variance) => metres(deviation(variance)));
    const degrees = Math.round(Math.min(180, (deviation(yaw) * 180) / Math.PI));
    const places = along === across ? [along] : [along, across];
    // No line break between a number and its unit.
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
 * @param {number} half Half the angle, in radians.
 * @returns {string} The path of a sector about x.
 */
function sector(radius, half) {
  const [x, y] = [radius * Math.cos(half), radius * Math.sin(half)].map((n) => n.toFixed(2));
  const [low, far] = [`${x} -${y}`, `${x} ${y}`];
  const large = half > Math.PI / 2 ? 1 : 0;
  return `M0 0L${low}A${radius} ${radius} 0 ${large} 1 ${far}z`;
}
