import { readStored, store } from "../../web/stored.js";
import { html, onBeat, setHidden, setText, svg } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { foldedTool } from "../../web/tools/tool.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {(message: Record<string, unknown>) => void} Send */

/**
 * @typedef {object} Options
 * @property {string[]} [levels] In ascending order.
 * @property {string} [level] The least level that is shown at first.
 * @property {number} [lines] Number of lines of each bridge.
 */

/**
 * @typedef {[number, string, string, string, number, number]} LogLine Number, level, node,
 *     text, repetitions, and time in seconds of the display's clock.
 */

/** The key of the choice in this browser's storage. */
const KEPT = "webmap.rosout";

/** Beats between two updates of the ages. */
const PERIOD = 4;

/** The name of a level for people, its outline, filled, and the symbol drawn on it. */
const LOOKS = /** @type {Record<string, [string, string, string]>} */ ({
  debug: ["Debug", "", "M5 12h.1M12 12h.1M19 12h.1"],
  info: ["Info", "M12 2.5a9.5 9.5 0 1 0 .01 0z", "M12 11v6M12 7v.1"],
  warn: ["Warning", "M12 2.5L22.5 21h-21z", "M12 9v6M12 18v.1"],
  error: ["Error", "M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8z", "M8 8l8 8M16 8l-8 8"],
  fatal: ["Fatal", "M2.5 2.500h19v19h-19z", "M12 6.500v7M12 17.500v.1"],
});

/**
 * The newest log lines of nodes, in a panel that unfolds. The display subscribes only
 * while the panel is unfolded: sends `{open: true}` and `{open: false}`; receives
 * `{bridge, name, lines, total, state}` with the bridge's number and name, and the lines
 * that are new or repeated.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new RosoutPanel(map, options, send);
}

/**
 * @param {number} seconds
 * @returns {string} The time span as text for people.
 */
export function ago(seconds) {
  if (seconds < 60) return `${Math.max(0, Math.floor(seconds))} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min`;
  return `${Math.floor(seconds / 3600)} h`;
}

class RosoutPanel {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { levels = [], level = "info", lines = 100 }, send) {
    this._map = map;
    this._send = send;
    this._levels = levels;
    this._most = lines;
    const stored = readStored(KEPT);
    const open = stored?.open === true;
    /** @type {BridgeLines[]} By the bridge's number. */
    this._books = [];
    this._choice = html("select", "");
    for (const each of levels) {
      const words = `${LOOKS[each]?.[0] ?? each}${each === levels.at(-1) ? "" : " and worse"}`;
      this._choice.append(html("option", "", { value: each }, words));
    }
    this._choice.value = levels.includes(stored?.least) ? stored.least : level;
    const leave = map.layout.add("log", {
      read: () => ({ open: this._details.open, least: this._choice.value }),
      write: (log) => this._lay(log.open, log.least),
      reset: () => this._lay(false, level),
    });
    this._choice.addEventListener("change", () => {
      this._filter();
      this._keep();
    });
    this._count = html("p", "webmap-muted webmap-rosout-count", { role: "status" });
    this._badge = html("span", "webmap-badge webmap-rosout-badge");
    this._details = foldedTool(
      "webmap-rosout",
      "log",
      "Log",
      { "data-webmap-menu": "" },
      html("label", "webmap-row webmap-rosout-level", {}, "Show", this._choice),
      this._count,
    );
    this._details.querySelector("summary")?.append(this._badge);
    this._details.open = open;
    this._details.addEventListener("toggle", () => this._toggled());
    this.destroy = endOf(
      onBeat(() => this._age(), PERIOD),
      leave,
      lay(map, this._details, "top-left"),
    );
    this._filter();
    if (open) send({ open: true });
  }

  /** @param {any} message */
  receive({ bridge, name, lines, total, state }) {
    this._books[bridge] ??= this._begin(name);
    this._books[bridge].add(lines, total, state, this._most);
    this._filter();
    this._age();
  }

  /**
   * @param {string} name Of a bridge.
   * @returns {BridgeLines}
   */
  _begin(name) {
    const book = new BridgeLines(name);
    this._count.parentElement?.append(book.element);
    return book;
  }

  /**
   * @param {boolean} unfolded
   * @param {string} least
   */
  _lay(unfolded, least) {
    if (this._levels.includes(least)) this._choice.value = least;
    this._details.open = unfolded;
    this._filter();
    this._keep();
  }

  _toggled() {
    this._keep();
    this._send({ open: this._details.open });
  }

  _filter() {
    const least = this._levels.indexOf(this._choice.value);
    let [shown, bad] = [0, 0];
    for (const book of this._books) {
      for (const { row, level } of book.rows.values()) {
        setHidden(row, this._levels.indexOf(level) < least);
        if (!row.hidden) shown += 1;
        if (level === "error" || level === "fatal") bad += 1;
      }
      book.showState(this._books.length > 1);
    }
    setText(this._badge, bad > 0 ? `${bad}` : "");
    this._badge.title = bad > 0 ? `${bad} error${bad === 1 ? "" : "s"} in the newest lines` : "";
    const total = this._books.reduce((sum, book) => sum + book.total, 0);
    const lines = (/** @type {number} */ n) =>
      `${n.toLocaleString("en")} ${n === 1 ? "line" : "lines"}`;
    setText(
      this._count,
      total === 0 ? "No log lines yet." : `${lines(shown)} shown of ${lines(total)} received.`,
    );
  }

  _age() {
    const now = this._map.clock;
    if (!this._details.open || now === null) return;
    for (const { rows } of this._books) {
      for (const { age, receivedAt } of rows.values()) setText(age, ago(now - receivedAt));
    }
  }

  _keep() {
    store(KEPT, { open: this._details.open, least: this._choice.value });
  }
}

