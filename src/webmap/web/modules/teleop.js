import { deskOf } from "../inputs/desk.js";
import { isLatched } from "../motion/report.js";
import { capOf, describe } from "../motion/status.js";
import { button, html, say } from "./elements.js";
import { lay, overlayOf } from "./overlay.js";
import { ResetButton } from "./reset_button.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {(message: object) => void} Send */
/** @typedef {import('../halves.js').Half} Half */

/** From this loop age on it is said aloud, in ms. */
const SLOW = 150;

/**
 * Drive the selected robot with W A S D or the arrows, and show how that stands.
 *
 * Options: `holonomic`, whether Q and E move the base sideways. Speeds are not known
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
    });
    const take = lay(map, this._panel.element, "bottom-left");
    this._desk = deskOf(this._drive);
    this._seat = {
      map,
      holonomic,
      robot: () => map.selected,
      onActive: (/** @type {boolean} */ active) => {
        send({ active });
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
      take,
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

  _lease() {
    const robot = this._map.selected;
    if (robot === null) return;
    if (this._report?.mine) this._drive.release(robot);
    else this._drive.take(robot);
  }

  _show() {
    const active = this._desk.active === this._seat;
    const status = this._drive.status;
    const report = this._report;
    const robot = this._map.selected;
    const verdict = this._drive.verdicts.find((one) => one.robot === robot);
    this._panel.show(
      describe(status, robot, report, active, verdict),
      report,
      status.delay,
    );
  }
}

/** The words, the shape and the buttons in the corner of the map. */
class Panel {
  /** @param {{stop: () => void, lease: () => void, reset: () => void}} acts */
  constructor(acts) {
    this._mark = html("span", "webmap-teleop-mark", { "aria-hidden": "true" });
    this._title = html("strong", "webmap-teleop-title");
    this._detail = html("span", "webmap-teleop-detail");
    this._cap = html("p", "webmap-teleop-cap");
    this._stop = button("webmap-stop-button webmap-teleop-stop", "Stop", acts.stop);
    this._lease = button("webmap-teleop-lease", "Take", acts.lease);
    this._reset = new ResetButton(acts.reset);
    const state = html(
      "p",
      "webmap-teleop-state",
      { role: "status" },
      this._title,
      " ",
      this._detail,
    );
    this.element = html(
      "section",
      "webmap-panel webmap-teleop",
      { "aria-label": "Driving" },
      this._mark,
      html("div", "webmap-teleop-words", {}, state, this._cap),
      html("div", "webmap-teleop-acts", {}, this._lease, this._reset.element),
      this._stop,
    );
  }

  /**
   * @param {import('../motion/status.js').Description} description
   * @param {import('../motion/report.js').RobotReport | null} report
   * @param {number | null} delay
   */
  show({ state, title, detail }, report, delay) {
    if (this.element.dataset.state !== state) this.element.dataset.state = state;
    say(this._title, title);
    say(this._detail, detail);
    say(this._cap, report ? capOf(report) + slowness(delay) : "");
    this._showButtons(report);
  }

  /** @param {import('../motion/report.js').RobotReport | null} report */
  _showButtons(report) {
    const name = report?.name ?? "";
    say(this._lease, report?.mine ? "Hand back" : "Take");
    label(this._lease, report?.mine ? `Hand back ${name}` : `Take ${name}`);
    const latched = report !== null && isLatched(report);
    const free = report?.armable && report.holder === null && !latched;
    this._lease.hidden = !(report?.mine || free);
    this._reset.show("Reset", latched);
    label(this._stop, name ? `Stop ${name}` : "Stop the selected robot");
    // Off only when there is nothing to stop, never because of doubt.
    this._stop.disabled = report === null;
  }
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
