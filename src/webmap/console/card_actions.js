import { byId, closeSheet } from "../web/tools/elements.js";

/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../web/drive.js').Drive} Drive */
/** @typedef {import('../web/motion/report.js').RobotReport} Report */

/**
 * Handle the buttons of the card that act at once. Only the stop test lets a robot
 * creep, and only a robot that this page has control of.
 *
 * @param {MapCanvas} map
 * @param {(message: Record<string, unknown>) => void} send
 * @param {AbortSignal} signal
 */
export function listenToActions(map, send, signal) {
  const test = new StopTestButton(map.drive);
  const show = () => {
    test.show(map.selected, performance.now());
    const button = document.querySelector("[data-act=follow]");
    const pressed = `${map.following !== 0}`;
    if (button?.getAttribute("aria-pressed") === pressed) return;
    button?.setAttribute("aria-pressed", pressed);
  };
  const act = (/** @type {MouseEvent} */ event) => {
    if (!(event.target instanceof Element) || map.selected === null) return;
    const button = event.target.closest("[data-act]");
    if (!(button instanceof HTMLElement)) return;
    if (["follow", "send", "locate"].includes(button.dataset.act ?? "")) closeSheet();
    if (button.dataset.act === "cancel") map.drive.cancel(map.selected);
    if (button.dataset.act === "release") map.drive.release(map.selected);
    if (button.dataset.act === "stop-test") test.press(map.selected, performance.now());
    if (button.dataset.act !== "follow") return show();
    if (map.following) map.follow(0);
    else send({ op: "follow" });
    show();
  };
  byId("card").addEventListener("click", act, { signal });
  const timer = setInterval(show, 250);
  const offs = [
    map.onView(show),
    map.drive.on("robot", ({ robot }) => robot === map.selected && show()),
    map.onSelect(() => {
      if (map.following) map.follow(0);
      show();
    }),
  ];
  return () => {
    clearInterval(timer);
    for (const off of offs) off();
  };
}

/** Milliseconds; an earlier second press belongs to a double click. */
const SOONEST = 400;

/** Milliseconds after which the first press is forgotten. */
const LATEST = 4000;

/**
 * The button of the stop test: it lets a robot creep, then ends all commands and
 * measures whether the base stops by itself. As the test moves the robot, it requires
 * control and a second, deliberate press.
 */
export class StopTestButton {
  /** @param {Drive} drive */
  constructor(drive) {
    this._drive = drive;
    /** @type {{robot: string, at: number} | null} */
    this._first = null;
  }

  /**
   * Show what a press would do.
   *
   * @param {string | null} robot The selected robot.
   * @param {number} now
   */
  show(robot, now) {
    const button = document.querySelector("[data-act=stop-test]");
    if (!(button instanceof HTMLButtonElement)) return;
    const state = this.state(robot, now);
    if (button.dataset.test !== state) button.dataset.test = state;
    const able = state === "ready" || state === "asking";
    if (button.disabled === able) button.disabled = !able;
  }

  /**
   * @param {string | null} robot
   * @param {number} now
   * @returns {"none" | "take" | "ready" | "asking" | "running"}
   */
  state(robot, now) {
    const report = robot === null ? undefined : this._drive.robots.get(robot);
    if (!report) return "none";
    if (report.test?.state === "creeping" || report.test?.state === "waiting") {
      return "running";
    }
    if (!report.mine) return "take";
    return this._waits(robot, now) ? "asking" : "ready";
  }

  /**
   * @param {string} robot
   * @param {number} now
   */
  press(robot, now) {
    if (!this._drive.robots.get(robot)?.mine) return;
    if (!this._waits(robot, now)) this._first = { robot, at: now };
    else if (this._first && now - this._first.at >= SOONEST) {
      this._first = null;
      this._drive.stopTest(robot);
    }
  }

  /**
   * @param {string | null} robot
   * @param {number} now
   * @returns {boolean} Whether a first press waits for the second.
   */
  _waits(robot, now) {
    return this._first?.robot === robot && now - this._first.at <= LATEST;
  }
}
