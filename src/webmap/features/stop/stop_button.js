import { MAY_MOVE } from "../../web/constants.js";
import { devicesOf } from "../../web/inputs/devices.js";
import { isLatched, stopKey, stopOf } from "../../web/motion/report.js";
import { Obedience, linesOf, standingStops } from "../../web/motion/stops.js";
import {
  button,
  forgetOthers,
  html,
  inOrder,
  setHidden,
  setText,
  stopButton,
  TwiceButton,
} from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/drive.js').Drive} Drive */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/motion/stops.js').Verdict} Verdict */

/**
 * Greatest number of robots of one Reset: a page that sends more than 120 messages at
 * once loses its connection. The other robots stay stopped until the next Reset.
 */
const RESET_AT_ONCE = 60;

/**
 * A button that stops all robots, always visible, and the result of every STOP.
 *
 * Also covers the page with an alarm when a robot moves or may move in spite of zero.
 * Space and Escape stop the driven or selected robot, or all robots if there is none;
 * Shift with Escape stops all robots. The keys work with and without a `Teleop` on the
 * map.
 *
 * Options: `place`, a selector of the page's own element for the button; without it the
 * button is over the map.
 *
 * @param {MapCanvas} map
 * @param {{place?: string}} options
 * @returns {BrowserPart}
 */
export default function attach(map, options) {
  return new Stop(map, options);
}

class Stop {
  /**
   * @param {MapCanvas} map
   * @param {{place?: string}} options
   */
  constructor(map, { place }) {
    /** @type {Drive} */
    this._drive = map.drive;
    this._obedience = new Obedience();
    /**
     * Why the gate refused the last Reset, by robot.
     * @type {Map<string, string>}
     */
    this._refused = new Map();
    this._alarm = new Alarm(() => this._drive.stop("*"));
    this._verdicts = html("div", "webmap-stop-verdicts", { role: "status" });
    this._close = button("webmap-stop-close", "Close", () => {
      this._drive.dismissVerdicts();
      this._show();
    });
    this._standing = html("p", "webmap-stop-standing", { role: "status" });
    this._reset = new TwiceButton(
      "webmap-reset",
      "Reset",
      "Press again to reset",
      (stops) => {
        this._refused.clear();
        for (const each of stops.slice(0, RESET_AT_ONCE)) this._drive.reset(...stopOf(each));
      },
    );
    const all = stopButton("webmap-stop-all", "STOP ALL", () => {
      this._drive.stop("*");
    });
    all.title = "Shortcut: Shift+Esc";
    this._list = html(
      "div",
      "webmap-stop-list",
      { role: "group", "aria-label": "Results of STOP" },
      this._verdicts,
      html("div", "webmap-stop-row", {}, this._standing, this._reset.element, this._close),
    );
    this._list.hidden = true;
    const panel = html(
      "section",
      "webmap-panel webmap-stop",
      { "aria-label": "STOP for all robots" },
      all,
      this._list,
    );
    this._shown = "";
    const drive = this._drive;
    this.destroy = endOf(
      lay(map, panel, "top-right", place),
      devicesOf(drive).open(),
      drive.on("stop", () => this._stopped()),
      drive.on("robot", (report) => this._report(report)),
      drive.on("goal", (robot) => this._obedience.excuse(robot)),
      drive.on("gone", (robot) => {
        this._obedience.excuse(robot);
        this._refused.delete(robot);
      }),
      drive.on("refused", ({ robot, what, why }) => {
        if (what === "reset" && robot !== null) this._refused.set(robot, why);
      }),
      drive.on("step", () => this._show()),
      this._alarm,
      () => document.body.classList.remove("webmap-results"),
    );
  }

  /** @param {import('../../web/motion/report.js').RobotReport} report */
  _report(report) {
    this._obedience.report(report, performance.now());
    if (!isLatched(report)) this._refused.delete(report.robot);
  }

  _stopped() {
    // A STOP between the two presses cancels the first press.
    this._reset.forget();
    this._show();
  }

