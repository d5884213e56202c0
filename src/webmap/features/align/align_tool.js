import { devicesOf } from "../../web/inputs/devices.js";
import { unapply } from "../../web/view.js";
import { AlignDrawing, moved, rounded, turned } from "./align_drawing.js";
import { AlignPanel } from "./align_panel.js";
import { ARROWS } from "../../web/tools/aim.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { claimPresses } from "../../web/tools/tool.js";

/** @typedef {import('../../web/view.js').Point} Point */
/** @typedef {import('./align_drawing.js').Alignment} Alignment */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {(message: object) => void} Send */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

/**
 * What the display offers to align.
 *
 * @typedef {object} Subject
 * @property {string} robot
 * @property {string} name
 * @property {string} bridge
 * @property {string} mark `data-bridge` of the bridge's layers.
 * @property {string[]} together The robots that are aligned with the bridge.
 * @property {boolean} whole Whether everything of the bridge is aligned together at
 *     present.
 * @property {[number, number, number]} own
 * @property {[number, number, number]} common
 */

/** Step of a key in metres, and its rotation in degrees below; with Shift ten times. */
const KEY_MOVE = 0.05;
const KEY_TURN = 1;

/** Milliseconds between two updates of the robot's position. */
const FOLLOW_PERIOD = 200;

