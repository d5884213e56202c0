import { chosen, poseOf } from "../../web/tools/aim.js";
import {
  button,
  html,
  onBeat,
  setHidden,
  setText,
  stopButton,
  svg,
} from "../../web/tools/elements.js";
import { endOf, lay, ownPlace } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/view.js').Point} Point */
/** @typedef {(message: Record<string, unknown>) => void} Send */

/**
 * @typedef {object} Options
 * @property {number} most The greatest number of robots for one press.
 * @property {string} [rows] A selector of the elements that the page's button selects.
 * @property {string} [button] A selector of the page's button.
 */


/** A drag shorter than this in pixels is a click. */
const DRAG_FROM = 4;

/**
 * Select several robots by a box, and act on all of them. Sends `{mark: [robot]}`,
 * `{clear: true}` and `{aim: true}`; receives `{problem}`. STOP and the cancelling of
 * goals go to the gate, one message for each robot.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  const box = new Box(map, (robots) => send({ mark: robots }));
  const bar = new SeveralBar(map, options, send);
  return {
    receive: ({ problem }) => bar.showProblem(problem),
    destroy: endOf(box, bar),
  };
}

/** The number of selected robots, and the buttons for all of them. */
class SeveralBar {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { most, rows = "", button: own = "" }, send) {
    this._map = map;
    this._most = most;
    this._count = html("strong", "webmap-several-count", { role: "status" });
    this._problem = html("span", "webmap-problem webmap-several-problem", { role: "status" });
    this._stop = stopButton("webmap-several-stop", "STOP these", () => {
      for (const robot of chosen(map)) map.drive.stop(robot);
    });
    this._cancel = button("webmap-several-cancel", "Cancel goals", () => {
      for (const robot of this._cancellable()) map.drive.cancel(robot);
    });
    this._send = button("webmap-several-send", "Send goal…", () => send({ aim: true }));
    this._panel = html(
      "section",
      "webmap-panel webmap-row wraps webmap-several",
      { "aria-label": "Selected robots" },
      this._count,
      this._send,
      this._stop,
      this._cancel,
      button("webmap-several-clear", "Clear", () => send({ clear: true })),
      this._problem,
    );
    const ending = new AbortController();
    const act = () => {
      const robots = [...document.querySelectorAll(rows)].map((row) =>
        row.getAttribute("data-robot"),
      );
      send({ mark: robots.filter((robot) => robot !== null) });
    };
    ownPlace(own)?.addEventListener("click", act, { signal: ending.signal });
    this.destroy = endOf(
      onBeat(() => this._show()),
      map.onSelect(() => this.showProblem("")),
      () => ending.abort(),
      lay(map, this._panel, "bottom-right"),
    );
    this._show();
  }

  /** @param {string} text */
  showProblem(text) {
    setText(this._problem, text);
    this._show();
  }

  /** @returns {string[]} The selected robots whose goal can be cancelled. */
  _cancellable() {
    const { robots } = this._map.drive;
    return chosen(this._map).filter((robot) => robots.get(robot)?.cancels);
  }

  _show() {
    const robots = chosen(this._map);
    const several = robots.length > 1;
    setHidden(this._panel, !several);
    if (!several) return;
    const reports = robots.map((robot) => this._map.drive.robots.get(robot));
    const many = robots.length > this._most;
    setText(this._count, `${robots.length} robots${many ? ": use STOP ALL" : ""}`);
    setHidden(this._stop, many);
    this._cancel.disabled = many || this._cancellable().length === 0;
    this._send.disabled = !reports.some((report) => report?.method);
  }
}

/**
 * @param {readonly [string, Point][]} places Robots with their positions.
 * @param {Point} from
 * @param {Point} to
 * @returns {string[]} The robots in the box between two corners.
 */
export function inBox(places, from, to) {
  const [left, right] = [Math.min(from.x, to.x), Math.max(from.x, to.x)];
  const [top, bottom] = [Math.min(from.y, to.y), Math.max(from.y, to.y)];
  return places
    .filter(([, { x, y }]) => x >= left && x <= right && y >= top && y <= bottom)
    .map(([robot]) => robot);
}

/** A box that is drawn with Shift and the mouse, from a place without a robot. */
class Box {
  /**
   * @param {MapCanvas} map
   * @param {(robots: string[]) => void} select
   */
  constructor(map, select) {
    this._map = map;
    this._select = select;
    /** @type {{id: number, from: Point, drawn: boolean} | null} */
    this._press = null;
    this._rect = svg("rect", { class: "webmap-line webmap-several-box" });
    this._ending = new AbortController();
    const { signal } = this._ending;
    // Before the module that moves the view.
    const first = { signal, capture: true };
    map.svg.addEventListener("pointerdown", (event) => this._down(event), first);
    map.svg.addEventListener("pointermove", (event) => this._move(event), first);
    map.svg.addEventListener("pointerup", (event) => this._up(event), first);
    for (const end of ["pointercancel", "lostpointercapture"]) {
      map.svg.addEventListener(end, () => this._end(), first);
    }
  }

  destroy() {
    this._end();
    this._ending.abort();
  }

  /** @param {PointerEvent} event */
  _down(event) {
    const { svg: root } = this._map;
    const onRobot = event.target instanceof Element && event.target.closest(".robot");
    const used = "webmapPress" in root.dataset;
    if (!event.shiftKey || event.button !== 0 || event.pointerType === "touch") return;
    if (onRobot || used || this._press) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    root.focus({ preventScroll: true });
    this._press = { id: event.pointerId, from: this._map.pointOf(event), drawn: false };
  }

  /** @param {PointerEvent} event */
  _move(event) {
    const press = this._press;
    if (event.pointerId !== press?.id) return;
    // The button was released outside of the page.
    if (event.buttons === 0) return this._end();
    event.stopImmediatePropagation();
    const { from } = press;
    const to = this._map.pointOf(event);
    if (!press.drawn && Math.hypot(to.x - from.x, to.y - from.y) < DRAG_FROM) return;
    if (!press.drawn) {
      press.drawn = true;
      this._map.svg.setPointerCapture(event.pointerId);
      this._map.overlay.append(this._rect);
    }
    const { _rect: rect } = this;
    rect.setAttribute("x", `${Math.min(from.x, to.x)}`);
    rect.setAttribute("y", `${Math.min(from.y, to.y)}`);
    rect.setAttribute("width", `${Math.abs(to.x - from.x)}`);
    rect.setAttribute("height", `${Math.abs(to.y - from.y)}`);
  }

  /** @param {PointerEvent} event */
  _up(event) {
    const press = this._press;
    if (event.pointerId !== press?.id) return;
    event.stopImmediatePropagation();
    this._end();
    if (!press.drawn) return;
    this._map.suppressNextClick();
    const robots = inBox(this._places(), press.from, this._map.pointOf(event));
    if (robots.length > 0) this._select(robots);
  }

  _end() {
    this._press = null;
    this._rect.remove();
  }

  /** @returns {[string, Point][]} The robots on the map, in pixels. */
  _places() {
    const robots = [...this._map.world.querySelectorAll(".robot:not(.unplaced)")];
    return robots.flatMap((element) => {
      const robot = element.getAttribute("data-robot") ?? "";
      const pose = poseOf(this._map, robot);
      return pose ? [[robot, this._map.toScreen(pose.x, pose.y)]] : [];
    });
  }
}
