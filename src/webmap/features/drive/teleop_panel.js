import { Stick } from "../../web/inputs/sticks.js";
import { isTested, motions, ownStop, stopTestText, timings } from "../../web/motion/measurements.js";
import { heldByProgram, isLatched, stopKey } from "../../web/motion/report.js";
import { begun, capOf, speedOf } from "../../web/motion/status.js";
import {
  button,
  forgetOthers,
  html,
  setAttribute,
  setHidden,
  setText,
  stopButton,
  TwiceButton,
} from "../../web/tools/elements.js";

/** @typedef {import('../../web/drive.js').Drive} Drive */
/** @typedef {import('../../web/motion/session.js').Request} Request */
/** @typedef {import('../../web/motion/report.js').RobotReport} RobotReport */

/** Round trip from which the panel shows a warning, in ms. */
const SLOW = 150;

const ASK = "Request control";

/** The text, the shape and the buttons in the corner of the map. */
export class Panel {
  /**
   * @param {Record<'stop' | 'lease' | 'stick' | 'test', () => void> &
   *     {reset: (stops: readonly string[]) => void}} acts
   */
  constructor(acts) {
    this._mark = html("span", "webmap-teleop-mark", { "aria-hidden": "true" });
    this._title = html("strong", "webmap-teleop-title");
    this._detail = html("span", "webmap-teleop-detail");
    this._why = html("p", "webmap-teleop-why");
    this._cap = html("p", "webmap-teleop-cap");
    this._speed = html("p", "webmap-teleop-speed", { title: "Measured velocity" });
    this._own = html("p", "webmap-teleop-own");
    this._test = html("p", "webmap-teleop-test", { role: "status" });
    this._figures = html("dl", "webmap-teleop-figures");
    /** @type {Map<string, HTMLElement>} */
    this._values = new Map();
    /** In this panel, unless the page has its own place for STOP. */
    this.stop = stopButton("webmap-teleop-stop", "STOP", acts.stop);
    this._lease = button("webmap-teleop-lease", "Take control", acts.lease);
    this._reset = new TwiceButton(
      "webmap-reset",
      "Reset",
      "Press again to reset",
      acts.reset,
    );
    this._tester = new TwiceButton(
      "webmap-stop-test",
      "Run stop test",
      "Robot will move slowly: press again",
      acts.test,
    );
    this._tester.element.title =
      "Moves the robot slowly, ends the commands and measures when the robot stops";
    this._stick = button("webmap-teleop-stick", "Stick", acts.stick);
    this._stick.title = "Show a stick on the screen to drive with";
    this._state = html("p", "webmap-teleop-state", { role: "status" }, this._title, " ");
    // The most important first: a page with little room leaves out the last ones.
    this._words = html(
      "div",
      "webmap-teleop-words",
      {},
      ...[this._state, this._test, this._why, this._speed, this._cap, this._own],
    );
    this._fold = button("webmap-teleop-fold", "Figures", () => this._turn());
    this._fold.title = "Show the velocities sent, arrived and measured, delays and distances";
    this._fold.setAttribute("aria-expanded", "false");
    const confirmed = [this._reset.element, this._tester.element];
    const buttons = [this._lease, ...confirmed, this._stick, this._fold];
    this._acts = html("div", "webmap-teleop-acts", {}, ...buttons);
    this.element = html(
      "section",
      "webmap-panel webmap-teleop",
      { "aria-label": "Driving" },
      this._mark,
      this._words,
      this._acts,
      this.stop,
      this._figures,
    );
  }

  /**
   * @param {import('../../web/motion/status.js').Description} description
   * @param {RobotReport | null} report
   * @param {number | null} delay
   */
  showState({ state, title, detail, least, warns = false }, report, delay) {
    if (this.element.dataset.state !== state) this.element.dataset.state = state;
    this.element.classList.toggle("warns", warns);
    setText(this._title, title);
    setText(this._detail, detail);
    const place = least ? this._words : this._state;
    if (this._detail.parentElement !== place) place.append(this._detail);
    const stated = report?.why.some((why) => why.startsWith("slow connection"));
    const slow = stated ? "" : slowness(report?.age ?? delay);
    const { why, cap } = report ? capOf(report, slow) : { why: "", cap: "" };
    setText(this._why, why);
    setText(this._cap, cap);
  }

