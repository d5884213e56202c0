import { attentive, takesKeys } from "../motion/attention.js";

/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('../motion/axes.js').Axes} Axes */

/**
 * What each key asks for. By place on the keyboard (`code`), so that any layout works.
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

/** What they ask for besides, on a base that can move sideways. */
const SIDEWAYS = { KeyQ: { y: 1 }, KeyE: { y: -1 } };

/** Keys whose press makes the others' releases doubtful: shortcuts, window switches. */
const MODIFIERS = new Set(["Control", "Alt", "AltGraph", "Meta", "OS"]);

/**
 * @param {Iterable<string>} codes The keys that are held.
 * @param {{holonomic?: boolean}} [options]
 * @returns {Axes} What they ask for together; opposite ones cancel each other.
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
 * It listens on the whole window, before anybody else, as a STOP must not depend on
 * which element has the focus.
 */
export class Keys {
  /**
   * @param {Drive} drive
   * @param {object} owner
   * @param {() => boolean} owner.wanted Whether there is a robot that keys could drive.
   * @param {() => boolean} owner.holonomic Whether it can move sideways.
   * @param {(all: boolean, event: KeyboardEvent) => boolean} owner.stop Called for a
   *     STOP key; returns whether it was one.
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

  /** Stop listening, neutral. */
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
    if (!this._drives(event)) return;
    // Arrow keys scroll the page otherwise, also while they repeat.
    event.preventDefault();
    if (this._held.has(event.code)) return;
    this._held.add(event.code);
    // The first event of a key is a repetition if this page did not hear the press.
    this._tell({ fresh: !event.repeat });
  }

  /** @param {KeyboardEvent} event */
  _up(event) {
    // A key that is let go of while Meta is held says nothing on a Mac, and which
    // others did is unknown: a Meta that goes up is as doubtful as one going down.
    if (event.key === "Meta" || event.key === "OS") this._drive.goNeutral();
    if (this._held.delete(event.code)) this._tell();
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
      // Held on, Space would scroll the page.
      if (!escape) event.preventDefault();
      return true;
    }
    if (!this._owner.stop(escape && event.shiftKey, event)) return false;
    event.preventDefault();
    return true;
  }

  /**
   * @param {KeyboardEvent} event
   * @returns {boolean} Whether the key is one to drive with, here and now.
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
  _tell(how) {
    const holonomic = this._owner.holonomic();
    this._drive.setInput("keys", axesOf(this._held, { holonomic }), how);
  }
}