/**
 * Align the map of the selected robot, or of its whole bridge, with the common map.
 *
 * A drag on the map moves, the handle rotates about the robot, fields take numbers.
 * While the handle has the focus, arrow keys move and `q` and `e` rotate; Enter saves,
 * Escape cancels. The page shows a shadow at the new position: nothing moves before it
 * is saved.
 *
 * @param {MapCanvas} map
 * @param {object} _options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, _options, send) {
  return new AlignTool(map, send);
}

class AlignTool {
  /**
   * @param {MapCanvas} map
   * @param {Send} send
   */
  constructor(map, send) {
    this._map = map;
    this._send = send;
    /** @type {Subject | null} */
    this._subject = null;
    this._whole = false;
    /** @type {ReturnType<typeof setInterval> | undefined} */
    this._following = undefined;
    /** @type {Alignment} */
    this._before = { x: 0, y: 0, angle: 0 };
    this._now = this._before;
    /**
     * @type {{id: number, turns: boolean, from: Point, start: Alignment,
     *     about: Point} | null}
     */
    this._drag = null;
    this._panel = new AlignPanel({
      toggle: () => this._toggle(),
      choose: (whole) => this._choose(whole),
      type: (now) => this._set(now, false),
      save: () => this._save(),
      cancel: () => this._leave(),
    });
    this._drawing = new AlignDrawing(map);
    this._ending = new AbortController();
    this._listen();
    this.destroy = endOf(
      () => this._leave(),
      () => this._ending.abort(),
      lay(map, this._drawing.element),
      lay(map, this._panel.element, "top-left"),
      devicesOf(map.drive).claimEscape(() => this._leave()),
      map.onSelect(() => {
        this._leave();
        this._panel.close();
      }),
      map.onView(() => this._draw()),
    );
  }

  /** @param {any} message */
  receive(message) {
    if (message?.align) this._begin(message.align);
    if (typeof message?.refused === "string") this._panel.showMessage(message.refused);
    if (message?.saved) {
      this._leave();
      this._panel.tellSaved(message.saved);
    }
  }

  _listen() {
    const { signal } = this._ending;
    const { svg: root } = this._map;
    const { handle } = this._drawing;
    // Before all other listeners, so that a press during an alignment neither moves the
    // view nor selects a robot.
    const first = { signal, capture: true };
    root.addEventListener("pointerdown", (event) => this._down(event, false), first);
    handle.addEventListener("pointerdown", (event) => this._down(event, true), first);
    for (const target of [root, handle]) {
      target.addEventListener("pointermove", (event) => this._move(event), first);
      target.addEventListener("pointerup", (event) => this._up(event), first);
      target.addEventListener("pointercancel", () => this._giveUp(), first);
    }
    handle.addEventListener("keydown", (event) => this._key(event), { signal });
    const { element } = this._panel;
    element.addEventListener("keydown", (event) => this._escape(event), { signal });
  }

  _toggle() {
    if (this._subject) {
      this._leave();
      return;
    }
    const robot = this._map.selected;
    if (robot === null) this._panel.showMessage("Select a robot first.");
    else this._send({ begin: robot });
  }

  /** @param {Subject} subject */
  _begin(subject) {
    this._subject = subject;
    this._panel.open(subject);
    this._choose(subject.whole);
    claimPresses(this._map.svg, "align", true);
    this._drawing.handle.focus({ preventScroll: true });
    // The robot may move during the alignment.
    clearInterval(this._following);
    this._following = setInterval(() => this._draw(), FOLLOW_PERIOD);
  }

  /** @returns {boolean} Whether the tool was active. */
  _leave() {
    if (!this._subject) return false;
    this._subject = null;
    this._drag = null;
    clearInterval(this._following);
    this._panel.close();
    this._drawing.hide();
    claimPresses(this._map.svg, "align", false);
    return true;
  }

  /** @param {boolean} whole */
  _choose(whole) {
    const subject = this._subject;
    if (!subject) return;
    this._whole = whole;
    this._panel.choose(whole);
    const [x, y, angle] = whole ? subject.common : subject.own;
    this._before = { x, y, angle };
    this._drawing.show(whole ? subject.together : [subject.robot], whole ? subject.mark : null);
    this._set(this._before);
  }

  /**
   * @param {Alignment} now
   * @param {boolean} [fields] Whether to update the fields too.
   */
  _set(now, fields = true) {
    this._now = rounded(now);
    if (fields) this._panel.show(this._now);
    this._draw();
  }

  _save() {
    if (!this._subject) return;
    const { robot } = this._subject;
    this._panel.showMessage("Saving…");
    this._send({ save: { robot, whole: this._whole, ...this._now } });
  }

  _draw() {
    if (this._subject) this._drawing.draw(this._subject.robot, this._before, this._now);
  }

  // Pointer --------------------------------------------------------------------

  /**
   * @param {PointerEvent} event
   * @param {boolean} turns
   */
  _down(event, turns) {
    if (!this._subject) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    if (this._drag || event.button !== 0) return;
    const from = this._map.worldOf(event);
    const about = this._drawing.pivot ?? from;
    this._drag = { id: event.pointerId, turns, from, start: this._now, about };
    const target = turns ? this._drawing.handle : this._map.svg;
    target.setPointerCapture(event.pointerId);
    this._drawing.handle.focus({ preventScroll: true });
  }

  /** @param {PointerEvent} event */
  _move(event) {
    if (!this._subject) return;
    event.stopImmediatePropagation();
    const drag = this._drag;
    if (!drag || event.pointerId !== drag.id) return;
    const to = this._map.worldOf(event);
    if (drag.turns) {
      const degrees = bearing(drag.about, to) - bearing(drag.about, drag.from);
      this._set(turned(drag.start, degrees, drag.about));
    } else {
      this._set(moved(drag.start, to.x - drag.from.x, to.y - drag.from.y));
    }
  }

  /** @param {PointerEvent} event */
  _up(event) {
    if (!this._drag || event.pointerId !== this._drag.id) return;
    event.stopImmediatePropagation();
    this._map.suppressNextClick();
    this._drag = null;
  }

  /** The browser canceled the pointer: discard the drag. */
  _giveUp() {
    if (this._drag) this._set(this._drag.start);
    this._drag = null;
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    if (!this._subject || event.ctrlKey || event.altKey || event.metaKey) return;
    const times = event.shiftKey ? 10 : 1;
    const arrow = ARROWS[event.key];
    const turn = { q: 1, e: -1 }[event.key.toLowerCase()];
    if (arrow) {
      const [dx, dy] = alongWorld(this._map.view, arrow);
      this._set(moved(this._now, KEY_MOVE * times * dx, KEY_MOVE * times * dy));
    } else if (turn) {
      const about = this._drawing.pivot ?? this._now;
      this._set(turned(this._now, KEY_TURN * times * turn, about));
    } else if (event.key === "Enter") {
      this._save();
    } else {
      this._escape(event);
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {KeyboardEvent} event */
  _escape(event) {
    if (event.key === "Escape" && this._leave()) event.preventDefault();
  }
}

/**
 * @param {Point} from
 * @param {Point} to
 * @returns {number} Degrees, counter-clockwise from x.
 */
function bearing(from, to) {
  return (Math.atan2(to.y - from.y, to.x - from.x) * 180) / Math.PI;
}

/**
 * @param {import('../../web/view.js').Matrix} view
 * @param {[number, number]} arrow Right and down on the screen.
 * @returns {[number, number]} The same direction in the world, with a length of 1 m.
 */
function alongWorld(view, [right, down]) {
  const from = unapply(view, 0, 0);
  const to = unapply(view, right, down);
  const far = Math.hypot(to.x - from.x, to.y - from.y);
  return [(to.x - from.x) / far, (to.y - from.y) / far];
}
