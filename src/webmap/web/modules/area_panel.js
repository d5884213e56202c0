import { button, html } from "./elements.js";
import { SPACING } from "./sweeps.js";

/**
 * What can be done with an area.
 *
 * @typedef {object} Acts
 * @property {() => void} begin
 * @property {() => void} close No further corner is pressed.
 * @property {() => void} undo The last corner is taken away.
 * @property {() => void} here The robot's place becomes a corner.
 * @property {() => void} changed The sweeps are wanted another way.
 * @property {() => void} take
 * @property {() => void} leave
 */

/** The buttons and the field with which an area is made into sweeps. */
export class AreaPanel {
  /** @param {Acts} acts */
  constructor(acts) {
    /** Whether sweeps go across the longest side. */
    this.across = false;
    /** Begins an area. */
    this.begin = button("webmap-area-begin", "Area", acts.begin);
    this.begin.title = "Sweep back and forth over an area";
    this._done = button("webmap-area-done", "Done", acts.close);
    this._done.title = "Or press the first corner again";
    this._undo = button("webmap-area-undo", "Undo", acts.undo);
    this._undo.title = "Take the last corner away";
    this._here = button("webmap-area-here", "Its place", acts.here);
    this._here.title = "Add the place of the selected robot";
    this._spacing = html("input", "webmap-area-spacing", {
      type: "number",
      min: `${SPACING.least}`,
      max: `${SPACING.most}`,
      step: "0.1",
      value: `${SPACING.usual}`,
    });
    this._spacing.addEventListener("input", acts.changed);
    this._spacing.addEventListener("keydown", ({ key }) => {
      // The page leaves Escape to a field, and this one has no use for it.
      if (key === "Escape") acts.leave();
    });
    this._turn = button("webmap-area-across", "Across", () => {
      this.across = !this.across;
      acts.changed();
    });
    this._turn.title = "Sweep across the longest side, not along it";
    this._take = button("webmap-area-take", "Add to route", acts.take);
    this._leave = button("webmap-area-leave", "Leave", acts.leave);
    const label = html("label", "webmap-area-apart", {}, "Apart, in m ", this._spacing);
    this._how = html("div", "webmap-route-row", {}, label, this._turn);
    this.element = html(
      "div",
      "webmap-area",
      { role: "group", "aria-label": "Area" },
      this._how,
      html(
        "div",
        "webmap-route-row",
        {},
        ...[this._done, this._undo, this._here, this._take, this._leave],
      ),
    );
  }

  /** The metres between sweeps; NaN where there is no number. */
  get spacing() {
    return this._spacing.value === "" ? NaN : Number(this._spacing.value);
  }

  /**
   * @param {object} area
   * @param {boolean} area.active Whether there is one.
   * @param {boolean} area.closed
   * @param {number} area.corners How many there are.
   * @param {boolean} area.ready Whether there are sweeps to take.
   */
  show({ active, closed, corners, ready }) {
    this._turn.setAttribute("aria-pressed", String(this.across));
    this._how.hidden = this._take.hidden = !closed;
    for (const each of [this._done, this._undo, this._here]) each.hidden = closed;
    this._undo.disabled = corners === 0;
    this._take.disabled = !ready;
    this.element.hidden = !active;
  }

  /** @param {boolean} possible Whether a robot's place can be added. */
  showHere(possible) {
    this._here.disabled = !possible;
  }

  /** Whether the keys are with the buttons of an area. */
  get focused() {
    return this.element.contains(document.activeElement);
  }

  /** Let the keys go on with what is there now: a button that is gone has no next one. */
  focus() {
    const next = [this._done, this._take, this._turn, this.begin];
    next.find((each) => !each.disabled && each.offsetParent !== null)?.focus();
  }
}