/** The lines of one bridge, the newest on top. */
class BridgeLines {
  /** @param {string} name */
  constructor(name) {
    this.total = 0;
    this._state = "";
    /**
     * @type {Map<number, {row: HTMLElement, level: string, times: HTMLElement,
     *     age: HTMLElement, receivedAt: number}>}
     */
    this.rows = new Map();
    this._list = html("ol", "webmap-list webmap-rosout-lines", { "aria-label": `Log of ${name}` });
    this._note = html("p", "webmap-muted webmap-rosout-note");
    this._head = html("h3", "", {}, name);
    this.element = html("section", "webmap-rosout-book", {}, this._head, this._note, this._list);
  }

  /**
   * @param {LogLine[]} lines
   * @param {number} total
   * @param {string} state Of the bridge.
   * @param {number} most
   */
  add(lines, total, state, most) {
    this.total = total;
    this._state = state;
    for (const [number, level, name, text, count, receivedAt] of lines) {
      const known = this.rows.get(number) ?? this._add(number, level, name, text);
      known.receivedAt = receivedAt;
      setText(known.times, count > 1 ? `× ${count.toLocaleString("en")}` : "");
    }
    for (const [number, { row }] of this.rows) {
      if (this.rows.size <= most) break;
      row.remove();
      this.rows.delete(number);
    }
  }

  /** @param {boolean} named Whether there are other bridges. */
  showState(named) {
    setHidden(this._head, !named);
    const away = this._state !== "" && this._state !== "open";
    setText(this._note, away ? "No connection to this bridge: no new log lines." : "");
  }

  /**
   * @param {number} number
   * @param {string} level
   * @param {string} name
   * @param {string} text
   */
  _add(number, level, name, text) {
    const [word, outline, mark] = LOOKS[level] ?? LOOKS.info;
    const shape = svg(
      "svg",
      { viewBox: "0 0 24 24", class: "webmap-symbol", "aria-hidden": "true" },
      svg("path", { d: outline, class: "solid" }),
      svg("path", { d: mark, class: "mark" }),
    );
    const times = html("span", "webmap-rosout-times");
    const age = html("span", "webmap-muted webmap-rosout-age");
    const row = html(
      "li",
      "webmap-item webmap-rosout-line",
      { "data-level": level },
      shape,
      html("strong", "", {}, word),
      html("span", "webmap-muted webmap-one-line webmap-rosout-name", {}, name),
      times,
      age,
      html("span", "webmap-rosout-text", {}, text),
    );
    this._list.prepend(row);
    const known = { row, level, times, age, receivedAt: 0 };
    this.rows.set(number, known);
    return known;
  }
}
