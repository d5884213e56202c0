/**
 * The docked list of robots with the card: its width, whether it is open, whether the
 * card shows more, and the buttons of the card that act at once. Width and state are a
 * part of the layout, and stored in the browser.
 */

import { readStored, store } from "../web/stored.js";
import { isTested } from "../web/motion/measurements.js";
import {
  byId,
  closeSheet,
  DoublePress,
  onBeat,
  setAttribute,
} from "../web/tools/elements.js";
import { endOf } from "../web/tools/overlay.js";

/** @typedef {import('../web/drive.js').Drive} Drive */
/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../web/motion/report.js').RobotReport} Report */

/** @typedef {{open: boolean, width: number, more: boolean}} Shown Width in pixels. */

/** The key of the state in this browser's storage. */
const KEPT = "webmap.panel";

/** Smallest, usual and greatest width in pixels, and the change for one arrow key. */
const NARROWEST = 240;
const USUAL = 296;
const WIDEST = 480;
const STEP = 16;

/** @type {Shown} */
const AT_FIRST = { open: true, width: USUAL, more: false };

/**
 * Open, close and resize the panel.
 *
 * @param {MapCanvas} map
 * @param {AbortSignal} signal
 * @returns {() => void} Leaves the layout.
 */
export function listenToPanel(map, signal) {
  const [edge, turn] = [byId("panel-edge"), byId("panel-turn")];
  let shown = kept();
  const show = (/** @type {Shown} */ next) => {
    const width = Math.round(Math.min(Math.max(next.width, NARROWEST), WIDEST));
    shown = { ...next, width };
    document.body.dataset.panel = shown.open ? "open" : "closed";
    if (width === USUAL) document.documentElement.style.removeProperty("--panel");
    else document.documentElement.style.setProperty("--panel", `${width}px`);
    turn.setAttribute("aria-expanded", `${shown.open}`);
    edge.setAttribute("aria-valuenow", `${width}`);
    const more = moreOfCard();
    if (more && more.open !== shown.more) more.open = shown.more;
  };
  const change = (/** @type {Partial<Shown>} */ part) => {
    show({ ...shown, ...part });
    store(KEPT, shown);
  };
  edge.setAttribute("aria-valuemin", `${NARROWEST}`);
  edge.setAttribute("aria-valuemax", `${WIDEST}`);
  // The card may have been unfolded before this module was loaded, and may come later.
  show({ ...shown, more: shown.more || moreOfCard()?.open === true });
  const off = map.onSelect(() => show(shown));
  const folded = (/** @type {Event} */ { target }) => {
    if (target === moreOfCard()) change({ more: moreOfCard()?.open });
  };
  byId("card").addEventListener("toggle", folded, { signal, capture: true });
  turn.addEventListener("click", () => change({ open: !shown.open }), { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    const by = { ArrowLeft: -STEP, ArrowRight: STEP }[event.key];
    if (by === undefined) return;
    // The arrow keys drive the robot everywhere else.
    event.preventDefault();
    event.stopPropagation();
    change({ width: shown.width + by });
  };
  edge.addEventListener("keydown", key, { signal });
  listenToEdge(edge, (x) => change({ width: x }), signal);
  edge.addEventListener("dblclick", () => change({ width: USUAL }), { signal });
  const leave = map.layout.add("panel", {
    read: () => shown,
    write: change,
    reset: () => change(AT_FIRST),
  });
  return () => {
    off();
    leave();
  };
}

/**
 * @param {HTMLElement} edge
 * @param {(x: number) => void} moved Called with the pointer's place in the window.
 * @param {AbortSignal} signal
 */
function listenToEdge(edge, moved, signal) {
  const down = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0) return;
    event.preventDefault();
    edge.setPointerCapture(event.pointerId);
    edge.classList.add("dragged");
  };
  const move = (/** @type {PointerEvent} */ event) => {
    if (edge.classList.contains("dragged")) moved(event.clientX);
  };
  const up = () => edge.classList.remove("dragged");
  edge.addEventListener("pointerdown", down, { signal });
  edge.addEventListener("pointermove", move, { signal });
  edge.addEventListener("pointerup", up, { signal });
  edge.addEventListener("pointercancel", up, { signal });
}

/** @returns {HTMLDetailsElement | null} */
function moreOfCard() {
  return document.querySelector("#card > details.more");
}

/** @returns {Shown} */
function kept() {
  const { open, width, more } = readStored(KEPT) ?? AT_FIRST;
  return {
    open: open !== false,
    width: Number.isFinite(width) ? width : USUAL,
    more: more === true,
  };
}

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
    if (button) setAttribute(button, "aria-pressed", `${map.following !== 0}`);
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
  return endOf(
    onBeat(show),
    map.onView(show),
    map.drive.on("robot", ({ robot }) => robot === map.selected && show()),
    map.onSelect(() => {
      if (map.following) map.follow(0);
      show();
    }),
  );
}

/**
 * The button of the stop test: it lets a robot creep, then ends all commands and
 * measures whether the base stops by itself. As the test moves the robot, it requires
 * control and a second, deliberate press.
 */
export class StopTestButton {
  /** @param {Drive} drive */
  constructor(drive) {
    this._drive = drive;
    this._presses = new DoublePress();
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
    if (isTested(report)) return "running";
    if (!report.mine) return "take";
    return this._waits(report.robot, now) ? "asking" : "ready";
  }

  /**
   * @param {string} robot
   * @param {number} now
   */
  press(robot, now) {
    if (!this._drive.robots.get(robot)?.mine) return;
    this._presses.look([robot]);
    if (this._presses.press(now, [robot])) this._drive.stopTest(robot);
  }

  /**
   * @param {string} robot
   * @param {number} now
   * @returns {boolean} Whether a first press waits for the second.
   */
  _waits(robot, now) {
    return this._presses.meant.includes(robot) && this._presses.waiting(now);
  }
}
