import { button as newButton, html, setText, svg } from "../../web/tools/elements.js";
import { lay } from "../../web/tools/overlay.js";
import { clock, groupMarks, Position } from "./player_position.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('./player_position.js').Status} Status */
/** @typedef {import('./player_position.js').Mark} Mark */
/** @typedef {import('./player_position.js').Group} Group */
/** @typedef {{marks: Mark[], left_out: number, read: number}} Marks */
/** @typedef {(message: Record<string, unknown>) => void} Send */

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];

/** Milliseconds between two updates of the position. */
const PERIOD = 100;

/** Milliseconds between two seeks while the slider is dragged. */
const SEEKS = 150;

/** Seconds before a mark at which its scene begins. */
const BEFORE = 2;

/** Seconds of each key on the slider. */
const STEPS = /** @type {Readonly<Record<string, number>>} */ ({
  ArrowLeft: -1,
  ArrowDown: -1,
  ArrowRight: 1,
  ArrowUp: 1,
  PageDown: -10,
  PageUp: 10,
  Home: -Infinity,
  End: Infinity,
});

const PLAY = "M7 4l13 8-13 8z";
const PAUSE = "M6 4h4.5v16H6zM13.5 4H18v16h-4.5z";
const AGAIN = "M12 4a8 8 0 1 0 8 8h-2.5a5.5 5.5 0 1 1-5.5-5.5V10l6-4.8L12 .5z";

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

/** The tone of each kind. */
const TONES = { stop: "bad", alarm: "warn", result: "good", goal: "active" };

