import { devicesOf } from "../../web/inputs/devices.js";
import { apply } from "../../web/view.js";
import { button, html, setText, svg } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { claimPresses, tool, toolDrawing, toolName } from "../../web/tools/tool.js";

/** @typedef {import('../../web/view.js').Point} Point */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

/**
 * Measure on the map: press at the beginning, drag, release. The measurement stays
 * until the next press, or until the tool ends.
 *
 * The tool begins with its button or with `m`; Escape ends it.
 *
 * Options: `key` ("m").
 *
 * @param {MapCanvas} map
 * @param {{key?: string}} options
 * @returns {BrowserPart}
 */
export default function attach(map, options) {
  return new MeasureTool(map, options);
}

/**
 * @param {Point} from In metres.
 * @param {Point} to
 * @returns {string} The distance, and the direction from x.
 */
export function distanceText(from, to) {
  const [dx, dy] = [to.x - from.x, to.y - from.y];
  const degrees = Math.round((Math.atan2(dy, dx) * 180) / Math.PI + 360) % 360;
  return `${Math.hypot(dx, dy).toFixed(2)} m, ${degrees}°`;
}

class MeasureTool {
  /**
   * @param {MapCanvas} map
   * @param {{key?: string}} options
   */
  constructor(map, { key = "m" }) {
    this._map = map;
    this._key = key;
    this._active = false;
    /** @type {number | null} */
    this._pointer = null;
    /** The measured line, in metres. @type {{from: Point, to: Point} | null} */
    this._line = null;
    this._button = button("webmap-measure-go", "", () => this._toggle());
    this._button.append(...toolName("measure", "Measure"));
    this._button.title = `Measure (${key.toUpperCase()})`;
    this._message = html("span", "webmap-measure-word", { role: "status" });
    const panel = tool("webmap-measure", "Measure", this._button, this._message);
    this._path = svg("path", { class: "webmap-measure-line webmap-line" });
    this._drawing = toolDrawing("webmap-measure-drawing", this._path);
    this._ending = new AbortController();
    this._listen();
    this.destroy = endOf(
      () => this._activate(false),
      () => this._ending.abort(),
      lay(map, this._drawing),
      lay(map, panel, "top-left"),
      devicesOf(map.drive).claimEscape(() => this._leave()),
      map.onView(() => this._draw()),
    );
    this._activate(false);
  }

  _listen() {
    const { signal } = this._ending;
    const { svg: root } = this._map;
    // Before all other listeners, so that a measuring press neither moves the view nor
    // selects a robot.
    const first = { signal, capture: true };
    root.addEventListener("pointerdown", (event) => this._down(event), first);
    root.addEventListener("pointermove", (event) => this._move(event), first);
    root.addEventListener("pointerup", (event) => this._up(event), first);
    root.addEventListener("pointercancel", () => (this._pointer = null), first);
    const devices = devicesOf(this._map.drive);
    devices.listenToTool(this._map, this._key, () => this._toggle(), signal);
  }

  _toggle() {
    this._activate(!this._active);
  }

  /** @param {boolean} active */
  _activate(active) {
    this._active = active;
    this._pointer = this._line = null;
    this._button.setAttribute("aria-pressed", String(active));
    claimPresses(this._map.svg, "measure", active);
    setText(this._message, active ? "Press on the map and drag to measure." : "");
    this._draw();
  }

  /** @returns {boolean} Whether the tool was active. */
  _leave() {
    if (!this._active) return false;
    this._activate(false);
    return true;
  }

  /** @param {PointerEvent} event */
  _down(event) {
    if (!this._active || event.button !== 0) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    if (this._pointer !== null) return;
    this._pointer = event.pointerId;
    this._map.svg.setPointerCapture(event.pointerId);
    const from = this._map.worldOf(event);
    this._line = { from, to: from };
    this._draw();
  }

  /** @param {PointerEvent} event */
  _move(event) {
    if (!this._active) return;
    event.stopImmediatePropagation();
    if (event.pointerId !== this._pointer || !this._line) return;
    this._line.to = this._map.worldOf(event);
    this._draw();
  }

  /** @param {PointerEvent} event */
  _up(event) {
    if (!this._active || event.pointerId !== this._pointer) return;
    event.stopImmediatePropagation();
    this._map.suppressNextClick();
    this._pointer = null;
  }

  _draw() {
    const line = this._line;
    this._drawing.toggleAttribute("hidden", line === null);
    if (line === null) return;
    const from = apply(this._map.view, line.from.x, line.from.y);
    const to = apply(this._map.view, line.to.x, line.to.y);
    this._path.setAttribute("d", `M${from.x} ${from.y}L${to.x} ${to.y}`);
    setText(this._message, distanceText(line.from, line.to));
  }
}