  /** @param {HTMLElement} element A button of another part, beside those of this panel. */
  addButton(element) {
    this._acts.append(element);
  }

  /** Fold the figures out or in, on a page where the panel is one line. */
  _turn() {
    const open = this.element.classList.toggle("unfolded");
    this._fold.setAttribute("aria-expanded", `${open}`);
  }

  /**
   * @param {RobotReport | null} report
   * @param {number | null} loop
   * @param {number | null} moving
   */
  showFigures(report, loop, moving) {
    setText(this._own, report ? ownStop(report) : "");
    setText(this._speed, report?.measured ? speedOf(report) : "");
    setHidden(this._fold, report === null || isLatched(report));
    setText(this._test, report ? stopTestText(report) : "");
    setHidden(this._figures, report === null || isLatched(report));
    this._figures.classList.toggle("idle", !report?.mine);
    if (report === null) return;
    const all = [...motions(report), ...timings(report, loop, moving)];
    for (const { name, kind, text, more = "", title = "" } of all) {
      const figure = this._figure(name, kind);
      setAttribute(figure, "title", title);
      const [value, rest] = figure.querySelectorAll("dd > span");
      setText(value, text);
      setText(rest, more);
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
    const figure = html("div", kind, {}, html("dt", "", {}, name), value);
    this._figures.append(figure);
    this._values.set(name, figure);
    return figure;
  }

  /** Forget the first presses of buttons that require two. */
  forget() {
    this._reset.forget();
    this._tester.forget();
  }

  /**
   * @param {RobotReport | null} report
   * @param {boolean} asking Whether this page has requested control of the robot.
   * @param {boolean | null} stick Whether the stick is switched on; null where it is
   *     useless.
   * @param {boolean} looks Whether the person may not drive: only STOP is of use.
   */
  showButtons(report, asking, stick, looks) {
    const name = report?.name ?? "";
    const robots = report === null ? [] : [report.robot];
    const act = looks ? null : controlAction(report, asking);
    setHidden(this._lease, act === null);
    if (act !== null) {
      setText(this._lease, act);
      // Begins with the button's text, for people who use speech control.
      setAttribute(this._lease, "aria-label", `${act} of ${name}`);
    }
    const stops = report === null ? [] : [stopKey(report)];
    this._reset.show(!looks && report !== null && isLatched(report), stops);
    this._tester.show(report !== null && mayTest(report), robots);
    const known = report?.stop_time != null;
    this._tester.element.classList.toggle("known", known);
    setHidden(this._stick, stick === null);
    setAttribute(this._stick, "aria-pressed", String(stick === true));
    setAttribute(this.stop, "aria-label", name ? `STOP ${name}` : "STOP the selected robot");
    // Disabled only when there is nothing to stop, never because the state is unknown.
    setAttribute(this.stop, "data-robot", name);
    this.stop.toggleAttribute("disabled", report === null);
  }
}

/**
 * Return the operator's possible action on control of a robot.
 *
 * @param {RobotReport | null} report
 * @param {boolean} asking Whether this page has requested control.
 * @returns {string | null}
 */
function controlAction(report, asking) {
  if (report === null || report.changing) return null;
  if (report.mine) return "Release control";
  if (!report.armable || isLatched(report)) return null;
  if (report.holder === null) return "Take control";
  return heldByProgram(report) || asking ? null : ASK;
}

/**
 * @param {RobotReport} report
 * @returns {boolean} Whether this page may run the stop test: also for a robot whose
 *     command timeout is stated or was tested before.
 */
function mayTest(report) {
  return report.mine && !isTested(report);
}

/** @param {number | null} delay */
function slowness(delay) {
  return delay !== null && delay >= SLOW ? `slow connection: ${Math.round(delay)} ms` : "";
}

/**
 * The on-screen stick: shown from the start on touch devices, and on request elsewhere.
 */
export class StickPad {
  /** @param {Drive} drive */
  constructor(drive) {
    this._sideways = false;
    /** Whether the operator has switched the stick on. */
    this.wanted = matchMedia("(pointer: coarse)").matches;
    const knob = html("div", "webmap-stick-knob");
    this._pad = html(
      "div",
      "webmap-stick",
      { role: "img", "aria-label": "Stick: hold the knob and move it to drive" },
      knob,
    );
    this._mode = button("webmap-panel webmap-stick-mode", "Sideways", () => {
      this._stick.release();
      this._sideways = !this._sideways;
      this._mode.setAttribute("aria-pressed", String(this._sideways));
    });
    this._mode.title = "Left and right move the robot sideways and do not turn it";
    this._mode.setAttribute("aria-pressed", "false");
    this._mode.hidden = true;
    this.element = html("div", "webmap-stick-place", {}, this._mode, this._pad);
    this._stick = new Stick(drive, this._pad, () => this._sideways && !this._mode.hidden);
    this.show(false, false);
  }

