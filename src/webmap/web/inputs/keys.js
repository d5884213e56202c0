import { attentive } from "./focus.js";

/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('../motion/inputs.js').Axes} Axes */

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

/** The letters and names of the driving keys, for keyboards that do not report positions. */
const DRIVING_KEYS = /^([wasd]|Arrow(Up|Down|Left|Right))$/i;

/** @param {KeyboardEvent} event On-screen keyboards and remote desktops have no `code`. */
function isEscape({ code, key }) {
  return code === "Escape" || key === "Escape" || key === "Esc";
}

/** @param {KeyboardEvent} event Some layouts have other spaces, with Shift for example. */
function isSpace({ code, key }) {
  return code === "Space" || key === "Spacebar" || /^\s$/.test(key);
}

/** @param {KeyboardEvent} event */
function isShortcut({ ctrlKey, altKey, metaKey }) {
  return ctrlKey || altKey || metaKey;
}

/**
 * @typedef {object} StopKey
 * @property {boolean} escape Whether it is Escape, else it is Space.
 * @property {boolean} byTab Whether the Tab key was pressed since the last press of a
 *     pointer: the keyboard has moved the focus to where it is.
 */

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
    const known = Object.hasOwn(meaning, code) ? meaning[code] : {};
    const { x = 0, y = 0, turn = 0 } = known;
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
   * @param {(event: KeyboardEvent, how: StopKey) => boolean} owner.stop Called for a
   *     STOP key; returns whether it used the key.
   * @param {(event: KeyboardEvent) => boolean} [owner.used] Called for any other key;
   *     returns whether a tool used the key, which then drives nothing.
   */
  constructor(drive, owner) {
    this._drive = drive;
    this._owner = owner;
    /** @type {Set<string>} */
    this._held = new Set();
    this._byTab = false;
    /** Whether the last press of Space was used for STOP. */
    this._spaceUsed = true;
    /** Whether a driving key came without its position on the keyboard. */
    this.codeless = false;
    this._ending = new AbortController();
    const options = { capture: true, signal: this._ending.signal };
    window.addEventListener("pointerdown", () => (this._byTab = false), options);
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
    if (event.key === "Tab" && !isShortcut(event)) this._byTab = true;
    if (MODIFIERS.has(event.key)) {
      this._drive.goNeutral();
      return;
    }
    if (!this._held.has(event.code) && attentive() && this._owner.used?.(event)) {
      event.preventDefault();
      event.stopImmediatePropagation();
      return;
    }
    if (!event.code && DRIVING_KEYS.test(event.key) && this._listens(event)) {
      this.codeless = true;
    }
    if (!this._drives(event)) return;
    // Otherwise arrow keys scroll the page, also while they repeat.
    event.preventDefault();
    if (this._held.has(event.code)) return;
    this._held.add(event.code);
    this.codeless = false;
    // If the first event is a repetition, this page did not receive the press.
    this._send({ fresh: !event.repeat });
  }

  /** @param {KeyboardEvent} event */
  _up(event) {
    // On a Mac, keys that are released while Meta is held send no event. So after the
    // release of Meta too, the state of the other keys is unknown.
    if (event.key === "Meta" || event.key === "OS") this._drive.goNeutral();
    // Some browsers press a button when Space is released.
    if (isSpace(event) && this._spaceUsed) event.preventDefault();
    if (this._held.delete(event.code) || this._drive.status.frozen) this._send();
  }

  /** @param {KeyboardEvent} event */
  _isStop(event) {
    const escape = isEscape(event);
    if (!escape && !isSpace(event)) return false;
    if (event.repeat) {
      // Otherwise a held Space scrolls the page.
      if (!escape && this._spaceUsed) event.preventDefault();
      return true;
    }
    const byTab = this._byTab;
    const plain = !event.isComposing && !isShortcut(event);
    const used = plain && this._owner.stop(event, { escape, byTab });
    if (!escape) this._spaceUsed = used;
    if (used) event.preventDefault();
    return used;
  }

  /**
   * @param {KeyboardEvent} event
   * @returns {boolean} Whether the key drives a robot now.
   */
  _drives(event) {
    if (!this._listens(event)) return false;
    if (Object.hasOwn(MEANING, event.code)) return true;
    return this._owner.holonomic() && Object.hasOwn(SIDEWAYS, event.code);
  }

  /** @param {KeyboardEvent} event */
  _listens(event) {
    if (event.isComposing || isShortcut(event)) return false;
    return this._owner.wanted() && attentive();
  }

  /** @param {{fresh?: boolean}} [how] */
  _send(how) {
    const holonomic = this._owner.holonomic();
    this._drive.setInput("keys", axesOf(this._held, { holonomic }), how);
  }
}
