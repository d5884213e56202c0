import { devicesOf } from "../../web/inputs/devices.js";
import { listed } from "../../web/inputs/gamepads.js";
import {
  Finder,
  ZONES,
  assign,
  axesOfPad,
  axisName,
  buttonName,
  isComplete,
  nameOf,
} from "../../web/inputs/pad_maps.js";
import { button, html, setAttribute, setHidden, setText, svg } from "../../web/tools/elements.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/motion/inputs.js').Axes} Axes */
/** @typedef {import('../../web/inputs/pad_maps.js').Pad} Pad */
/** @typedef {import('../../web/inputs/pad_maps.js').PadMap} PadMap */
/** @typedef {import('../../web/inputs/pad_maps.js').AxisAction} AxisAction */
/** @typedef {import('../../web/inputs/pad_maps.js').ButtonAction} ButtonAction */
/** @typedef {AxisAction | ButtonAction} Action */

const NAME = "Gamepad settings";

const NOTHING = "No gamepad is connected. Connect one and press a button of the gamepad.";
const READY = "Here no input moves a robot. STOP works, also by the gamepad, and closes this.";
const MISSING =
  "This gamepad has no standard layout. Assign forward, turn, the button to hold, and STOP.";

/**
 * What each action does, also on a base that moves sideways, and how it is assigned.
 *
 * @type {Readonly<Record<Action, [usual: string, sideways: string, how: string]>>}
 */
const ACTIONS = {
  ahead: ["Forward, back", "Forward, back", "Push a stick forward, then let it go."],
  side: ["Turn", "Sideways", "Push a stick to the left, then let it go."],
  spin: ["", "Turn", "Push a stick to the left, then let it go."],
  hold: ["Hold to drive", "Hold to drive", "Press the button that is held to drive."],
  stop: ["STOP", "STOP", "Press the button for STOP."],
};

/** The settings of gamepads: a dialog that is not modal, because STOP must work. */
export class GamepadPanel {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    this._devices = devicesOf(map.drive);
    this._maps = this._devices.padMaps;
    /** @type {Pad | null} */
    this._pad = null;
    /** @type {Picture | null} */
    this._picture = null;
    /** The action that is being assigned. @type {{action: Action, finder: Finder} | null} */
    this._assigning = null;
    this._title = html("h2", "");
    this._say = html("p", "webmap-gamepad-say", { role: "status" });
    this._place = html("div", "");
    const actions = /** @type {Action[]} */ (Object.keys(ACTIONS));
    this._rows = new Map(actions.map((each) => [each, new Row(() => this._assign(each))]));
    const { least, most } = ZONES;
    const range = { type: "range", min: `${least}`, max: `${most}`, step: "0.01" };
    this._zone = html("input", "", range);
    this._share = html("span", "value");
    this._zone.addEventListener("input", () => this._set({ zone: Number(this._zone.value) }));
    const rows = [...this._rows.values()].map(({ element }) => element);
    const zone = html("label", "", {}, "Dead zone", this._zone, this._share);
    const close = button("", "Close", () => this._dialog.close());
    const restore = button("", "Restore defaults", () => this._restore());
    this._dialog = html(
      "dialog",
      // On the console's page it has the form and the place of the help.
      "webmap-panel webmap-gamepad help",
      { "aria-label": NAME, "data-hands-off": "", "data-webmap-menu": "" },
      html("div", "webmap-gamepad-head", {}, this._title, close),
      this._say,
      html(
        "div",
        "webmap-gamepad-parts",
        {},
        html("div", "", {}, this._place, zone),
        html("div", "", {}, html("ul", "", {}, ...rows), restore),
      ),
    );
    this._dialog.addEventListener("close", () => this._dialog.remove());
    this._off = map.drive.on("stop", () => this._dialog.close());
  }

  destroy() {
    this._off();
    this._dialog.remove();
  }

  open() {
    if (this._dialog.open) return;
    this._map.drive.goNeutral();
    this._devices.pads?.hideHint();
    document.body.append(this._dialog);
    this._dialog.show();
    this._pad = null;
    this._assigning = null;
    this._draw();
  }

  _draw() {
    if (!this._dialog.open) return;
    requestAnimationFrame(() => this._draw());
    this._choose();
    const pad = this._pad;
    setHidden(this._place, pad === null);
    for (const { element } of this._rows.values()) setHidden(element, pad === null);
    setText(this._title, pad ? nameOf(pad) : "Gamepad");
    if (pad === null) {
      setText(this._say, NOTHING);
      return;
    }
    this._find(pad);
    this._show(pad);
  }

  /** Show the gamepad whose button is pressed, or the one that was shown. */
  _choose() {
    const pads = listed().filter((pad) => pad?.connected);
    const same = pads.find((pad) => pad && this._pad && isSame(pad, this._pad));
    const used = pads.find((pad) => pad?.buttons.some(({ pressed }) => pressed));
    const current = this._devices.pads?.current;
    const first = pads.find((pad) => pad && current && isSame(pad, current)) ?? pads[0];
    const pad = (this._assigning ? same : (used ?? same)) ?? first ?? null;
    if (!pad || !this._pad || !isSame(pad, this._pad)) {
      this._assigning = null;
      this._picture = pad ? new Picture(pad) : null;
      this._place.replaceChildren(...(this._picture ? [this._picture.element] : []));
      this._zone.value = pad ? `${this._maps.of(pad).zone}` : "";
      if (pad) this._rest(pad);
    }
    this._pad = pad;
  }

  /** @param {Action} action */
  _assign(action) {
    if (this._assigning?.action === action) {
      this._assigning = null;
      if (this._pad) this._rest(this._pad);
      return;
    }
    const kind = action === "hold" || action === "stop" ? "button" : "axis";
    const finder = new Finder(kind);
    // What is held or pushed now is not meant.
    if (this._pad) finder.read(this._pad, performance.now());
    this._assigning = { action, finder };
    setText(this._say, ACTIONS[action][2]);
  }

  /** @param {Pad} pad Look for the button or the axis that is being assigned. */
  _find(pad) {
    if (this._assigning === null) return;
    const { action, finder } = this._assigning;
    const found = finder.read(pad, performance.now());
    if (found === null) return;
    const map = assign(this._maps.of(pad), action, found);
    this._assigning = null;
    if (map) this._set(map);
    this._rest(pad);
  }

  /** @param {Pad} pad Show what is missing, while nothing is being assigned. */
  _rest(pad) {
    setText(this._say, isComplete(this._maps.of(pad)) ? READY : MISSING);
  }

  /** @param {Partial<import('../../web/inputs/pad_maps.js').PadMap>} change */
  _set(change) {
    if (this._pad) this._maps.keep(this._pad, { ...this._maps.of(this._pad), ...change });
  }

  _restore() {
    if (!this._pad) return;
    this._assigning = null;
    this._maps.restore(this._pad);
    this._zone.value = `${this._maps.of(this._pad).zone}`;
    this._rest(this._pad);
  }

  /** @param {Pad} pad */
  _show(pad) {
    const map = this._maps.of(pad);
    const holonomic = this._devices.active?.holonomic ?? false;
    this._picture?.show(pad, map);
    setText(this._share, `${Math.round(100 * map.zone)} %`);
    const { x, y, turn } = axesOfPad(pad, map, holonomic);
    const values = { ahead: x, side: holonomic ? y : turn, spin: turn };
    const assigning = this._assigning?.action;
    for (const [action, row] of this._rows) {
      setHidden(row.element, action === "spin" && !holonomic);
      const name = ACTIONS[action][holonomic ? 1 : 0];
      if (action === "hold" || action === "stop") {
        const pressed = pad.buttons[map[action] ?? -1]?.pressed === true;
        row.show(name, buttonName(pad, map[action]), pressed ? "pressed" : "");
      } else row.show(name, axisName(pad, map[action]), percent(values[action]));
      row.mark(assigning === action);
    }
  }
}