  _show() {
    this._alarm.show(this._alarms());
    const { robots, verdicts } = this._drive;
    const standing = standingStops(robots.values());
    setText(this._standing, [standing, ...this._refusals()].join(" "));
    const stopped = [...robots.values()].filter(isLatched);
    const latched = stopped.filter(({ looks }) => !looks).map(stopKey);
    const reset = latched.length > 1 ? "Reset all" : "Reset";
    this._reset.show(latched.length > 0, latched, reset);
    setHidden(this._close, verdicts.length === 0);
    setHidden(this._list, verdicts.length === 0 && standing === "");
    document.body.classList.toggle("webmap-results", !this._list.hidden);
    this._showVerdicts(verdicts.sort(byName));
  }

  /** @returns {string[]} The refused Resets, with reasons. */
  _refusals() {
    const { robots } = this._drive;
    return [...this._refused].map(
      ([robot, why]) => `Reset of ${robots.get(robot)?.name ?? robot} refused: ${why}.`,
    );
  }

  /**
   * The gate's own alarms, and alarms that only this page detects.
   *
   * @returns {Map<string, string>} The text for each robot.
   */
  _alarms() {
    const alarms = new Map();
    for (const { robot, name, alarm } of this._obedience.disobeying(performance.now())) {
      if (alarm === undefined) alarms.set(robot, name);
    }
    for (const { robot, name, alarm, other_writer } of this._drive.robots.values()) {
      const words = [alarm, other_writer].filter(Boolean).join("; ");
      if (alarm) alarms.set(robot, `${name}: ${words}`);
    }
    return alarms;
  }

  /** @param {Verdict[]} verdicts */
  _showVerdicts(verdicts) {
    const lines = linesOf(verdicts);
    const shown = JSON.stringify(lines);
    if (shown === this._shown) return;
    this._shown = shown;
    this._verdicts.replaceChildren(
      ...lines.map(({ state, text }) => {
        const item = html("p", "webmap-stop-verdict", {}, text);
        item.dataset.state = state;
        return item;
      }),
    );
  }
}

/**
 * @param {Verdict} one
 * @param {Verdict} other
 */
function byName(one, other) {
  return inOrder(one.name, other.name);
}

/** Covers the page: a robot does not follow its commands, or perhaps gets none. */
class Alarm {
  /**
   * @param {() => void} stopAll Used where no button of the page for STOP ALL is
   *     visible.
   */
  constructor(stopAll) {
    // The figures change several times a second; screen readers must not read each
    // change.
    this._names = html("p", "webmap-alarm-names", { "aria-live": "off" });
    this._title = html("p", "webmap-alarm-title");
    /** @type {Set<string>} */
    this._seen = new Set();
    /** @type {ReadonlyMap<string, string>} */
    this._current = new Map();
    this._ending = new AbortController();
    this._stop = stopButton("webmap-alarm-stop", "STOP ALL", stopAll);
    // STOP is at its usual place for an operator who knows the page.
    this._twins = new StopTwins();
    this._element = html(
      "div",
      "webmap-alarm",
      { role: "alert", "aria-atomic": "false", popover: "manual" },
      this._twins.element,
      this._title,
      html("p", "webmap-alarm-act", {}, "Use the emergency stop of the robot."),
      this._names,
      this._stop,
      button("webmap-alarm-seen", "Acknowledge", () => {
        this._seen = new Set(this._current.keys());
        this.show(this._current);
      }),
    );
  }

  destroy() {
    this._ending.abort();
    this._element.remove();
  }

  /** @param {ReadonlyMap<string, string>} alarms By robot. */
  show(alarms) {
    this._current = alarms;
    for (const robot of this._seen) if (!alarms.has(robot)) this._seen.delete(robot);
    const news = [...alarms].filter(([robot]) => !this._seen.has(robot));
    setText(this._names, news.map(([, words]) => words).join(", "));
    const silent = news.every(([, words]) => words.includes(MAY_MOVE));
    setText(this._title, silent ? "ROBOT MAY STILL BE MOVING" : "ROBOT NOT OBEYING");
    if (news.length === 0) {
      if (this._element.isConnected) this.destroy();
    } else {
      if (!this._element.isConnected) this._begin();
      this._place();
    }
  }