/**
 * The player of a recording: play, pause, seek, speed, and marks on the time line. A page
 * that has it gets a coloured frame.
 *
 * Sends `{command, value}`; receives `{status}` and `{marks}`.
 *
 * @param {MapCanvas} map
 * @param {object} _options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, _options, send) {
  const bar = new PlayerBar(map, send);
  return {
    receive: ({ status, marks }) => {
      if (status) bar.showStatus(status);
      if (marks) bar.showMarks(marks);
    },
    destroy: () => bar.destroy(),
  };
}

class PlayerBar {
  /**
   * @param {MapCanvas} map
   * @param {Send} send
   */
  constructor(map, send) {
    this._send = send;
    this._position = new Position();
    /** @type {Marks | null} */
    this._marks = null;
    this._dragged = false;
    this._sought = -Infinity;
    this._icon = svg("path", { d: PLAY });
    this._play = newButton("webmap-player-play", "", () => {
      const playing = this._position.status?.playing ?? false;
      send({ command: playing ? "pause" : "play" });
    });
    // No robot is driven in a recording, so Space need not be STOP here.
    this._play.dataset.webmapKeepsSpace = "";
    this._play.append(svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, this._icon));
    this._time = html("span", "webmap-player-time");
    this._slider = html("input", "webmap-player-slider", {
      type: "range",
      min: "0",
      max: "0",
      step: "any",
      "aria-label": "Position in the recording",
    });
    this._listen(this._slider);
    this._line = new MarkLine((at) => this._seek(at - BEFORE));
    this._speed = html("select", "webmap-player-speed", { "aria-label": "Speed", title: "Speed" });
    this._offer(SPEEDS);
    this._speed.addEventListener("change", () => {
      send({ command: "rate", value: Number(this._speed.value) });
    });
    this._text = html("p", "webmap-surface webmap-player-text", { role: "status" });
    this._element = html(
      "section",
      "webmap-panel webmap-player",
      { "aria-label": "Player of the recording" },
      html("strong", "webmap-badge webmap-player-badge", {}, "RECORDING"),
      this._play,
      this._time,
      html("div", "webmap-player-line", {}, this._line.element, this._slider),
      this._speed,
      this._text,
    );
    this._take = lay(map, this._element, "bottom-left");
    document.documentElement.classList.add("webmap-plays");
    this._timer = setInterval(() => this._show(), PERIOD);
    this._show();
  }

  destroy() {
    clearInterval(this._timer);
    this._line.destroy();
    this._take();
    document.documentElement.classList.remove("webmap-plays");
  }

  /** @param {Status} status */
  showStatus(status) {
    this._position.receive(status, performance.now());
    this._slider.max = `${status.seconds}`;
    this._line.setLength(status.seconds);
    if (document.activeElement !== this._speed) {
      if (!SPEEDS.includes(status.rate)) {
        this._offer([...SPEEDS, status.rate].sort((a, b) => a - b));
      }
      this._speed.value = `${status.rate}`;
    }
    this._show();
  }

  /** @param {Marks} marks */
  showMarks(marks) {
    this._marks = marks;
    this._line.setMarks(marks.marks, marks.left_out, marks.read >= 1);
    this._show();
  }

  /** @param {HTMLInputElement} slider */
  _listen(slider) {
    slider.addEventListener("pointerdown", () => (this._dragged = true));
    for (const end of ["pointerup", "pointercancel", "blur"]) {
      slider.addEventListener(end, () => (this._dragged = false));
    }
    slider.addEventListener("input", () => {
      const at = this._position.want(slider.valueAsNumber, performance.now());
      if (performance.now() - this._sought >= SEEKS) this._seek(at);
    });
    slider.addEventListener("change", () => this._seek(slider.valueAsNumber));
    slider.addEventListener("keydown", (event) => {
      const step = STEPS[event.key];
      if (step === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      this._seek(this._position.at(performance.now()) + step * (event.shiftKey ? 10 : 1));
    });
  }

  /** @param {number} at */
  _seek(at) {
    if (this._position.status === null) return;
    this._sought = performance.now();
    this._send({ command: "seek", value: this._position.want(at, this._sought) });
    this._show();
  }

  /** @param {number[]} speeds */
  _offer(speeds) {
    const options = speeds.map((speed) => html("option", "", { value: `${speed}` }, `${speed}×`));
    this._speed.replaceChildren(...options);
    this._speed.value = "1";
  }

  _show() {
    const now = performance.now();
    const { status } = this._position;
    const lost = this._position.lost(now);
    const at = this._position.at(now);
    const known = status !== null && !lost;
    for (const element of [this._play, this._slider, this._speed]) element.disabled = !known;
    const label = status?.playing ? "Pause" : status?.ended ? "Play again from the beginning" : "Play";
    if (this._play.title !== label) {
      this._play.title = label;
      this._play.setAttribute("aria-label", label);
      this._icon.setAttribute("d", status?.playing ? PAUSE : status?.ended ? AGAIN : PLAY);
    }
    const seconds = status?.seconds ?? 0;
    if (!this._dragged) this._slider.value = `${at}`;
    const played = seconds > 0 ? (100 * this._slider.valueAsNumber) / seconds : 0;
    this._slider.style.setProperty("--played", `${played}%`);
    this._slider.setAttribute("aria-valuetext", `${clock(at)} of ${clock(seconds)}`);
    setText(this._time, status === null ? "" : `${clock(at)} / ${clock(seconds)}`);
    setText(this._text, this._words(lost));
    this._element.classList.toggle("bad", lost || (status?.problem ?? "") !== "");
  }

  /**
   * @param {boolean} lost
   * @returns {string} What the operator must know besides the position.
   */
  _words(lost) {
    const { status } = this._position;
    if (lost) return "No connection to the process that plays the recording.";
    if (this._line.text !== "") return this._line.text;
    if (status === null) return "Opening the recording";
    if (status.problem) return `The recording is damaged: ${status.problem}`;
    if (status.ended && status.at < status.seconds - 1) {
      return `There are no messages after ${clock(status.at)}`;
    }
    if (status.ended) return "End of the recording";
    const read = this._marks?.read ?? 1;
    return read < 1 ? `Reading events: ${Math.floor(100 * read)} %` : "";
  }
}

/** The marks of a recording above its time line: one Tab stop, arrow keys between them. */
class MarkLine {
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
    this._none = html("span", "webmap-muted webmap-player-none");
    this.element = html("div", "webmap-player-marks", { role: "group" }, this._none);
    this.element.addEventListener("click", (event) => this._press(event));
    this.element.addEventListener("keydown", (event) => this._move(event));
    this.element.addEventListener("pointerleave", () => (this._pointed = ""));
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
    const groups = groupMarks(this._marks, this._seconds, APART / width);
    this._buttons = groups.map((group, index) => {
      const button = html(
        "button",
        `webmap-player-mark ${group.kind}`,
        {
          "data-tone": TONES[group.kind],
          type: "button",
          title: group.text,
          "aria-label": group.text,
          tabindex: index === Math.max(focus, 0) ? "0" : "-1",
        },
        svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, svg("path", { d: SHAPES[group.kind] })),
      );
      button.style.left = `${100 * group.fraction}%`;
      button.addEventListener("pointerenter", () => (this._pointed = group.text));
      button.addEventListener("pointerleave", () => (this._pointed = ""));
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
