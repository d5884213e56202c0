import { MOST_POINTS } from "../../web/constants.js";
import { poseOf, PressAim } from "../../web/tools/aim.js";
import { button, html, onBeat, setAttribute, setHidden, setText } from "../../web/tools/elements.js";
import { lay } from "../../web/tools/overlay.js";
import { foldedTool } from "../../web/tools/tool.js";
import { RouteArea } from "./route_area.js";
import { row, RoutePoints, SavedRoutes } from "./route_points.js";
import { LEAST_LOOP, RouteRobots, storeRoute, takeStoredRoute } from "./route_run.js";

/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {(message: object) => void} Send */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

const TOO_SHORT = `A loop needs at least ${LEAST_LOOP} points.`;

/**
 * Routes: points that are pressed on the map, or cover an area there, and a robot that
 * drives from one to the next.
 *
 * Sends `{op: "save", name, route}`, `{op: "load", name}` and `{op: "delete", name}`;
 * receives `{routes: [name]}`, `{loaded: {name, points, loop}}`, `{saved: name}` and
 * `{problem: text}`.
 *
 * Options: `saves` (true), whether this page may store routes.
 *
 * @param {MapCanvas} map
 * @param {{saves?: boolean}} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new RouteTool(map, options, send);
}

class RouteTool {
  /**
   * @param {MapCanvas} map
   * @param {{saves?: boolean}} options
   * @param {Send} send
   */
  constructor(map, { saves = true }, send) {
    this._map = map;
    /** @type {import('../../web/drive.js').Drive} */
    this._drive = map.drive;
    const before = takeStoredRoute(map.id, performance.now());
    /** @type {Pose[]} */
    this._points = before?.points ?? [];
    /** @type {Pose | null} The point that is being aimed. */
    this._aimed = null;
    this._listed = "";
    this._aim = new PressAim(map, "", {
      mayBegin: () => this._details.open,
      changed: () => this._show(),
      preview: (pose) => this._preview(pose),
      done: (pose) => {
        this._aimed = null;
        this._add(pose);
      },
      origin: () => this._points.at(-1) ?? this._robotPose(),
      lasting: true,
    });
    this._robots = new RouteRobots(
      this._drive,
      (robot) => poseOf(map, robot),
      () => this._show(),
      before?.runs,
    );
    this._drawing = new RoutePoints(map, (index, pose) => this._change(index, pose));
    this._area = new RouteArea(map, {
      mayBegin: () => this._details.open,
      room: () => MOST_POINTS - this._points.length,
      here: () => this._robotPose(),
      take: (points) => this._set([...this._points, ...points], this._loops),
      changed: () => this._show(),
    });
    this._edit = button("webmap-route-edit", "Add points", () => this._aim.toggle());
    this._edit.title = "Press on the map for each point";
    this._here = button("webmap-route-here", "Position", () => {
      const pose = this._robotPose();
      if (pose) this._add(pose);
    });
    this._clear = button("webmap-route-clear", "Clear", () => this._set([], false));
    this._list = html("ol", "webmap-route-list");
    this._loops = before?.loop ?? false;
    this._loop = button("webmap-route-loop", "Loop", () =>
      this._set(this._points, !this._loops),
    );
    this._loop.title = "Start again after the last point";
    this._here.title = "Add the position of the selected robot";
    this._run = button("webmap-route-run", "Start route", () => this._begin());
    this._pause = button("webmap-route-pause", "Pause", () => {
      const { run } = this._robots.of(this._map.selected) ?? {};
      this._do(run?.state === "going" ? "pause" : "go");
    });
    this._skip = button("webmap-route-skip", "Skip point", () => this._do("skip"));
    this._end = button("webmap-route-end", "End route", () => this._do("end"));
    this._message = html("p", "webmap-route-word", { role: "status" });
    this._saved = new SavedRoutes(saves, send, () => ({
      points: this._points,
      loop: this._loops,
    }));
    const begin = row(this._edit, this._area.button, this._here, this._clear);
    begin.classList.add("begin");
    this._details = foldedTool(
      "webmap-route",
      "route",
      "Route",
      {},
      begin,
      this._area.element,
      this._list,
      row(this._loop, this._run, this._pause, this._skip, this._end),
      this._message,
      this._saved.element,
    );
    this._details.open = before?.open ?? false;
    this._details.addEventListener("toggle", () => {
      if (!this._details.open) for (const each of [this._aim, this._area]) each.leave();
      this._show();
    });
    this._offs = [
      lay(map, this._details, "top-left"),
      map.onSelect(() => this._show()),
      onBeat(() => {
        this._robots.look();
        this._show();
      }),
    ];
    this._show();
  }

  destroy() {
    const [points, loop, open] = [this._points, this._loops, this._details.open];
    const runs = this._robots.destroy();
    storeRoute(this._map.id, { points, loop, open, runs }, performance.now());
    this._aim.destroy();
    this._area.destroy();
    this._drawing.destroy();
    for (const off of this._offs) off();
  }

  /** @param {any} message */
  receive(message) {
    const { loaded } = message ?? {};
    if (loaded) this._set(loaded.points, loaded.loop);
    this._saved.receive(message);
  }

  // Points ---------------------------------------------------------------------

  _robotPose() {
    const { selected } = this._map;
    return selected === null ? null : poseOf(this._map, selected);
  }

  /** @param {Pose[]} points @param {boolean} loop */
  _set(points, loop) {
    this._points = points;
    this._loops = loop;
    this._show();
  }

  /** @param {Pose} pose */
  _add(pose) {
    if (this._points.length >= MOST_POINTS) return;
    this._set([...this._points, pose], this._loops);
  }

  /** @param {number} index @param {Pose} pose */
  _change(index, pose) {
    this._set(
      this._points.map((point, i) => (i === index ? pose : point)),
      this._loops,
    );
  }

  /** @param {number} index */
  _remove(index) {
    this._set(
      this._points.filter((_, i) => i !== index),
      this._loops,
    );
  }

  /** @param {number} index The point to exchange with the previous one. */
  _raise(index) {
    const points = [...this._points];
    [points[index - 1], points[index]] = [points[index], points[index - 1]];
    this._set(points, this._loops);
  }

  /** @param {Pose | null} pose */
  _preview(pose) {
    this._aimed = pose;
    this._show();
  }

  // Running --------------------------------------------------------------------

  _begin() {
    const { selected } = this._map;
    if (selected === null || this._points.length === 0) return;
    this._aim.leave();
    this._robots.begin(selected, [...this._points], { loop: this._loops });
  }

  /** @param {'go' | 'pause' | 'skip' | 'end'} what */
  _do(what) {
    if (this._map.selected !== null) this._robots.act(this._map.selected, what);
  }

  // Display --------------------------------------------------------------------

  _show() {
    const { run, busy = false } = this._robots.of(this._map.selected) ?? {};
    const live = run?.live === true;
    const report = this._drive.robots.get(this._map.selected ?? "");
    const open = this._details.open;
    setAttribute(this._edit, "aria-pressed", String(this._aim.active));
    setText(this._edit, this._aim.active ? "Done" : "Add points");
    // Leaves a part of the map free to press on, also on a phone.
    const adding = this._aim.active || this._aim.waits || this._area.draws;
    this._details.classList.toggle("adding", adding);
    this._details.classList.toggle("area", this._area.active);
    this._area.look();
    setAttribute(this._loop, "aria-pressed", String(this._loops));
    this._here.toggleAttribute("disabled", this._robotPose() === null);
    this._clear.toggleAttribute("disabled", this._points.length === 0);
    const cannot = this._points.length === 0 || !report?.method || busy;
    this._run.toggleAttribute("disabled", cannot);
    setText(this._run, live ? "Run again" : "Start route");
    for (const each of [this._pause, this._skip, this._end]) setHidden(each, !live);
    for (const each of [this._pause, this._skip]) each.toggleAttribute("disabled", busy);
    setText(this._pause, run?.state === "going" ? "Pause" : "Resume");
    setText(this._message, this._text(run, report?.name ?? ""));
    const refused = this._area.refused ? "refused" : "";
    const state = this._area.active ? refused : (run?.state ?? "");
    setAttribute(this._message, "data-state", state);
    this._showList();
    const points = this._aimed ? [...this._points, this._aimed] : this._points;
    const shown = open ? points : live ? run.points : [];
    this._drawing.show(shown, {
      loop: open ? this._loops : (run?.loop ?? false),
      current: live ? run.index : null,
      movable: open,
    });
  }

  /** @param {import('./route_run.js').RouteRun | undefined} run @param {string} name */
  _text(run, name) {
    if (this._aim.active) {
      return "Press on the map for each point and drag for the heading. Or use the keys: arrows move, Shift turns, Enter adds.";
    }
    if (this._aim.waits) return "Waiting: finish the other tool, then add more points.";
    if (this._area.active) return this._area.text;
    const how = this._running(run, name);
    const short = this._loops && this._points.length < LEAST_LOOP;
    return short ? `${how} ${TOO_SHORT}`.trim() : how;
  }

  /** @param {import('./route_run.js').RouteRun | undefined} run @param {string} name */
  _running(run, name) {
    if (run === undefined) {
      return this._map.selected === null ? "Select the robot for this route." : "";
    }
    const point = `point ${run.index + 1} of ${run.points.length}`;
    const round = run.loop && run.rounds > 0 ? `, round ${run.rounds + 1}` : "";
    if (run.state === "going") return `${name} is navigating to ${point}${round}.`;
    if (run.state === "paused") return `Paused before ${point}.`;
    if (run.state === "halted") return `Interrupted before ${point}: ${run.why}.`;
    return `Route of ${name} ended.`;
  }

  _showList() {
    const key = JSON.stringify(this._points);
    if (key === this._listed) return;
    this._listed = key;
    const rows = this._points.map(({ x, y }, index) => {
      const where = `${x.toFixed(1)}, ${y.toFixed(1)} m`;
      const up = button("webmap-route-up", "Up", () => this._raise(index));
      up.setAttribute("aria-label", `Move point ${index + 1} up`);
      up.disabled = index === 0;
      const away = button("webmap-route-remove", "×", () => this._remove(index));
      away.setAttribute("aria-label", `Remove point ${index + 1}`);
      return html("li", "", {}, html("span", "", {}, where), up, away);
    });
    this._list.replaceChildren(...rows);
  }
}