  /** Whether the driven robot can move sideways. */
  set holonomic(/** @type {boolean} */ holonomic) {
    if (this._mode.hidden !== holonomic) return;
    // The same stick position would suddenly mean another velocity.
    this._stick.release();
    setHidden(this._mode, !holonomic);
  }

  /** Release the stick. */
  release() {
    this._stick.release();
  }

  /**
   * @param {boolean} useful Whether there is a robot that the stick could drive.
   * @param {boolean} dead Whether the input has no effect.
   */
  show(useful, dead) {
    const visible = useful && this.wanted;
    if (!visible) this._stick.release();
    setHidden(this.element, !visible);
    this._pad.classList.toggle("dead", dead);
  }

  destroy() {
    this._stick.destroy();
  }
}

/** Requests of others for control of robots, each with its two answers. */
export class Requests {
  /** @param {Drive} drive */
  constructor(drive) {
    this._drive = drive;
    /** @type {Map<string, {item: HTMLElement, left: HTMLElement}>} */
    this._items = new Map();
    this.element = html("ul", "webmap-requests");
    this.element.hidden = true;
  }

  /** @param {Request[]} requests */
  show(requests) {
    const asked = requests.filter(({ mine }) => mine);
    const keys = new Set(asked.map(keyOf));
    forgetOthers(this._items, keys, ({ item }) => item.remove());
    for (const request of asked) {
      const { left } = this._items.get(keyOf(request)) ?? this._add(request);
      setText(left, `(${request.left} s)`);
    }
    setHidden(this.element, asked.length === 0);
  }

  /** @param {Request} request */
  _add(request) {
    const { robot, name, who } = request;
    const left = html("span", "webmap-request-left", { role: "timer" });
    const words = html(
      "p",
      "webmap-request-words",
      {},
      html("strong", "", { role: "alert" }, begun(`${who} requests control of ${name}`)),
      " ",
      left,
    );
    const item = html(
      "li",
      "webmap-panel webmap-request",
      {},
      words,
      answer("Hand over", `Hand over ${name}`, () => this._drive.grant(robot)),
      answer("Keep control", `Keep control of ${name}`, () => this._drive.deny(robot)),
    );
    this.element.append(item);
    const made = { item, left };
    this._items.set(keyOf(request), made);
    return made;
  }
}

/**
 * @param {string} label
 * @param {string} name The accessible name; begins with the label.
 * @param {() => void} act
 */
function answer(label, name, act) {
  const element = button("webmap-request-answer", label, act);
  element.setAttribute("aria-label", name);
  return element;
}

/** @param {Request} request */
function keyOf({ robot, by, who, name }) {
  return JSON.stringify([robot, by, who, name]);
}
