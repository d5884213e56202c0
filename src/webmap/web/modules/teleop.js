import { deskOf } from "../inputs/desk.js";
import { heldByAnother, heldByProgram, isLatched } from "../motion/report.js";
import { motions, ownStop, timings } from "../motion/figures.js";
import { capOf, describe, inputsOf } from "../motion/status.js";
import { button, html, say } from "./elements.js";
import { Halos } from "./halos.js";
import { lay, overlayOf } from "./overlay.js";
import { Requests } from "./requests.js";
import { StickPad } from "./stick_pad.js";
import { TwiceButton } from "./twice_button.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {(message: object) => void} Send */
/** @typedef {import('../halves.js').Half} Half */

/** From this loop age on it is said aloud, in ms. */
const SLOW = 150;

/**
 * Drive the selected robot with keys, an on-screen stick or a gamepad, and show how that
 * stands.
 *
 * Options: `holonomic`, whether Q and E, and the sticks, move the base sideways. Speeds are not known
 * here: the gate scales. Sends `{active}` when the page's keys start or stop to belong
 * to this map.
 *
 * @param {MapCanvas} map
 * @param {{holonomic?: boolean}} options
 * @param {Send} send
 * @returns {Half}
 */
export default function attach(map, options, send) {
  const teleop = new Teleop(map, options, send);
  return { destroy: () => teleop.destroy() };
}

class Teleop {
  /**
   * @param {MapCanvas} map
   * @param {{holonomic?: boolean}} options
   * @param {Send} send
   */
  constructor(map, { holonomic = false }, send) {
    this._map = map;
    /** @type {import('../drive.js').Drive} */
    this._drive = map.drive;
    this._panel = new Panel({
      stop: () => this._stop(),
      lease: () => this._lease(),
      reset: () => this._reset(),
      stick: () => this._toggleStick(),
      test: () => this._test(),
    });
    this._stick = new StickPad(this._drive, holonomic);
    this._halos = new Halos(map);
    this._requests = new Requests(this._drive);
    const takes = [
      lay(map, this._requests.element, "bottom-left"),
      lay(map, this._panel.element, "bottom-left"),
      lay(map, this._stick.element, "bottom-right"),
    ];
    this._desk = deskOf(this._drive);
    this._seat = {
      map,
      holonomic,
      robot: () => map.selected,
      onActive: (/** @type {boolean} */ active) => {
        send({ active });
        // A finger that stays on this map must not drive another map's robot.
        if (!active) this._stick.release();
        this._show();
      },
    };
    this._ending = new AbortController();
    const touched = { capture: true, signal: this._ending.signal };
    for (const part of [map.svg, overlayOf(map)]) {
      for (const kind of ["pointerdown", "focusin"]) {
        part?.addEventListener(kind, () => this._desk.activate(this._seat), touched);
      }
    }
    const show = () => this._show();
    this._offs = [
      ...takes,
      this._desk.sit(this._seat),
      map.onSelect(() => this._select()),
      this._drive.on("step", show),
      this._drive.on("state", show),
      this._drive.on("robot", show),
    ];
    this._show();
  }

  destroy() {
    this._ending.abort();
    this._stick.destroy();
    this._halos.destroy();
    for (const off of this._offs) off();
  }

  get _report() {
    const robot = this._map.selected;
    return robot === null ? null : (this._drive.robots.get(robot) ?? null);
  }

  _select() {
    if (this._desk.active === this._seat) this._desk.choose();
    this._show();
  }

  _stop() {
    const robot = this._drive.status.driven ?? this._map.selected;
    if (robot !== null) this._drive.stop(robot);
  }

  _reset() {
    const robot = this._map.selected;
    if (robot !== null) this._drive.reset(robot);
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

  _toggleStick() {
    this._stick.wanted = !this._stick.wanted;
    this._show();
  }

  _show() {
    const active = this._desk.active === this._seat;
    const status = this._drive.status;
    if (this._desk.spent) Object.assign(status, { pressed: true, dead: true });
    const report = this._report;
    const robot = this._map.selected;
    const requests = this._drive.requests;
    const verdict = this._drive.verdicts.find((one) => one.robot === robot);
    const request = requests.find((one) => one.robot === robot);
    this._requests.show(requests);
    this._halos.show();
    const useful = report !== null && !isLatched(report) && (report.mine || report.armable);
    this._stick.show(useful, status.pressed && status.dead);
    const inputs = inputsOf({
      touch: matchMedia("(pointer: coarse)").matches,
      stick: this._stick.wanted,
      gamepad: this._desk.gamepad,
    });
    this._panel.show(
      describe(status, robot, report, active, { verdict, request, inputs }),
      report,
      status.delay,
      actOf(report, request, status.connection),
      useful ? this._stick.wanted : null,
    );
    const moving = robot === null ? null : this._drive.motionDelay(robot);
    this._panel.showFigures(report, status.delay, moving);
  }
}

/** The words, the shape and the buttons in the corner of the map. */
class Panel {
  /** @param {Record<'stop' | 'lease' | 'reset' | 'stick' | 'test', () => void>} acts */
  constructor(acts) {
    this._mark = html("span", "webmap-teleop-mark", { "aria-hidden": "true" });
    this._title = html("strong", "webmap-teleop-title");
    this._detail = html("span", "webmap-teleop-detail");
    this._cap = html("p", "webmap-teleop-cap");
    this._own = html("p", "webmap-teleop-own");
    this._test = html("p", "webmap-teleop-test", { role: "status" });
    this._figures = html("dl", "webmap-teleop-figures");
    /** @type {Map<string, HTMLElement>} */
    this._values = new Map();
    this._stop = button("webmap-stop-button webmap-teleop-stop", "Stop", acts.stop);
    this._lease = button("webmap-teleop-lease", "Take", acts.lease);
    this._reset = new TwiceButton(
      "webmap-reset",
      "Reset",
      "Press again to reset",
      acts.reset,
    );
    this._tester = new TwiceButton(
      "webmap-stop-test",
      "Test its stop",
      "It will creep: press again",
      acts.test,
    );
    this._tester.element.title = "Creeps, sends nothing any more, and sees when it stands";
    this._stick = button("webmap-teleop-stick", "Stick", acts.stick);
    this._stick.title = "A stick on the screen to drive with";
    const state = html(
      "p",
      "webmap-teleop-state",
      { role: "status" },
      this._title,
      " ",
      this._detail,
    );
    const twice = [this._reset.element, this._tester.element];
    const buttons = [this._lease, ...twice, this._stick];
    this.element = html(
      "section",
      "webmap-panel webmap-teleop",
      { "aria-label": "Driving" },
      this._mark,
      html("div", "webmap-teleop-words", {}, state, this._test, this._cap, this._own),
      html("div", "webmap-teleop-acts", {}, ...buttons),
      this._stop,
      this._figures,
    );
  }

