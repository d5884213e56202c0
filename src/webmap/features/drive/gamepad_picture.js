import { buttonName } from "../../web/inputs/pad_maps.js";
import { html, setAttribute, svg } from "../../web/tools/elements.js";

/** @typedef {import('../../web/inputs/pad_maps.js').Pad} Pad */
/** @typedef {import('../../web/inputs/pad_maps.js').PadMap} PadMap */

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
export class Picture {
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
    const words = this._standard ? [] : bars.map((y, i) => text(22, y + 3, `Axis ${i + 1}`));
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
      ...(short.length <= 2 && rx > 0 ? [text(x, y + 3, short)] : []),
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
function text(x, y, words) {
  return svg("text", { x: `${x}`, y: `${y}` }, document.createTextNode(words));
}