/** One action: its name, what it is assigned to, its value, and a button. */
class Row {
  /** @param {() => void} change */
  constructor(change) {
    this._name = html("span", "");
    this._by = html("span", "by");
    this._value = html("span", "value");
    this._change = button("", "Change", change);
    const parts = [this._name, this._by, this._value, this._change];
    this.element = html("li", "", {}, ...parts);
  }

  /**
   * @param {string} name
   * @param {string} by
   * @param {string} value
   */
  show(name, by, value) {
    setText(this._name, name);
    setText(this._by, by);
    setText(this._value, value);
  }

  /** @param {boolean} assigning */
  mark(assigning) {
    setText(this._change, assigning ? "Cancel" : "Change");
    const { textContent } = this._change;
    this._change.setAttribute("aria-label", `${textContent}: ${this._name.textContent}`);
  }
}

/**
 * @param {Pad} one
 * @param {Pad} other
 */
function isSame(one, other) {
  return one.index === other.index && one.id === other.id;
}

/** @param {number} value */
function percent(value) {
  return `${Math.round(100 * value)} %`;
}

/** The outline of a gamepad, in a box of 200 by 124. */
const BODY =
  "M58 26h84c24 0 36 16 42 44 5 26 3 44-9 46-11 2-19-6-29-14H54c-10 8-18 16-29 14" +
  "-12-2-14-20-9-46 6-28 18-44 42-44z";

/** The two sticks, and how far each moves. */
const STICKS = [
  { x: 56, y: 54 },
  { x: 123, y: 80 },
];
const REACH = 15;

/** The middle and half of the size of each button of the standard mapping. */
const BUTTONS = [
  ...[[146, 66, 6.5, 6.5], [159, 53, 6.5, 6.5], [133, 53, 6.5, 6.5], [146, 40, 6.5, 6.5]],
  ...[[50, 19, 17, 5.5], [150, 19, 17, 5.5], [50, 6.5, 12, 5.5], [150, 6.5, 12, 5.5]],
  ...[[88, 46, 4.5, 3.5], [112, 46, 4.5, 3.5]],
  ...STICKS.map(({ x, y }) => [x, y, REACH + 3, REACH + 3]),
  ...[[77, 71, 4.5, 4.5], [77, 89, 4.5, 4.5], [68, 80, 4.5, 4.5], [86, 80, 4.5, 4.5]],
  [100, 34, 5, 5],
];

