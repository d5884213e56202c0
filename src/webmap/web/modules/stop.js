import { deskOf } from "../inputs/desk.js";
import { Obedience, Stopping } from "../motion/stopping.js";
import { button, html, say } from "./elements.js";
import { lay } from "./overlay.js";

/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../halves.js').Half} Half */
/** @typedef {import('../motion/stopping.js').Verdict} Verdict */

/**
 * A button that stops all robots, always in sight, and what became of every STOP.
 *
 * Also covers the page with an alarm when a robot moves on although it was given zero.
 * Space and Escape stop the robot that is driven or selected, Shift and Escape all,
 * whether or not the map has a `Teleop`.
 *
 * @param {MapCanvas} map
 * @returns {Half}
 */
export default function attach(map) {
  const stop = new Stop(map);
  return { destroy: () => stop.destroy() };
}

class Stop {
  /** @param {MapCanvas} map */
  constructor(map) {
    /** @type {Drive} */
    this._drive = map.drive;
    this._stopping = new Stopping();
    this._obedience = new Obedience();
    this._alarm = new Alarm(() => this._drive.stop("*"));
    this._verdicts = html("ul", "webmap-stop-verdicts", { role: "status" });
    this._close = button("webmap-stop-close", "Close", () => this._stopping.dismiss());
    const all = button("webmap-stop-button webmap-stop-all", "Stop all", () => {
      this._drive.stop("*");
    });
    all.title = "Key Shift and Escape";
    this._list = html("div", "webmap-stop-list", {}, this._verdicts, this._close);
    this._list.hidden = true;
    const panel = html(
      "section",
      "webmap-panel webmap-stop",
      { "aria-label": "Emergency stop" },
      all,
      this._list,
    );
    this._shown = "";
    const drive = this._drive;
    this._offs = [
      lay(map, panel, "top-right"),
      deskOf(drive).open(),
      drive.on("stop", (robot) => this._stopped(robot)),
      drive.on("robot", (report) => this._report(report)),
      drive.on("goal", (robot) => this._obedience.excuse(robot)),
      drive.on("gone", (robot) => this._gone(robot)),
      drive.on("step", () => this._show()),
    ];
  }

  destroy() {
    for (const off of this._offs) off();
    this._alarm.destroy();
  }

  /** @param {string} robot */
  _stopped(robot) {
    this._stopping.start(robot, this._drive.robots.keys(), performance.now());
    this._show();
  }

  /** @param {import('../motion/report.js').RobotReport} report */
  _report(report) {
    const now = performance.now();
    this._stopping.report(report, now);
    this._obedience.report(report, now);
  }

  /** @param {string} robot */
  _gone(robot) {
    this._stopping.gone(robot);
    this._obedience.excuse(robot);
  }

  _show() {
    const now = performance.now();
    const { robots, state } = this._drive;
    const connected = state === "open" || state === "late";
    this._alarm.show(this._obedience.disobeying(now).map(({ name }) => name));
    this._showVerdicts(this._stopping.verdicts(robots, connected, now));
  }

  /** @param {Verdict[]} verdicts */
  _showVerdicts(verdicts) {
    const shown = JSON.stringify(verdicts);
    if (shown === this._shown) return;
    this._shown = shown;
    this._list.hidden = verdicts.length === 0;
    this._verdicts.replaceChildren(
      ...verdicts.map(({ name, state, text }) => {
        const item = html("li", "webmap-stop-verdict", {}, `${name}: ${text}`);
        item.dataset.state = state;
        return item;
      }),
    );
  }
}

/** Covers the page: a robot does not do what it is told. */
class Alarm {
  /** @param {() => void} stopAll As the alarm covers the button that does. */
  constructor(stopAll) {
    this._names = html("p", "webmap-alarm-names");
    /** @type {Set<string>} */
    this._seen = new Set();
    /** @type {string[]} */
    this._current = [];
    this._element = html(
      "div",
      "webmap-alarm",
      { role: "alert" },
      html("p", "webmap-alarm-title", {}, "ROBOT NOT OBEYING"),
      html("p", "webmap-alarm-act", {}, "Use the hardware stop."),
      this._names,
      button("webmap-stop-button webmap-alarm-stop", "Stop all", stopAll),
      button("webmap-alarm-seen", "I have seen this", () => {
        this._seen = new Set(this._current);
        this.show(this._current);
      }),
    );
  }

  destroy() {
    this._element.remove();
  }

  /** @param {string[]} names */
  show(names) {
    this._current = names;
    for (const name of this._seen) if (!names.includes(name)) this._seen.delete(name);
    const news = names.filter((name) => !this._seen.has(name));
    say(this._names, news.join(", "));
    if (news.length === 0) this._element.remove();
    else if (!this._element.isConnected) document.body.append(this._element);
  }
}