  /**
   * @param {import('../motion/status.js').Description} description
   * @param {import('../motion/report.js').RobotReport | null} report
   * @param {number | null} delay
   * @param {string | null} act What can be done about the lease.
   * @param {boolean | null} stick Whether the stick is wanted; null when it is no use.
   */
  show({ state, title, detail }, report, delay, act, stick) {
    if (this.element.dataset.state !== state) this.element.dataset.state = state;
    say(this._title, title);
    say(this._detail, detail);
    say(this._cap, report ? capOf(report) + slowness(delay) : "");
    this._showButtons(report, act);
    this._stick.hidden = stick === null;
    if (this._stick.getAttribute("aria-pressed") !== String(stick === true)) {
      this._stick.setAttribute("aria-pressed", String(stick === true));
    }
  }

  /**
   * @param {import('../motion/report.js').RobotReport | null} report
   * @param {number | null} loop
   * @param {number | null} moving
   */
  showFigures(report, loop, moving) {
    say(this._own, report ? ownStop(report) : "");
    say(this._test, report?.test ? report.test.text : "");
    // There before it is driven, so that nothing moves under a thumb as it begins.
    this._figures.hidden = report === null || isLatched(report);
    if (report === null) return;
    const all = [...motions(report), ...timings(report, loop, moving)];
    for (const { name, kind, text, more = "" } of all) {
      const [value, rest] = this._figure(name, kind).children;
      say(value, text);
      say(rest, more);
    }
  }

  /**
   * @param {string} name
   * @param {string} kind
   */
  _figure(name, kind) {
    const known = this._values.get(name);
    if (known) return known;
    const value = html("dd", "", {}, html("span", ""), html("span", "more"));
    this._figures.append(html("div", kind, {}, html("dt", "", {}, name), value));
    this._values.set(name, value);
    return value;
  }

  /**
   * @param {import('../motion/report.js').RobotReport | null} report
   * @param {string | null} act
   */
  _showButtons(report, act) {
    const name = report?.name ?? "";
    this._lease.hidden = act === null;
    if (act !== null) {
      say(this._lease, act);
      label(this._lease, act.endsWith(" it") ? act.replace(/it$/, name) : `${act} ${name}`);
    }
    this._reset.show(report !== null && isLatched(report));
    this._tester.show(report !== null && mayTest(report));
    label(this._stop, name ? `Stop ${name}` : "Stop the selected robot");
    // Off only when there is nothing to stop, never because of doubt.
    this._stop.disabled = report === null;
  }
}

/**
 * Return what the operator can do about a robot's lease.
 *
 * @param {import('../motion/report.js').RobotReport | null} report
 * @param {import('../motion/asking.js').Request | undefined} request
 * @param {string | null} connection This page's.
 * @returns {'Hand back' | 'Take' | 'Ask for it' | null}
 */
function actOf(report, request, connection) {
  if (report === null || report.changing) return null;
  if (report.mine) return "Hand back";
  if (!report.armable || isLatched(report)) return null;
  if (report.holder === null) return "Take";
  if (heldByProgram(report) || request?.by === connection) return null;
  return "Ask for it";
}

/**
 * @param {import('../motion/report.js').RobotReport} report
 * @returns {boolean} Whether this page may find out that the robot stops by itself, which
 *     nobody knows yet.
 */
function mayTest({ mine, stop_time, test }) {
  const running = test?.state === "creeping" || test?.state === "waiting";
  return mine && stop_time === null && !running;
}

/** @param {number | null} delay */
function slowness(delay) {
  return delay !== null && delay >= SLOW ? `. Slow: ${Math.round(delay)} ms` : "";
}

/**
 * @param {Element} element
 * @param {string} text
 */
function label(element, text) {
  if (element.getAttribute("aria-label") !== text) {
    element.setAttribute("aria-label", text);
  }
}
