import { BASE, post } from "../../web/access.js";
import { button, clock, html, setHidden, setText } from "../../web/tools/elements.js";
import { lay } from "../../web/tools/overlay.js";
import { offer } from "../../web/tools/save_menu.js";
import { foldedTool } from "../../web/tools/tool.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {(message: Record<string, unknown>) => void} Send */

/**
 * @typedef {object} Options
 * @property {Record<string, string>} kinds The names of the kinds of entries.
 * @property {number} rows The most rows that are shown.
 * @property {number} note The most characters of a note.
 * @property {string} page The address of the page that hands over a shift.
 * @property {boolean} may Whether this viewer may add notes.
 */

/**
 * @typedef {[number, string, string, string, string, boolean, string]} Row Unix seconds,
 *     kind, robot, person, place, whether the name is not verified, and text.
 */

const SINCE = { shift: "This shift", 12: "12 hours", 24: "24 hours", all: "All kept" };

/** The tone of kinds that need attention. */
const TONES = /** @type {Record<string, string>} */ ({ stop: "bad", alert: "warn" });

/** What the panel shows; kept while a page reconnects. */
const kept = { open: false, since: "shift", robot: "", person: "", kind: "" };

/**
 * The shift log in a panel that unfolds. Sends `{show: {since, robot, person, kind}}`
 * and `{show: null}`, `{note, about}` and `{shift: true}`; receives the newest entries as
 * `{all, count, robots, people, has}` and then `{new}`, both with `{trouble}`, and
 * `{problem}` after a note.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new ShiftPanel(map, options, send);
}

class ShiftPanel {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, options, send) {
    this._options = options;
    this._send = send;
    this._total = 0;
    const show = () => this._show();
    this._since = choice(Object.entries(SINCE), kept.since, show);
    this._robot = choice([["", "All robots"]], "", show);
    this._person = choice([["", "Everybody"]], "", show);
    this._kind = choice([["", "All but pages"]], "", show);
    this._trouble = html("p", "webmap-problem", { role: "status" });
    this._count = html("p", "webmap-muted webmap-shift-count", { role: "status" });
    this._stated = html("p", "webmap-muted", {}, "* This name is not verified.");
    this._list = html("ol", "webmap-list webmap-shift-list", { "aria-label": "Entries" });
    this._saved = html("p", "webmap-problem", { role: "status" });
    this._details = foldedTool(
      "webmap-shift",
      "shift",
      "Shift log",
      { "data-webmap-menu": "" },
      this._trouble,
      this._filter(),
      ...(options.may ? this._noteForm() : []),
      html(
        "div",
        "webmap-row wraps webmap-shift-acts",
        {},
        button("", "Hand over the shift", () => this._handOver()),
        button("", "CSV", () => void this._saveCsv()),
      ),
      this._saved,
      this._count,
      this._list,
      this._stated,
    );
    this._badge = html("span", "webmap-badge");
    this._details.querySelector("summary")?.append(this._badge);
    this._details.open = kept.open;
    this._details.addEventListener("toggle", show);
    this.destroy = lay(map, this._details, "top-left");
    if (kept.open) send({ show: chosen() });
  }

  /** @param {any} message */
  receive(message) {
    if (message.problem !== undefined) return this._noted(message.problem);
    setText(this._trouble, message.trouble);
    setText(this._badge, message.trouble ? "!" : "");
    this._badge.title = message.trouble;
    const { rows } = this._options;
    if (message.all) {
      this._total = message.count;
      fill(this._robot, message.robots, kept.robot);
      fill(this._person, message.people.map(twice), kept.person);
      const kinds = message.has.map((/** @type {string} */ kind) => [kind, this._name(kind)]);
      fill(this._kind, [["all", "All kinds"], ...kinds], kept.kind);
      this._list.replaceChildren();
    } else this._total += message.new.length;
    const lines = (message.all ?? message.new).map((/** @type {Row} */ row) => this._line(row));
    this._list.prepend(...lines.reverse());
    while (this._list.children.length > rows) this._list.lastElementChild?.remove();
    const all = this._total === 1 ? "1 entry" : `${this._total.toLocaleString("en")} entries`;
    const shown = this._total > rows ? `The newest ${rows} of ${all}; CSV has all.` : `${all}.`;
    setText(this._count, this._total === 0 ? "No entries." : shown);
    setHidden(this._stated, this._list.querySelector(".webmap-shift-stated") === null);
  }

  _show() {
    kept.open = this._details.open;
    kept.since = this._since.value;
    kept.robot = this._robot.value;
    kept.person = this._person.value;
    kept.kind = this._kind.value;
    this._send({ show: kept.open ? chosen() : null });
    if (!this._note) return;
    const robot = this._robot.selectedOptions[0];
    this._note.placeholder = robot?.value ? `About ${robot.text}` : "For the next shift";
  }

  _filter() {
    const choices = html(
      "div",
      "webmap-shift-choices",
      {},
      named("Since", this._since),
      named("Robot", this._robot),
      named("Person", this._person),
      named("Kind", this._kind),
    );
    const summary = html("summary", "", {}, "Filter");
    const filter = html("details", "webmap-shift-filter", {}, summary, choices);
    // A small page has room for the choices or for the entries.
    filter.open = innerHeight >= 700 && innerWidth > 640;
    return filter;
  }

  /** @returns {Node[]} */
  _noteForm() {
    const attributes = { maxlength: `${this._options.note}`, autocomplete: "off", dir: "auto" };
    this._note = html("input", "", { ...attributes, "aria-label": "Note" });
    this._note.placeholder = "For the next shift";
    this._problem = html("p", "webmap-problem", { role: "status" });
    const add = button("", "Add note", () => {});
    add.type = "submit";
    const form = html("form", "webmap-row wraps webmap-shift-note", {}, this._note, add);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this._send({ note: this._note?.value ?? "", about: this._robot.value });
    });
    return [form, this._problem];
  }

  /** @param {string} problem Why the note was not added; empty if it was. */
  _noted(problem) {
    if (!this._note || !this._problem) return;
    setText(this._problem, problem);
    if (!problem) this._note.value = "";
  }

  _handOver() {
    if (this._options.may) this._send({ shift: true });
    window.open(new URL(`../${this._options.page}`, BASE), "_blank", "noopener");
  }

  async _saveCsv() {
    let problem = "";
    try {
      const answer = await post("shift-log.csv", chosen());
      if (answer.ok) {
        const day = new Date().toLocaleDateString("en-CA");
        offer(await answer.blob(), `shift-log-${day}.csv`);
      } else problem = `There is no CSV: the server answered ${answer.status}.`;
    } catch {
      problem = "There is no CSV: the server does not answer.";
    }
    setText(this._saved, problem);
  }

  /** @param {string} kind */
  _name(kind) {
    return this._options.kinds[kind] ?? kind;
  }

  /** @param {Row} row */
  _line([unix, kind, robot, person, place, stated, text]) {
    const who = html("bdi", "webmap-shift-who", {}, person);
    who.title = stated ? `${place} (name not verified)` : place;
    who.classList.toggle("webmap-shift-stated", stated);
    const time = html("time", "webmap-muted", {}, clock(unix, true));
    time.dateTime = new Date(unix * 1000).toISOString();
    return html(
      "li",
      "webmap-item webmap-shift-entry",
      { "data-kind": kind, "data-tone": TONES[kind] ?? "none" },
      html("strong", "", {}, this._name(kind)),
      html("bdi", "webmap-one-line webmap-shift-robot", {}, robot),
      time,
      html("p", "", {}, ...(person ? [who, `${stated ? "*" : ""}: `] : []), text),
    );
  }
}

/** @returns {Record<string, string>} */
function chosen() {
  const { since, robot, person, kind } = kept;
  return { since, robot, person, kind };
}

/** @param {string} text */
function twice(text) {
  return [text, text];
}

/**
 * @param {string[][]} options Values and texts.
 * @param {string} value
 * @param {() => void} change
 */
function choice(options, value, change) {
  const select = html("select", "");
  for (const [key, text] of options) select.append(html("option", "", { value: key }, text));
  select.value = value;
  select.addEventListener("change", change);
  return select;
}

/**
 * Offer other options besides the first one, and keep the present one.
 *
 * @param {HTMLSelectElement} select
 * @param {string[][]} options
 * @param {string} value
 */
function fill(select, options, value) {
  const shown = [...select.options].slice(1).map((option) => option.value);
  if (shown.join("\n") === options.map(([key]) => key).join("\n")) return;
  select.length = 1;
  for (const [key, text] of options) select.append(html("option", "", { value: key }, text));
  select.value = value;
}

/**
 * @param {string} name
 * @param {HTMLElement} field
 */
function named(name, field) {
  field.setAttribute("aria-label", name);
  return html("label", "", {}, html("span", "webmap-muted", {}, name), field);
}
