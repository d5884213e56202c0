/** Gamepads as a drive input; `pad_maps.js` has what their axes and buttons do. */

import { isLatched } from "../motion/report.js";
import { attentive } from "./focus.js";
import { PadMaps, axesOfPad, buttonName, controlsOf, isComplete, nameOf } from "./pad_maps.js";

/** @typedef {import('../motion/inputs.js').Axes} Axes */
/** @typedef {import('../motion/report.js').RobotReport} RobotReport */
/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('./pad_maps.js').Pad} Pad */
/** @typedef {import('./pad_maps.js').PadMap} PadMap */

/** A gamepad without a change for this time may be disconnected; ms. */
export const SILENT = 2000;

/** Milliseconds between two readings for STOP and the release: a press may be short. */
const QUICK = 15;

/** Why a gamepad does nothing yet; its name is before it. */
const NO_LAYOUT =
  "has no standard layout and cannot drive: open Gamepad settings and assign its sticks, " +
  "the button to hold, and STOP.";

/**
 * `held`, `stops`: whether the dead-man button and STOP's were held at the last reading.
 * `fresh`: whether the dead-man button was released since the gamepad is known.
 *
 * @typedef {object} State
 * @property {Pad} pad
 * @property {PadMap} map
 * @property {number} timestamp
 * @property {number} changedAt
 * @property {boolean} held
 * @property {boolean} fresh
 * @property {boolean} stops
 */

/**
 * Computes the axes of gamepads: neutral, unless a dead-man button is held.
 *
 * The button must have been released since the gamepad was connected, since its buttons
 * were assigned and since the last {@link Pads#drop}. Of several gamepads the one whose
 * button was pressed last drives; the others must release theirs. A gamepad that lost its
 * radio connection keeps its last state; so the button also has no effect when the gamepad
 * does not change for {@link SILENT} ms. Times are in milliseconds of one clock.
 */
export class Pads {
  /** @param {PadMaps} [maps] */
  constructor(maps = new PadMaps()) {
    this._maps = maps;
    /** @type {Map<string, State>} */
    this._known = new Map();
    /** Whether a dead-man button is held without effect. */
    this.spent = false;
    /** Whether a button of STOP was pressed since the last reading. */
    this.stopped = false;
    /** The key of the gamepad that drove last. */
    this._last = "";
  }

  /** Whether there is a gamepad, also one that cannot drive. */
  get seen() {
    return this._known.size > 0;
  }

  /** The gamepad that drives or drove last, or the first that can; null without one. */
  get current() {
    const able = [...this._known].filter(([, { map }]) => isComplete(map));
    const [, state = null] = able.find(([key]) => key === this._last) ?? able[0] ?? [];
    return state;
  }

  /** Why a connected gamepad cannot drive, in a sentence; empty if all can. */
  get refusal() {
    const unable = [...this._known.values()].find(({ map }) => !isComplete(map));
    return unable ? `Gamepad "${nameOf(unable.pad)}" ${NO_LAYOUT}` : "";
  }

  /**
   * @param {Iterable<Pad | null>} pads The browser's list.
   * @param {number} now
   * @param {{holonomic?: boolean}} [options]
   * @returns {Axes | null} null if no gamepad drives.
   */
  read(pads, now, { holonomic = false } = {}) {
    const seen = new Set();
    this.spent = false;
    this.stopped = false;
    for (const pad of pads) {
      if (!pad?.connected) continue;
      const key = `${pad.index} ${pad.id}`;
      seen.add(key);
      this._look(key, pad, now);
    }
    for (const key of this._known.keys()) if (!seen.has(key)) this._known.delete(key);
    const held = [...this._known.values()].filter((state) => state.held);
    const driving = held.find(({ fresh }) => fresh);
    this.spent = held.length > 0 && !driving;
    return driving ? axesOfPad(driving.pad, driving.map, holonomic) : null;
  }

  /** Buttons that are held now have no effect until they are released. */
  drop() {
    for (const state of this._known.values()) state.fresh = false;
  }

  /**
   * @param {string} key
   * @param {Pad} pad
   * @param {number} now
   */
  _look(key, pad, now) {
    const { timestamp } = pad;
    const map = this._maps.of(pad);
    let state = this._known.get(key);
    if (state?.map !== map) {
      // What is held now was not pressed for this.
      const begun = { held: true, fresh: false, stops: true };
      state = { pad, map, timestamp, changedAt: now, ...begun };
      this._known.set(key, state);
    }
    state.pad = pad;
    if (timestamp !== state.timestamp) Object.assign(state, { timestamp, changedAt: now });
    const stops = isHeld(pad, map.stop);
    if (stops && !state.stops) this.stopped = true;
    state.stops = stops;
    const held = isComplete(map) && isHeld(pad, map.hold);
    if (!held) state.fresh = true;
    else if (now - state.changedAt > SILENT) state.fresh = false;
    if (held && !state.held && state.fresh) this._giveTo(key);
    state.held = held;
  }

  /** @param {string} key The gamepad whose dead-man button was pressed last. */
  _giveTo(key) {
    this._last = key;
    for (const [other, state] of this._known) {
      if (other !== key && state.held) state.fresh = false;
    }
  }
}

/**
 * @param {Pad} pad
 * @param {number | null} button
 */
