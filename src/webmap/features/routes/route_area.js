import { devicesOf } from "../../web/inputs/devices.js";
import { attentive } from "../../web/inputs/focus.js";
import { apply } from "../../web/view.js";
import { button, html, setHidden, svg } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { MOST_CORNERS, problemOf, withoutRepetitions } from "./polygon.js";
import { PressAim } from "../../web/tools/aim.js";
import { toolDrawing } from "../../web/tools/tool.js";
import { row } from "./route_points.js";
import { planSweeps, SPACING } from "./sweeps.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('./sweeps.js').Plan} Plan */
/** @typedef {import('../../web/view.js').Point} Point */

/**
 * The parts of a route that an area needs.
 *
 * @typedef {object} Route
 * @property {() => boolean} mayBegin Whether the route's panel is visible.
 * @property {() => number} room Number of points that the route can still take.
 * @property {() => Pose | null} here Pose of the selected robot.
 * @property {(points: Pose[]) => void} take Appends points to the route.
 * @property {() => void} changed Called after every visible change.
 */

/**
 * A press this close to the first corner closes the area, in pixels: a finger's width.
 */
const NEAR = 20;

/**
 * A press this close to the last corner is the second press of a double press, in
 * pixels.
 */
const TWICE = 4;

/** @type {Plan} */
const NO_SWEEPS = { problem: "", points: [], sweeps: [] };

/** Elements that handle Enter themselves. */
const PRESSED_BY_KEY = "button, summary, a[href], input, select, textarea, [tabindex]";

/**
 * An area that becomes points of a route: the operator presses its corners on the map;
 * sweeps over the area are shown until they are added to the route or discarded.
 *
 * A press on the first corner, Enter or Done ends the corners; Escape leaves. This
 * class sends nothing to any robot: that happens only when the route runs.
 */
export class RouteArea {
  /** @param {MapCanvas} map @param {Route} route */
  constructor(map, route) {
    this._map = map;
    this._route = route;
    /** @type {Point[]} */
    this._corners = [];
    /** @type {Point | null} The corner that is being pressed. */
    this._aimed = null;
    this._closed = false;
    /** Why the area could not be closed, as a sentence. */
    this._refused = "";
    this._plan = NO_SWEEPS;
    this._drawing = new AreaDrawing(map);
    this._panel = new AreaPanel({
      begin: () => this._begin(),
      close: () => this._close(),
      undo: () => this._set(this._corners.slice(0, -1)),
      here: () => {
        const pose = route.here();
        if (pose) this._add(pose);
      },
      changed: () => this._show(),
      take: () => this._take(),
      leave: () => this.leave(),
    });
    /** The button that begins an area. */
    this.button = this._panel.begin;
    /** The buttons and fields; hidden without an area. */
    this.element = this._panel.element;
    this._aim = new PressAim(map, "", {
      mayBegin: () => route.mayBegin(),
      changed: (active) => this._aimChanged(active),
      preview: (pose) => this._preview(pose),
      done: (pose) => this._press(pose),
      lasting: true,
    });
    const ending = new AbortController();
    const { signal } = ending;
    window.addEventListener("keydown", (event) => this._keyDown(event), { signal });
    this.destroy = endOf(
      () => ending.abort(),
      // While corners are pressed the aim handles Escape.
      devicesOf(map.drive).claimEscape(() => this._closed && this.leave()),
      this._aim,
      this._drawing,
    );
    this._draw();
  }

  /** Whether corners are being pressed, or will be after another tool ends. */
  get draws() {
    return this._aim.active || this._aim.waits;
  }

  /** Whether there is an area, or a begun one. */
  get active() {
    return this.draws || this._closed;
  }

  /** @returns {string} The text for the operator; empty without an area. */
  get text() {
    if (this._aim.waits) return "Waiting: finish the other tool, then add more corners.";
    if (this.draws) return this._refused || this._drawingText();
    if (!this._closed) return "";
    const { problem, points, sweeps } = this._plan;
    const count = sweeps.length === 1 ? "1 sweep" : `${sweeps.length} sweeps`;
    return problem || `${points.length} points, ${count}.`;
  }

  /** Whether the text is the reason of a refusal. */
  get refused() {
    return this.draws ? this._refused !== "" : this._plan.problem !== "";
  }

  /** Update the robot's position. */
  look() {
    this._panel.showHere(this._route.here() !== null);
  }

  /** @returns {boolean} Whether the tool was active. */
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

