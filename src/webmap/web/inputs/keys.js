import { attentive, takesKeys } from "../motion/attention.js";

/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('../motion/axes.js').Axes} Axes */

/**
 * The axes of each key, by position on the keyboard (`code`), for any layout.
 *
 * @type {Readonly<Record<string, Readonly<Partial<Axes>>>>}
 */
const MEANING = {
  KeyW: { x: 1 },
  ArrowUp: { x: 1 },
  KeyS: { x: -1 },
  ArrowDown: { x: -1 },
  KeyA: { turn: 1 },
  ArrowLeft: { turn: 1 },
  KeyD: { turn: -1 },
  ArrowRight: { turn: -1 },
};

/** More keys, for a base that can move sideways. */
const SIDEWAYS = { KeyQ: { y: 1 }, KeyE: { y: -1 } };

/** After a press of these keys, releases of others may be lost: shortcuts, other windows. */
const MODIFIERS = new Set(["Control", "Alt", "AltGraph", "Meta", "OS"]);

/**
 * @param {Iterable<string>} codes The keys that are held.
 * @param {{holonomic?: boolean}} [options]
 * @returns {Axes} Their common axes; opposite keys cancel each other.
 */
export function axesOf(codes, { holonomic = false } = {}) {
  /** @type {Record<string, Partial<Axes>>} */
  const meaning = holonomic ? { ...MEANING, ...SIDEWAYS } : MEANING;
  const axes = { x: 0, y: 0, turn: 0 };
  for (const code of codes) {
    const {
      x = 0,
      y = 0,
      turn = 0,
    } = Object.hasOwn(meaning, code) ? meaning[code] : {};
    axes.x += x;
    axes.y += y;
    axes.turn += turn;
  }
  // W and the up arrow together are not faster than one of them.
  return { x: Math.sign(axes.x), y: Math.sign(axes.y), turn: Math.sign(axes.turn) };
}

/**
 * The keyboard as a drive input, and its STOP keys.
 *
 * It listens on the window, before all other listeners, because a STOP must not depend on
 * the focus.
 */
export class Keys {
  /**
   * @param {Drive} drive
   * @param {object} owner
   * @param {() => boolean} owner.wanted Whether there is a robot to drive.
   * @param {() => boolean} owner.holonomic Whether it can move sideways.
   * @param {(all: boolean, event: KeyboardEvent) => boolean} owner.stop Called for a
   *     STOP key; returns whether it used the key.
   * @param {(event: KeyboardEvent) => boolean} [owner.used] Called for any other key;
   *     returns whether a tool used the key, which then drives nothing.
   */
  constructor(drive, owner) {
    this._drive = drive;
    this._owner = owner;
    /** @type {Set<string>} */
    this._held = new Set();
    this._ending = new AbortController();
    const options = { capture: true, signal: this._ending.signal };
    window.addEventListener("keydown", (event) => this._down(event), options);
    window.addEventListener("keyup", (event) => this._up(event), options);
    this._off = drive.on("drop", () => this._held.clear());
  }

  /** Stop listening and go neutral. */
  destroy() {
    this._ending.abort();
    this._off();
    this._drive.setInput("keys", null);
  }

  /** @param {KeyboardEvent} event */
  _down(event) {
    if (this._isStop(event)) return;
    if (MODIFIERS.has(event.key)) {
      this._drive.goNeutral();
      return;
    }
    if (!this._held.has(event.code) && attentive() && this._owner.used?.(event)) {
      event.preventDefault();
      event.stopImmediatePropagation();
      return;
    }
    if (!this._drives(event)) return;
    // Otherwise arrow keys scroll the page, also while they repeat.
    event.preventDefault();
    if (this._held.has(event.code)) return;
    this._held.add(event.code);
    // If the first event is a repetition, this page did not receive the press.
    this._send({ fresh: !event.repeat });
  }

  /** @param {KeyboardEvent} event */
  _up(event) {
    // On a Mac, keys that are released while Meta is held send no event. So after the
    // release of Meta too, the state of the other keys is unknown.
    if (event.key === "Meta" || event.key === "OS") this._drive.goNeutral();
    if (this._held.delete(event.code)) this._send();
  }

  /** @param {KeyboardEvent} event */
  _isStop(event) {
    const escape = event.code === "Escape";
    if (!escape && event.code !== "Space") return false;
    if (event.isComposing || event.ctrlKey || event.altKey || event.metaKey) {
      return false;
    }
    if (!escape && takesKeys(event.target)) return false;
    if (event.repeat) {
      // Otherwise a held Space scrolls the page.
      if (!escape) event.preventDefault();
      return true;
    }
    if (!this._owner.stop(escape && event.shiftKey, event)) return false;
    event.preventDefault();
    return true;
  }

  /**
   * @param {KeyboardEvent} event
   * @returns {boolean} Whether the key drives a robot now.
   */
  _drives(event) {
    if (event.isComposing || event.ctrlKey || event.altKey || event.metaKey) {
      return false;
    }
    if (!this._owner.wanted() || !attentive()) return false;
    if (Object.hasOwn(MEANING, event.code)) return true;
    return this._owner.holonomic() && Object.hasOwn(SIDEWAYS, event.code);
  }

  /** @param {{fresh?: boolean}} [how] */
  _send(how) {
    const holonomic = this._owner.holonomic();
    this._drive.setInput("keys", axesOf(this._held, { holonomic }), how);
  }
}