/** Buttons in a row of a gamepad without the standard mapping, and their distance. */
const IN_ROW = 10;
const STEP = 20;

/** A live picture of a gamepad: buttons light up, sticks or axes move. */
class Picture {
  /** @param {Pad} pad */
  constructor(pad) {
    this._standard = pad.mapping === "standard";
    const rows = Math.ceil(pad.buttons.length / IN_ROW);
    const bars = pad.axes.map((_, i) => rows * STEP + 8 + i * 14);
    const height = this._standard ? 124 : (bars.at(-1) ?? rows * STEP) + 10;
    /** @type {Element[]} */
    this._buttons = [];
    /** The parts below each knob, with its dead zone. */
    this._zones = this._standard ? STICKS.map(ofStick) : bars.map(ofBar);
    this._knobs = this._zones.map(() => svg("circle", { class: "knob", r: "5" }));
    this._bars = bars;
    const parts = pad.buttons.map((_, i) => this._button(pad, i));
    const body = this._standard ? [svg("path", { class: "body", d: BODY })] : [];
    const marks = this._zones.flatMap((zone, i) => [...zone, this._knobs[i]]);
    const words = this._standard ? [] : bars.map((y, i) => label(22, y + 3, `Axis ${i + 1}`));
    const drawing = svg(
      "svg",
      { viewBox: `0 0 200 ${height}`, role: "img", "aria-label": "The gamepad now" },
      ...[...body, ...parts, ...marks, ...words],
    );
    this.element = html("div", "webmap-gamepad-picture", {}, drawing);
  }

  /**
   * @param {Pad} pad
   * @param {PadMap} map
   */
  show({ axes, buttons }, { hold, stop, zone }) {
    this._buttons.forEach((part, i) => {
      part.classList.toggle("on", buttons[i]?.pressed === true);
      part.classList.toggle("hold", i === hold);
      part.classList.toggle("stop", i === stop);
    });
    const value = (/** @type {number} */ i) => Math.max(-1, Math.min(1, axes[i] ?? 0));
    this._knobs.forEach((knob, i) => {
      const { x, y } = this._standard
        ? { x: STICKS[i].x + REACH * value(2 * i), y: STICKS[i].y + REACH * value(2 * i + 1) }
        : { x: BAR.x + BAR.reach * value(i), y: this._bars[i] };
      setAttribute(knob, "cx", x.toFixed(1));
      setAttribute(knob, "cy", y.toFixed(1));
    });
    const reach = this._standard ? REACH : BAR.reach;
    for (const part of this._zones.flat()) {
      if (part.matches(".bar")) continue;
      setAttribute(part, "stroke-width", (2 * reach * zone).toFixed(1));
    }
  }

  /**
   * @param {Pad} pad
   * @param {number} i
   */
  _button(pad, i) {
    const row = Math.floor(i / IN_ROW);
    const grid = [10 + (i % IN_ROW) * STEP, 10 + row * STEP, 8, 8];
    const [x, y, rx, ry] = (this._standard ? BUTTONS[i] : grid) ?? [0, 0, 0, 0];
    const name = buttonName(pad, i);
    const short = this._standard ? name : `${i + 1}`;
    const part = svg(
      "g",
      { class: "button" },
      svg("ellipse", { cx: `${x}`, cy: `${y}`, rx: `${rx}`, ry: `${ry}` }),
      ...(short.length <= 2 && rx > 0 ? [label(x, y + 3, short)] : []),
    );
    this._buttons.push(part);
    return part;
  }
}

/** The bar of an axis: its middle, and how far its mark moves. */
const BAR = { x: 120, reach: 70 };

/**
 * The dead zone of each axis of a stick is a band, so that straight ahead is straight.
 *
 * @param {{x: number, y: number}} stick
 */
function ofStick({ x, y }) {
  const end = 0.9 * REACH;
  return [band(x - end, y, x + end, y), band(x, y - end, x, y + end)];
}

/** @param {number} y */
function ofBar(y) {
  const { x, reach } = BAR;
  const line = { x: `${x - reach}`, y: `${y - 3}`, width: `${2 * reach}`, height: "6" };
  return [svg("rect", { class: "bar", ...line }), band(x, y - 3, x, y + 3)];
}

/**
 * @param {number} x1
 * @param {number} y1
 * @param {number} x2
 * @param {number} y2
 */
function band(x1, y1, x2, y2) {
  return svg("path", { class: "zone", d: `M${x1} ${y1}L${x2} ${y2}` });
}

/**
 * @param {number} x
 * @param {number} y
 * @param {string} words
 */
function label(x, y, words) {
  return svg("text", { x: `${x}`, y: `${y}` }, document.createTextNode(words));
}
