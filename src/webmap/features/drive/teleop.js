import { FRAMED } from "../../web/access.js";
import { devicesOf } from "../../web/inputs/devices.js";
import { stoppingDistance } from "../../web/motion/measurements.js";
import { heldByAnother, isLatched, mayTake, stopOf } from "../../web/motion/report.js";
import { describe, inputsOf } from "../../web/motion/status.js";
import { svg } from "../../web/tools/elements.js";
import { endOf, lay, overlayOf, ownCorners, ownPlace } from "../../web/tools/overlay.js";
import { GamepadButton } from "./gamepad_button.js";
import { Panel, Requests, StickPad } from "./teleop_panel.js";

/** @typedef {import('../../web/drive.js').Drive} Drive */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/motion/status.js').Description} Description */

/** @typedef {(message: object) => void} Send */
/**
 * @typedef {{holonomic?: boolean | null, stopPlace?: string, looks?: boolean}} Options
 */

/** The detail of a robot that could be driven, for a person who may not drive. */
const LOOKS = "You may look and press STOP. An operator can drive.";

/** The same in a frame of another page. */
const IN_FRAME = "You may look and press STOP. To drive, open WebMap in a tab of its own.";

/** The same for an operator of other robots. */
const NOT_YOURS = "You may look and press STOP. The robot's own operators can drive.";

/**
 * Drive the selected robot with keys, an on-screen stick or a gamepad, and show the
 * state.
 *
 * Options: `holonomic`, whether Q and E, and the sticks, move the robot sideways; null
 * if each robot's element decides (`data-holonomic`). `stopPlace`, a selector of the
 * page's own element for the robot's STOP; without it STOP is a part of the panel.
 * `looks`, whether the person may not drive.
 * Speeds are not known here: the gate scales. Sends `{active}` when this map starts or
 * stops to receive the page's keys.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new Teleop(map, options, send);
}

/** Instead of the keys that drive, after a driving key without its position. */
const NO_POSITIONS = "This keyboard cannot drive: use the stick.";

/** The selected robot, if it can move sideways. */
const SELECTED_HOLONOMIC = ".robot.selected[data-holonomic]";

