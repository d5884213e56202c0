import { deskOf } from "../inputs/desk.js";
import { attentive } from "../motion/attention.js";
import { apply } from "../view.js";
import { AreaDrawing } from "./area_drawing.js";
import { AreaPanel } from "./area_panel.js";
import { cleaned, MOST_CORNERS, problemOf } from "./polygon.js";
import { PressAim } from "./press_aim.js";
import { planSweeps } from "./sweeps.js";

/** @typedef {import('../view.js').Point} Point */
/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('./sweeps.js').Plan} Plan */

/**
 * What an area asks of the route that it is for.
 *
 * @typedef {object} Route
 * @property {() => boolean} mayBegin Whether the route is in sight.
 * @property {() => number} room How many points it can take.
 * @property {() => Pose | null} here Where the selected robot stands.
 * @property {(points: Pose[]) => void} take Puts points behind those there are.
 * @property {() => void} changed What is to be seen is another.
 */

/** So near to the first corner a press closes the area, in pixels: a finger's width. */
const NEAR = 20;

/** So near to the last corner it is the second half of a double press, in pixels. */
const TWICE = 4;

/** @type {Plan} */
const NO_SWEEPS = { problem: "", points: [], sweeps: [] };

/** What has a use for Enter itself. */
const PRESSED_BY_KEY = "button, summary, a[href], input, select, textarea, [tabindex]";

/**
 * An area that becomes points of a route: its corners are pressed on the map, and sweeps
 * that go over it back and forth are shown until they are taken or left.
 *
 * The corners end with the first one pressed again, Enter or Done; Escape leaves. It
 * sends nothing to any robot: whoever runs the route does.
 */
export class RouteArea {
  /** @param {MapCanvas} map @param {Route} route */
  constructor(map, route) {
    this._map = map;
    this._route = route;
    /** @type {Point[]} */
    this._corners = [];
    /** @type {Point | null} A corner that is being pressed. */
    this._aimed = null;
    this._closed = false;
    /** Why the area could not be closed, in a sentence. */
    this._refused = "";
    this._plan = NO_SWEEPS;
    this._drawing = new AreaDrawing(map);
    this._panel = new AreaPanel({
      begin: () => this._begin(),
      close: () => this._close(),
      undo: () => this._set(this._corners.slice(0, -1)),
      here: () => this._addHere(),
      changed: () => this._show(),
      take: () => this._take(),
      leave: () => this.leave(),
    });
    /** Begins an area. */
    this.button = this._panel.begin;
    /** What is pressed and set; it is hidden where there is no area. */
    this.element = this._panel.element;
    this._aim = new PressAim(map, "", {
      mayBegin: () => route.mayBegin(),
      changed: (active) => this._aimChanged(active),
      preview: (pose) => this._preview(pose),
      done: (pose) => this._press(pose),
      lasting: true,
    });
    this._ending = new AbortController();
    const { signal } = this._ending;
    window.addEventListener("keydown", (event) => this._keyDown(event), { signal });
    // While corners are pressed the aim has it.
    this._offEscape = deskOf(map.drive).claimEscape(() => this._closed && this.leave());
    this._draw();
  }

  destroy() {
    this._ending.abort();
    this._offEscape();
    this._aim.destroy();
    this._drawing.destroy();
  }

  /** Whether corners are pressed, or will be when another tool has aimed. */
  get draws() {
    return this._aim.active || this._aim.waits;
  }

  /** Whether there is an area, or one is begun. */
  get active() {
    return this.draws || this._closed;
  }

  /** @returns {string} What there is to say; empty where there is no area. */
  get words() {
    if (this._aim.waits) return "More corners afterwards.";
    if (this.draws) return this._refused || this._drawingWords();
    if (!this._closed) return "";
    const { problem, points, sweeps } = this._plan;
    return problem || `${points.length} points, ${sweeps.length} sweeps.`;
  }

  /** Whether what it says is why something cannot be done. */
  get refused() {
    return this.draws ? this._refused !== "" : this._plan.problem !== "";
  }

  /** Look again where the robot is. */
  look() {
    this._panel.showHere(this._route.here() !== null);
  }

  /** @returns {boolean} Whether there was something to leave. */
  leave() {
    if (!this.active) return false;
    this._closed = false;
    if (!this._aim.leave()) this._drop();
    return true;
  }

  _begin() {
    this._aim.activate(true);
    this._panel.focus();
  }

  _drawingWords() {
    const count = this._corners.length;
    if (count < 3) return "Press each corner of the area on the map.";
    return `${count} corners. Press the first again, or Done.`;
  }

  /** @param {boolean} active */
  _aimChanged(active) {
    if (active || this._aim.waits || this._closed) this._show();
    else this._drop();
  }

  _drop() {
    const { focused } = this._panel;
    this._set([]);
    if (focused) this._panel.focus();
  }

  /** @param {Point[]} corners */
  _set(corners) {
    this._corners = corners;
    this._aimed = null;
    this._refused = "";
    this._show();
  }

  /** @param {Pose | null} pose */
  _preview(pose) {
    this._aimed = pose && !this._near(pose, 0, NEAR) ? pose : null;
    this._show();
  }

  /** @param {Pose} pose */
  _press(pose) {
    const last = this._corners.length - 1;
    this._aimed = null;
    if (last > 0 && this._near(pose, 0, NEAR)) this._close();
    else if (this._near(pose, last, TWICE)) this._show();
    else this._add(pose);
  }

  _addHere() {
    const pose = this._route.here();
    if (pose) this._add(pose);
  }

  /** @param {Point} corner */
  _add({ x, y }) {
    const count = this._corners.length + 1;
    if (count <= MOST_CORNERS) this._set([...this._corners, { x, y }]);
    else this._refuse(`Got ${count} corners: an area has ${MOST_CORNERS} at most.`);
  }

  /** @param {Point} place @param {number} index @param {number} pixels */
  _near(place, index, pixels) {
    const corner = this._corners[index];
    if (!corner) return false;
    const [p, q] = [corner, place].map(({ x, y }) => apply(this._map.view, x, y));
    return Math.hypot(p.x - q.x, p.y - q.y) <= pixels;
  }

  /** @param {KeyboardEvent} event */
  _keyDown(event) {
    if (event.key !== "Enter" || event.repeat || event.isComposing) return;
    if (!this._aim.active || !attentive()) return;
    if (document.activeElement?.matches(PRESSED_BY_KEY)) return;
    event.preventDefault();
    this._close();
  }

  _close() {
    const problem = problemOf(cleaned(this._corners));
    if (problem) {
      this._refuse(problem);
      return;
    }
    const { focused } = this._panel;
    this._closed = true;
    this._aim.leave();
    if (focused) this._panel.focus();
  }

  /** @param {string} why */
  _refuse(why) {
    this._refused = why;
    this._show();
  }

  _take() {
    // The route may have other points than when it was drawn.
    this._draw();
    const { points } = this._plan;
    if (points.length === 0) return;
    this.leave();
    this._route.take(points);
  }

  _show() {
    this._draw();
    this._route.changed();
  }

  _draw() {
    const corners = this._aimed ? [...this._corners, this._aimed] : this._corners;
    const { spacing, across } = this._panel;
    this._plan =
      corners.length < 3
        ? NO_SWEEPS
        : planSweeps(corners, { spacing, across, room: this._route.room() });
    const { active, _closed: closed } = this;
    this._drawing.show(corners, { closed, ...this._plan });
    const ready = this._plan.points.length > 0;
    this._panel.show({ active, closed, corners: this._corners.length, ready });
  }
}