  _drawingText() {
    const count = this._corners.length;
    if (count < 3) return "Press each corner of the area on the map.";
    return `${count} corners. Press the first corner again, or press Done.`;
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

  /** @param {Point} corner */
  _add({ x, y }) {
    const count = this._corners.length + 1;
    if (count <= MOST_CORNERS) this._set([...this._corners, { x, y }]);
    else this._refuse(`Got ${count} corners, expected at most ${MOST_CORNERS}. Use fewer corners.`);
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
    const problem = problemOf(withoutRepetitions(this._corners));
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
    // The number of the route's points may have changed since the last drawing.
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

/**
 * Callbacks of the area's panel.
 *
 * @typedef {object} Acts
 * @property {() => void} begin
 * @property {() => void} close End the corners.
 * @property {() => void} undo Remove the last corner.
 * @property {() => void} here Add the robot's position as a corner.
 * @property {() => void} changed The settings of the sweeps have changed.
 * @property {() => void} take
 * @property {() => void} leave
 */

/** The buttons and the field that turn an area into sweeps. */
class AreaPanel {
  /** @param {Acts} acts */
  constructor(acts) {
    /** Whether sweeps go across the longest side. */
    this.across = false;
    /** The button that begins an area. */
    this.begin = button("webmap-area-begin", "Area", acts.begin);
    this.begin.title = "Cover an area with parallel sweeps";
    this._done = button("webmap-area-done", "Done", acts.close);
    this._done.title = "Close the area; or press the first corner again";
    this._undo = button("webmap-area-undo", "Undo", acts.undo);
    this._undo.title = "Remove the last corner";
    this._here = button("webmap-area-here", "Position", acts.here);
    this._here.title = "Add the position of the selected robot";
    this._spacing = html("input", "webmap-area-spacing", {
      type: "number",
      min: `${SPACING.least}`,
      max: `${SPACING.most}`,
      step: "0.1",
      value: `${SPACING.usual}`,
    });
    this._spacing.addEventListener("input", acts.changed);
    this._spacing.addEventListener("keydown", ({ key }) => {
      // The page leaves Escape to a field that has the focus, and this field does not
      // use it.
      if (key === "Escape") acts.leave();
    });
    this._turn = button("webmap-area-across", "Across", () => {
      this.across = !this.across;
      acts.changed();
    });
    this._turn.title = "Sweep across the longest side, not along it";
    this._take = button("webmap-area-take", "Add to route", acts.take);
    this._leave = button("webmap-area-leave", "Cancel", acts.leave);
    const label = html("label", "webmap-muted webmap-row webmap-area-apart", {}, "Spacing in m ", this._spacing);
    this._how = row(label, this._turn);
    this.element = html(
      "div",
      "webmap-area",
      { role: "group", "aria-label": "Area" },
      this._how,
      row(this._done, this._undo, this._here, this._take, this._leave),
    );
  }

  /** Distance between sweeps in metres; NaN if the field has no number. */
  get spacing() {
    return this._spacing.value === "" ? NaN : Number(this._spacing.value);
  }

  /**
   * @param {object} area
   * @param {boolean} area.active Whether there is an area.
   * @param {boolean} area.closed
   * @param {number} area.corners Number of corners.
   * @param {boolean} area.ready Whether there are sweeps to add.
   */
  show({ active, closed, corners, ready }) {
    this._turn.setAttribute("aria-pressed", String(this.across));
    for (const each of [this._how, this._take]) setHidden(each, !closed);
    for (const each of [this._done, this._undo, this._here]) setHidden(each, closed);
    this._undo.disabled = corners === 0;
    this._take.disabled = !ready;
    setHidden(this.element, !active);
  }

  /** @param {boolean} possible Whether the robot's position can be added. */
  showHere(possible) {
    this._here.toggleAttribute("disabled", !possible);
  }

  /** Whether one of the area's buttons has the focus. */
  get focused() {
    return this.element.contains(document.activeElement);
  }

  /**
   * Focus the first button that is visible now, because the focused button may be
   * hidden.
   */
  focus() {
    const next = [this._done, this._take, this._turn, this.begin];
    next.find((each) => !each.disabled && each.offsetParent !== null)?.focus();
  }
}

/** An area over a map, with its corners and sweeps. */
class AreaDrawing {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    /** @type {Point[]} */
    this._corners = [];
    this._outline = svg("path", { class: "webmap-area-outline webmap-line" });
    this._ways = svg("path", { class: "webmap-area-ways webmap-line" });
    this._sweeps = svg("path", { class: "webmap-area-sweeps webmap-line" });
    // In metres, like the plan: only the view moves it.
    this._world = svg("g", {}, this._outline, this._ways, this._sweeps);
    this._marks = svg("g", {});
    const classes = "webmap-route-drawing webmap-area-drawing";
    this._drawing = toolDrawing(classes, this._world, this._marks);
    this.destroy = endOf(lay(map, this._drawing), map.onView(() => this._place()));
    this._place();
  }

  /**
   * @param {Point[]} corners In metres.
   * @param {object} how
   * @param {boolean} how.closed Whether the corners are complete.
   * @param {Point[]} how.points Goals of the robot, in this order.
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
      this._marks.append(svg("circle", { class: "webmap-area-corner webmap-point" }));
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
      // A press on the first corner closes the area.
      mark.setAttribute("r", i === 0 ? "10" : "6");
    }
  }
}

/** @param {Point[]} points */
function path(points) {
  const places = points.map(({ x, y }) => `${x} ${y}`);
  return places.length > 0 ? `M${places.join("L")}` : "";
}