class Teleop {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { holonomic = false, stopPlace = "", looks = false }, send) {
    this._map = map;
    /** @type {import('../../web/drive.js').Drive} */
    this._drive = map.drive;
    this._looks = looks;
    this._panel = new Panel({
      stop: () => this._stop(),
      lease: () => this._lease(),
      reset: (stops) => this._reset(stops),
      stick: () => {
        this._stick.wanted = !this._stick.wanted;
        this._show();
      },
      test: () => this._test(),
    });
    this._stick = new StickPad(this._drive);
    this._halos = new Halos(map);
    this._requests = new Requests(this._drive);
    const takes = [
      lay(map, this._requests.element, "bottom-left"),
      lay(map, this._panel.element, "bottom-left"),
      lay(map, this._stick.element, "bottom-right"),
    ];
    if (ownPlace(stopPlace)) takes.push(lay(map, this._panel.stop, undefined, stopPlace));
    this._devices = devicesOf(this._drive);
    this._pads = new GamepadButton(map);
    this._panel.addButton(this._pads.element);
    this._drivingMap = {
      map,
      get holonomic() {
        return holonomic ?? map.world.querySelector(SELECTED_HOLONOMIC) !== null;
      },
      robot: () => map.selected,
      onActive: (/** @type {boolean} */ active) => {
        send({ active });
        // A finger that stays on this map must not drive another map's robot.
        if (!active) this._stick.release();
        this._show();
      },
    };
    const ending = new AbortController();
    const touched = { capture: true, signal: ending.signal };
    for (const part of [map.svg, overlayOf(map), ...ownCorners()]) {
      for (const kind of ["pointerdown", "focusin"]) {
        part?.addEventListener(kind, () => this._devices.activate(this._drivingMap), touched);
      }
    }
    this._touch = matchMedia("(pointer: coarse)");
    const show = () => this._show();
    this.destroy = endOf(
      () => ending.abort(),
      this._stick,
      this._halos,
      this._pads,
      ...takes,
      this._devices.addMap(this._drivingMap),
      map.onSelect(() => this._select()),
      // STOP between the two presses of a button cancels the first press.
      this._drive.on("stop", () => this._panel.forget()),
      this._drive.on("step", show),
      this._drive.on("step", () => this._halos.show()),
      this._drive.on("state", show),
      // Updates for all other robots can wait for the next step.
      this._drive.on("robot", ({ robot }) => robot === map.selected && show()),
    );
    this._show();
  }

  get _report() {
    const robot = this._map.selected;
    return robot === null ? null : (this._drive.robots.get(robot) ?? null);
  }

  _select() {
    if (this._devices.active === this._drivingMap) this._devices.choose();
    this._show();
  }

  _stop() {
    const robot = this._drive.status.driven ?? this._map.selected;
    if (robot !== null) this._drive.stop(robot);
  }

  /** @param {readonly string[]} stops */
  _reset(stops) {
    for (const each of stops) this._drive.reset(...stopOf(each));
  }

  _test() {
    const robot = this._map.selected;
    if (robot !== null && this._report?.mine) this._drive.stopTest(robot);
  }

  _lease() {
    const robot = this._map.selected;
    if (robot === null) return;
    const report = this._report;
    if (report?.mine) this._drive.release(robot);
    else if (report && heldByAnother(report)) this._drive.ask(robot);
    else this._drive.take(robot);
    this._show();
  }

  _show() {
    const active = this._devices.active === this._drivingMap;
    const status = this._drive.status;
    if (this._devices.spent) Object.assign(status, { pressed: true, blocked: true });
    const report = this._report;
    const robot = this._map.selected;
    const requests = this._drive.requests;
    const verdict = this._drive.verdicts.find((one) => one.robot === robot);
    const request = requests.find((one) => one.robot === robot);
    this._requests.show(requests);
    const looks = this._looks || report?.looks === true;
    const useful = !looks && report !== null && isStickUseful(report);
    this._stick.holonomic = this._drivingMap.holonomic;
    this._stick.show(useful, status.pressed && status.blocked);
    const pointers = { touch: this._touch.matches, stick: this._stick.wanted };
    const inputs = inputsOf({ ...pointers, gamepad: this._devices.gamepad });
    const drawn = this._map.world.querySelector(".robot.selected");
    const seen = drawn instanceof SVGElement ? drawn.dataset : {};
    const more = { verdict, request, inputs, seen };
    const words = describe(status, robot, report, active, more);
    const idle = words.state === "free" || words.state === "ready";
    if (idle && this._devices.codeless) words.detail = NO_POSITIONS;
    const invites = idle || words.detail.startsWith("To drive");
    if (looks && invites) words.detail = !this._looks ? NOT_YOURS : FRAMED ? IN_FRAME : LOOKS;
    this._panel.showState(withoutKeys(words, pointers, inputs), report, status.delay);
    const asking = request?.by === status.connection;
    const stick = useful ? this._stick.wanted : null;
    this._panel.showButtons(report, asking, stick, looks);
    const moving = robot === null ? null : this._drive.motionDelay(robot);
    // Reports from before the connection was lost do not describe the present.
    const current = status.link === "lost" ? null : report;
    this._panel.showFigures(current, status.delay, moving);
  }
}

/**
 * @param {import('../../web/motion/report.js').RobotReport} report
 * @returns {boolean} Whether a stick could drive the robot without a request to another
 *     operator.
 */
function isStickUseful(report) {
  return mayTake(report) || (report.mine && !isLatched(report));
}

/**
 * Circles around the driven robots: the stopping distance of each at its present speed.
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

  /** Update which robots move, and how fast; unknown without a connection. */
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
    // Below the robots, so that a circle hides no robot and blocks no press.
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

  /** Move each circle with its robot, as long as there are circles. */
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
 * @returns {{x: number, y: number} | null} Metres; null if the map does not show the
 *     robot.
 */
function placeOf(map, robot) {
  const element = map.world.querySelector(`.robot[data-robot="${CSS.escape(robot)}"]`);
  if (!(element instanceof SVGGraphicsElement)) return null;
  if (element.classList.contains("unplaced")) return null;
  map.crowd.draw(element);
  // Read without consolidate(), because the scene keeps references to the list's items.
  const list = element.transform.baseVal;
  if (list.numberOfItems === 0) return null;
  let matrix = list.getItem(0).matrix;
  for (let i = 1; i < list.numberOfItems; i++) {
    matrix = matrix.multiply(list.getItem(i).matrix);
  }
  return { x: matrix.e, y: matrix.f };
}

/**
 * Remove the keys from a description where fingers drive by the stick: a phone has no
 * Space.
 *
 * @param {Description} description
 * @param {{touch: boolean, stick: boolean}} what Whether fingers are the pointer, and
 *     whether the stick is shown.
 * @param {string} inputs The available inputs.
 * @returns {Description}
 */
export function withoutKeys(description, { touch, stick }, inputs) {
  if (!touch || !stick || description.state !== "ready") return description;
  return { ...description, detail: `Hold ${inputs} to drive. Release to stop.` };
}
