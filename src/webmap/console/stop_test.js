/** @typedef {import('./console.js').Drive} Drive */
/** @typedef {import('./console.js').Report} Report */

/** A second press that comes sooner is the other half of a double click; ms. */
const SOONEST = 400;

/** After this long the first press is forgotten; ms. */
const LATEST = 4000;

/**
 * The button that lets a robot creep and then be silent, to see whether it stops by
 * itself. As it moves the robot it wants a lease, and a second, deliberate press.
 */
export class StopTestButton {
  /** @param {Drive} drive */
  constructor(drive) {
    this._drive = drive;
    /** @type {{robot: string, at: number} | null} */
    this._first = null;
  }

  /**
   * Say what a press would do.
   *
   * @param {string | null} robot The one that is selected.
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
