import { button, html, setHidden, setText } from "../../web/tools/elements.js";
import { tool, toolName } from "../../web/tools/tool.js";

/** @typedef {import('./align_drawing.js').Alignment} Alignment */
/** @typedef {import('./align_tool.js').Subject} Subject */

/**
 * Callbacks of the panel.
 *
 * @typedef {object} AlignActions
 * @property {() => void} toggle
 * @property {(whole: boolean) => void} choose Whether everything of the bridge is
 *     aligned.
 * @property {(now: Alignment) => void} type Called when numbers were typed.
 * @property {() => void} save
 * @property {() => void} cancel
 */

/** @typedef {'x' | 'y' | 'angle'} Field */

/** @type {readonly [Field, string, string][]} */
const FIELDS = [
  ["x", "x in m", "0.01"],
  ["y", "y in m", "0.01"],
  ["angle", "angle in °", "0.1"],
];

/** The button that begins an alignment, and its text and fields. */
export class AlignPanel {
  /** @param {AlignActions} actions */
  constructor(actions) {
    this._actions = actions;
    this._go = button("webmap-align-go", "", () => actions.toggle());
    this._go.append(...toolName("align", "Align maps"));
    this._go.title = "Align maps";
    this._what = html("select", "webmap-align-what", { "aria-label": "What to align" });
    this._what.addEventListener("change", () => actions.choose(this._what.value === "whole"));
    /** @type {Map<Field, HTMLInputElement>} */
    this._inputs = new Map();
    const fields = FIELDS.map(([name, label, step]) => this._field(name, label, step));
    this._body = html(
      "form",
      "webmap-align-body",
      { hidden: "" },
      this._what,
      html("div", "webmap-align-fields", {}, ...fields),
      html(
        "p",
        "webmap-muted webmap-align-hint",
        {},
        "Drag the map to move its content, drag the round handle to turn it. Or use the arrow keys, q and e.",
      ),
      html(
        "div",
        "webmap-row webmap-align-ends",
        {},
        html("button", "webmap-button webmap-align-save", { type: "submit" }, "Save"),
        button("webmap-align-cancel", "Cancel", () => actions.cancel()),
      ),
    );
    this._body.addEventListener("submit", (event) => {
      event.preventDefault();
      actions.save();
    });
    this._message = html("span", "webmap-align-word", { role: "status" });
    this._line = html("code", "webmap-align-line", { hidden: "" });
    const content = [this._body, this._message, this._line];
    this.element = tool("webmap-align", "Alignment", this._go, ...content);
  }

  /** @param {string} text */
  showMessage(text) {
    setText(this._message, text);
    this._line.toggleAttribute("hidden", true);
  }

  /** @param {Subject} subject */
  open({ name, bridge, together }) {
    const number = together.length;
    const all = `All of ${bridge} (${number} robot${number === 1 ? "" : "s"})`;
    this._what.replaceChildren(
      html("option", "", { value: "whole" }, all),
      html("option", "", { value: "own" }, `Only ${name}`),
    );
    setHidden(this._body, false);
    this._go.setAttribute("aria-pressed", "true");
    this.showMessage("");
  }

  close() {
    setHidden(this._body, true);
    this._go.setAttribute("aria-pressed", "false");
    this.showMessage("");
  }

  /** @param {boolean} whole */
  choose(whole) {
    this._what.value = whole ? "whole" : "own";
  }

  /** @param {Alignment} now */
  show(now) {
    for (const [name, input] of this._inputs) input.value = String(now[name]);
  }

  /** @param {{line: string, lost: string}} saved */
  tellSaved({ line, lost }) {
    setText(this._message, lost || "Saved. The line for a fleet file:");
    this._line.textContent = line;
    this._line.toggleAttribute("hidden", false);
  }

  /**
   * @param {Field} name
   * @param {string} label
   * @param {string} step
   */
  _field(name, label, step) {
    const input = html("input", "webmap-align-field", {
      type: "number",
      step: "any",
      inputmode: "decimal",
      name,
    });
    input.dataset.step = step;
    input.addEventListener("input", () => this._typed());
    input.addEventListener("keydown", (event) => this._step(event, input));
    this._inputs.set(name, input);
    return html("label", "webmap-muted", {}, html("span", "", {}, label), input);
  }

  /**
   * Change a field by its own step with the arrow keys; with Shift by ten steps.
   *
   * @param {KeyboardEvent} event
   * @param {HTMLInputElement} input
   */
  _step(event, input) {
    const sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!sign || !Number.isFinite(input.valueAsNumber)) return;
    event.preventDefault();
    const step = Number(input.dataset.step) * (event.shiftKey ? 10 : 1);
    input.value = String(Math.round((input.valueAsNumber + sign * step) * 1000) / 1000);
    this._typed();
  }

  _typed() {
    const [x, y, angle] = FIELDS.map(([name]) => this._inputs.get(name)?.valueAsNumber ?? NaN);
    if ([x, y, angle].every(Number.isFinite)) this._actions.type({ x, y, angle });
  }
}