  /** Put STOP at its place on the page, and everything else beside it. */
  _place() {
    const { all, top, bottom } = this._twins.place();
    setHidden(this._stop, all);
    this._element.style.paddingBlock = `${Math.max(top, 24)}px ${Math.max(bottom, 24)}px`;
  }

  _begin() {
    document.body.append(this._element);
    this._raise();
    this._ending.abort();
    this._ending = new AbortController();
    const options = { capture: true, signal: this._ending.signal };
    const raise = (/** @type {Event} */ event) => {
      if (mayCover(event)) this._raise();
    };
    document.addEventListener("toggle", raise, options);
    document.addEventListener("fullscreenchange", () => this._raise(), options);
    window.addEventListener("resize", () => this._place(), options);
  }

  /**
   * Move above popovers and dialogs: the last opened is on top, whatever its z-index.
   * In a browser without popovers the alarm is above everything except dialogs.
   */
  _raise() {
    if (!("popover" in HTMLElement.prototype)) return;
    this._element.hidePopover();
    this._element.showPopover();
  }
}

/**
 * @param {Event} event Something was opened or closed.
 * @returns {boolean} Whether the element may cover the alarm now. Another map's alarm
 *     does not count, because the two would rise above each other for ever.
 */
function mayCover({ target }) {
  const covers = "dialog, [popover]:not(.webmap-alarm)";
  return target instanceof Element && target.matches(covers);
}

/** The page's STOP buttons that can be pressed, except those of an alarm. */
const ORIGINALS = ".webmap-stop-button:enabled:not(.webmap-alarm *)";

/** Pixels between a twin and its neighbours. */
const GAP = 16;

/**
 * Copies of the page's STOP buttons, each at the place of its original.
 *
 * An element that covers the page contains them, so that STOP stays at its usual place.
 */
class StopTwins {
  constructor() {
    this.element = html("div", "webmap-stop-twins");
    /** @type {Map<HTMLButtonElement, HTMLButtonElement>} */
    this._twins = new Map();
  }

  /**
   * Follow the originals: their number, places and texts.
   *
   * @returns {{all: boolean, top: number, bottom: number}} `all`: whether one of them
   *     stops all robots. `top` and `bottom`: pixels that the twins need there.
   */
  place() {
    const originals = [...document.querySelectorAll(ORIGINALS)].filter(isInSight);
    forgetOthers(this._twins, new Set(originals), (twin) => twin.remove());
    const room = { all: false, top: 0, bottom: 0 };
    for (const original of originals) {
      const { left, top, right, bottom } = original.getBoundingClientRect();
      this._twinOf(original).style.inset = [
        `${top}px`,
        `${innerWidth - right}px`,
        `${innerHeight - bottom}px`,
        `${left}px`,
      ].join(" ");
      room.all ||= original.matches(".webmap-stop-all");
      if (top + bottom < innerHeight) room.top = Math.max(room.top, bottom + GAP);
      else room.bottom = Math.max(room.bottom, innerHeight - top + GAP);
    }
    return room;
  }

  /** @param {HTMLButtonElement} original */
  _twinOf(original) {
    const known = this._twins.get(original);
    const twin = known ?? stopButton("webmap-stop-twin", "", () => original.click());
    setText(twin, original.textContent ?? "");
    twin.dataset.robot = original.dataset.robot ?? "";
    const label = original.getAttribute("aria-label") ?? "";
    if (twin.ariaLabel !== label && label) twin.ariaLabel = label;
    if (!known) {
      this._twins.set(original, twin);
      this.element.append(twin);
    }
    return twin;
  }
}

/**
 * @param {Element} element
 * @returns {element is HTMLButtonElement} Whether the element's middle is on the
 *     screen.
 */
function isInSight(element) {
  if (!(element instanceof HTMLButtonElement)) return false;
  const { left, top, width, height } = element.getBoundingClientRect();
  const [x, y] = [left + width / 2, top + height / 2];
  return width > 0 && x > 0 && x < innerWidth && y > 0 && y < innerHeight;
}