function isHeld({ buttons }, button) {
  return button !== null && buttons[button]?.pressed === true;
}

/**
 * Gamepads as a drive input. They have no events for their axes, so they are read at each
 * step, and when one is disconnected.
 */
export class Gamepads {
  /**
   * @param {Drive} drive
   * @param {object} owner
   * @param {PadMaps} owner.maps
   * @param {() => boolean} owner.wanted Whether there is a robot to drive.
   * @param {() => boolean} owner.holonomic Whether it can move sideways.
   * @param {() => void} owner.stopByPad Called when a button of STOP is pressed.
   * @param {() => (() => void) | null} owner.settings What opens the settings, if this page
   *     has them.
   */
  constructor(drive, owner) {
    this._drive = drive;
    this._owner = owner;
    this._pads = new Pads(owner.maps);
    /** What is shown, by kind. */
    this._texts = { refused: "", hint: "" };
    /** The gamepads whose hint this page has shown. */
    this._greeted = new Set();
    /** Whether STOP is active for each robot. @type {Map<string, boolean>} */
    this._latched = new Map();
    this._timer = 0;
    this._ending = new AbortController();
    const options = { signal: this._ending.signal };
    window.addEventListener("gamepaddisconnected", () => this._lost(), options);
    this._offs = [
      drive.on("read", () => this._read()),
      drive.on("drop", () => this._pads.drop()),
      drive.on("stop", (robot) => robot === "*" && vibrate()),
      drive.on("robot", (report) => this._report(report)),
    ];
  }

  /** Whether there is a gamepad, also one that cannot drive. */
  get seen() {
    return this._pads.seen;
  }

  /** The gamepad that drives or drove last, or the first that can; null without one. */
  get current() {
    return this._pads.current?.pad ?? null;
  }

  /** What is held and moved to drive with a gamepad; empty without one. */
  get controls() {
    const state = this._pads.current;
    return state ? controlsOf(state.pad, state.map) : "";
  }

  /** Whether a dead-man button is held without effect. */
  get spent() {
    return this._pads.spent;
  }

  /** Hide the hint of a gamepad. */
  hideHint() {
    this._show("hint", "");
  }

  /** Stop listening and go neutral. */
  destroy() {
    this._ending.abort();
    clearInterval(this._timer);
    for (const off of this._offs) off();
    this._drive.setInput("gamepad", null);
    this._show("refused", "");
    this.hideHint();
  }

  /** @param {boolean} [quick] Whether it is only for STOP and the release of a button. */
  _read(quick = false) {
    const holonomic = this._owner.holonomic();
    if (!attentive()) this._pads.drop();
    const axes = this._pads.read(listed(), performance.now(), { holonomic });
    // In another window the button may belong to another program.
    if (this._pads.stopped && (document.hasFocus() || this._drive.drives)) {
      this._owner.stopByPad();
    }
    if (quick && axes !== null) return;
    this._drive.setInput("gamepad", this._owner.wanted() ? axes : null);
    this._show("refused", this._pads.refusal);
    this._greet(axes !== null);
    if (!this.seen) {
      clearInterval(this._timer);
      this._timer = 0;
    } else this._timer ||= window.setInterval(() => this._read(true), QUICK);
  }

  /** @param {boolean} drives Whether the operator drives with a gamepad, and needs no hint. */
  _greet(drives) {
    const { current } = this._pads;
    if (!current || drives) this.hideHint();
    else if (this._owner.settings() && !this._greeted.has(current.pad.id)) {
      const { pad, map } = current;
      this._greeted.add(pad.id);
      const stop = `${buttonName(pad, map.stop)} is STOP`;
      const drive = `Hold ${controlsOf(pad, map, " and move ")} to drive. Release to stop. ${stop}.`;
      this._show("hint", `Gamepad connected: ${nameOf(pad)}. ${drive}`);
    }
  }

  /**
   * @param {"refused" | "hint"} kind
   * @param {string} text
   */
  _show(kind, text) {
    if (text === this._texts[kind]) return;
    this._texts[kind] = text;
    this._drive.showGamepad({ kind, text, settings: this._owner.settings() });
  }

  /** @param {RobotReport} report */
  _report(report) {
    const latched = isLatched(report);
    const was = this._latched.get(report.robot);
    this._latched.set(report.robot, latched);
    const begins = latched && was === false;
    if (begins && report.robot === this._drive.status.choice) vibrate();
  }

  /** A gamepad is gone; the browser's list may still contain it. */
  _lost() {
    this._pads.drop();
    this._drive.setInput("gamepad", null);
  }
}

/** @returns {(Pad | null)[]} The browser's list of gamepads. */
export function listed() {
  try {
    return [...(navigator.getGamepads?.() ?? [])];
  } catch {
    // A page in a frame may not have the permission.
    return [];
  }
}

/** Vibrate each gamepad that can, for a STOP. */
function vibrate() {
  for (const pad of /** @type {(Gamepad | null)[]} */ (listed())) {
    const effect = { duration: 300, strongMagnitude: 1, weakMagnitude: 1 };
    try {
      void pad?.vibrationActuator?.playEffect("dual-rumble", effect).catch(() => {});
    } catch {
      // A gamepad may have only another kind of vibration.
    }
  }
}
