import { html, setText, svg } from "../../web/tools/elements.js";
import { grouped } from "./player_position.js";

/** @typedef {import('./player_position.js').Mark} Mark */
/** @typedef {import('./player_position.js').Group} Group */

/** Least distance of two marks, and greatest of a press from its mark, in pixels. */
const APART = 14;
const REACH = 22;

/** Milliseconds for which the text of a pressed mark is shown. */
const SHOWN = 4000;

/** The shape of each kind. */
const SHAPES = {
  stop: "M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8z",
  alarm: "M12 2L23 21.5H1z",
  result: "M12 2l10 10-10 10L2 12z",
  goal: "M5 2h15l-4 5.5 4 5.5H8v9H5z",
};

/** The marks of a recording above its time line: one Tab stop, arrow keys between them. */
export class MarkLine {
  /** @param {(at: number) => void} go Called with the time of a mark that is pressed. */
  constructor(go) {
    this._go = go;
    /** @type {Mark[]} */
    this._marks = [];
    this._seconds = 0;
    this._drawn = "";
    /** @type {{button: HTMLButtonElement, group: Group}[]} */
    this._buttons = [];
    this._pressed = { text: "", until: -Infinity };
    this._pointed = "";
    this._none = html("span", "webmap-player-none");
    this.element = html("div", "webmap-player-marks", { role: "group" }, this._none);
    this.element.addEventListener("click", (event) => this._press(event));
    this.element.addEventListener("keydown", (event) => this._move(event));
    this.element.addEventListener("pointerleave", () => {
      this._pointed = "";
    });
    this._observer = new ResizeObserver(() => this._draw());
    this._observer.observe(this.element);
  }

  destroy() {
    this._observer.disconnect();
  }

  /** The text of the mark that is pointed at, has the focus, or was pressed. */
  get text() {
    if (this._pointed !== "") return this._pointed;
    const focused = this._buttons.find(({ button }) => button === document.activeElement);
    if (focused?.button.matches(":focus-visible")) return focused.group.text;
    return performance.now() < this._pressed.until ? this._pressed.text : "";
  }

  /** @param {number} seconds */
  setLength(seconds) {
    this._seconds = seconds;
    this._draw();
  }

  /**
   * @param {Mark[]} marks
   * @param {number} leftOut
   * @param {boolean} complete Whether the whole recording was read.
   */
  setMarks(marks, leftOut, complete) {
    this._marks = marks;
    const count = `Events: ${marks.length}${leftOut > 0 ? `, and ${leftOut} that are not shown` : ""}`;
    this.element.setAttribute("aria-label", count);
    setText(this._none, complete && marks.length === 0 ? "No stops, goals or alarms" : "");
    this._draw();
  }

  _draw() {
    const width = this.element.clientWidth;
    const drawn = JSON.stringify([this._marks.length, this._seconds, width]);
    if (drawn === this._drawn || width === 0) return;
    this._drawn = drawn;
    const focus = this._buttons.findIndex(({ button }) => button === document.activeElement);
    for (const { button } of this._buttons) button.remove();
    const groups = grouped(this._marks, this._seconds, APART / width);
    this._buttons = groups.map((group, index) => {
      const button = html(
        "button",
        `webmap-player-mark ${group.kind}`,
        {
          type: "button",
          title: group.text,
          "aria-label": group.text,
          tabindex: index === Math.max(focus, 0) ? "0" : "-1",
        },
        svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, svg("path", { d: SHAPES[group.kind] })),
      );
      button.style.left = `${100 * group.fraction}%`;
      button.addEventListener("pointerenter", () => {
        this._pointed = group.text;
      });
      button.addEventListener("pointerleave", () => {
        this._pointed = "";
      });
      return { button, group };
    });
    this.element.append(...this._buttons.map(({ button }) => button));
    if (focus >= 0) this._buttons.at(focus)?.button.focus();
  }

  /**
   * A finger is larger than a mark: a press beside one counts for the nearest.
   *
   * @param {MouseEvent} event
   */
  _press({ target, clientX, detail }) {
    const middle = (/** @type {Element} */ each) => {
      const { left, width } = each.getBoundingClientRect();
      return Math.abs(left + width / 2 - clientX);
    };
    const [nearest] = [...this._buttons].sort((a, b) => middle(a.button) - middle(b.button));
    const pressed = this._buttons.find(({ button }) => target instanceof Node && button.contains(target));
    const chosen = pressed ?? (detail > 0 && nearest && middle(nearest.button) <= REACH ? nearest : null);
    if (!chosen) return;
    this._pressed = { text: chosen.group.text, until: performance.now() + SHOWN };
    this._go(chosen.group.at);
  }

  /** @param {KeyboardEvent} event */
  _move(event) {
    const now = this._buttons.findIndex(({ button }) => button === event.target);
    const to = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: this._buttons.length - 1 }[event.key];
    if (now < 0 || to === undefined) return;
    event.preventDefault();
    const next = this._buttons[Math.min(Math.max(to, 0), this._buttons.length - 1)];
    this._buttons[now].button.tabIndex = -1;
    next.button.tabIndex = 0;
    next.button.focus();
  }
}
