import {
  button,
  clock,
  forgetOthers,
  html,
  onBeat,
  setHidden,
  setText,
  svg,
} from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { foldedTool } from "../../web/tools/tool.js";
import { Pace, Signals } from "./alert_signal.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {(message: Record<string, unknown>) => void} Send */

/**
 * @typedef {object} Options
 * @property {Record<string, string>} kinds The text of each kind of alert, the most
 *     urgent first.
 * @property {boolean} may Whether this viewer may acknowledge.
 */

/**
 * An alert; all times are in Unix seconds.
 *
 * @typedef {object} Alert
 * @property {number} id
 * @property {string} robot The robot's id.
 * @property {string} name The robot's name.
 * @property {string} kind
 * @property {string} text
 * @property {number} began
 * @property {number | null} ended null while it is active.
 * @property {number} count The number of times it began.
 * @property {string | null} by Who acknowledged it; null until then.
 * @property {number | null} acknowledged
 */

/** Beats between two checks whether a signal is due. */
const PERIOD = 2;

/** Kept while a page reconnects, so that no alert is signalled twice. */
const pace = new Pace();

/**
 * The alerts of all robots: a button with the number of new ones, and a list. Sends
 * `{acknowledge: [id]}` and `{select: robot}`; receives `{alerts, ids, dropped}` with
 * the alerts that changed and the ids of all alerts, and `{problem}`.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new AlertPanel(map, options, send);
}

/**
 * @param {Alert[]} alerts The alerts that nobody has acknowledged.
 * @param {Record<string, string>} kinds
 * @param {number} [dropped] Alerts that have left the list.
 * @returns {string} The counts of all kinds as text.
 */
export function headline(alerts, kinds, dropped = 0) {
  const counts = Object.entries(kinds)
    .map(([kind, text]) => [alerts.filter((each) => each.kind === kind).length, text])
    .filter(([count]) => count !== 0)
    .map(([count, text]) => `${count} ${text}`);
  const number = alerts.length === 1 ? "1 new alert" : `${alerts.length} new alerts`;
  const shown = alerts.length === 0 ? "No new alerts." : `${number}: ${counts.join(", ")}.`;
  const more = dropped === 1 ? "1 more alert" : `${dropped} more alerts`;
  return dropped === 0 ? shown : `${shown} The list had no place for ${more}.`;
}

/**
 * @param {number} seconds
 * @returns {string} The time span as text for people.
 */
export function span(seconds) {
  if (seconds < 60) return `${Math.max(0, Math.round(seconds))} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min`;
  return `${Math.floor(seconds / 3600)} h`;
}

class AlertPanel {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { kinds, may }, send) {
    this._kinds = kinds;
    this._may = may;
    this._send = send;
    /** @type {Map<number, {alert: Alert, row: Row}>} */
    this._known = new Map();
    this._signals = new Signals();
    this._badge = html("span", "webmap-badge webmap-alert-badge");
    this._headline = html("p", "webmap-alert-headline", { role: "status" });
    this._problem = html("p", "webmap-problem webmap-alert-problem", { role: "status" });
    this._all = button("webmap-alert-all", "Acknowledge all", () => {
      this._acknowledge(this._open().map(({ id }) => id));
    });
    this._new = html("ol", "webmap-list webmap-alert-list", { "aria-label": "New alerts" });
    this._old = html("ol", "webmap-list webmap-alert-list", { "aria-label": "Acknowledged alerts" });
    this._oldHead = html("h3", "", {}, "Acknowledged");
    this._details = foldedTool(
      "webmap-alerts",
      "alerts",
      "Alerts",
      { "data-webmap-menu": "" },
      this._headline,
      this._all,
      this._problem,
      this._new,
      this._oldHead,
      this._old,
      this._signals.element,
    );
    this._details.querySelector("summary")?.append(this._badge);
    this.destroy = endOf(
      onBeat(() => this._signal(), PERIOD),
      this._signals,
      lay(map, this._details, "top-left"),
    );
    this._heard = false;
    this._show(0);
  }

  /** @param {any} message */
  receive({ alerts, ids, dropped, problem }) {
    if (problem !== undefined) return setText(this._problem, problem);
    for (const alert of alerts) this._set(alert);
    forgetOthers(this._known, new Set(ids), ({ row }) => row.element.remove());
    this._heard = true;
    this._show(dropped);
    this._signal();
  }

  /** @returns {Alert[]} The alerts that nobody has acknowledged. */
  _open() {
    return [...this._known.values()].map(({ alert }) => alert).filter(({ by }) => by === null);
  }

  /** @param {number[]} ids */
  _acknowledge(ids) {
    if (ids.length > 0) this._send({ acknowledge: ids });
  }

  /** @param {Alert} alert */
  _set(alert) {
    const row = this._known.get(alert.id)?.row ?? this._row(alert);
    this._known.set(alert.id, { alert, row });
    const list = alert.by === null ? this._new : this._old;
    if (row.element.parentElement !== list) {
      const focused = row.element.contains(document.activeElement);
      list.prepend(row.element);
      if (focused) this._details.querySelector("summary")?.focus();
    }
    row.show(alert);
  }

  /** @param {Alert} alert */
  _row({ id, robot }) {
    return new Row(
      () => this._send({ select: robot }),
      this._may ? () => this._acknowledge([id]) : null,
    );
  }

  /** @param {number} dropped */
  _show(dropped) {
    const open = this._open();
    setText(this._headline, headline(open, this._kinds, dropped));
    setText(this._badge, open.length > 0 ? `${open.length}` : "");
    this._badge.title = open.length === 1 ? "1 new alert" : `${open.length} new alerts`;
    setHidden(this._all, !this._may || open.length < 2);
    setHidden(this._oldHead, this._old.childElementCount === 0);
  }

  _signal() {
    if (!this._heard) return;
    const open = this._open();
    const due = pace.due(
      open.map(({ id }) => id),
      performance.now(),
    );
    const fresh = open.filter(({ id }) => due.includes(id));
    if (fresh.length === 0) return;
    const [first] = fresh;
    if (fresh.length === 1) this._signals.give(first.name, first.text);
    else this._signals.give("WebMap", headline(fresh, this._kinds));
  }
}

/** Outlines of the symbols: active, over. */
const ACTIVE = "M12 2.5L22.5 21h-21z";
const OVER = "M12 4.5a7.5 7.5 0 1 0 .01 0z";

/** One alert in the list. */
class Row {
  /**
   * @param {() => void} select
   * @param {(() => void) | null} acknowledge null if this viewer may not.
   */
  constructor(select, acknowledge) {
    this._outline = svg("path", { d: ACTIVE, class: "solid" });
    const shape = svg(
      "svg",
      { viewBox: "0 0 24 24", class: "webmap-symbol", "aria-hidden": "true" },
      this._outline,
      svg("path", { d: "M12 9v6M12 18v.1", class: "mark" }),
    );
    this._robot = button("webmap-one-line webmap-alert-robot", "", select);
    this._robot.title = "Select this robot";
    this._time = html("time", "webmap-muted webmap-alert-time");
    this._count = html("span", "webmap-muted webmap-alert-count");
    this._text = html("span", "webmap-alert-text");
    this._end = html("span", "webmap-muted webmap-alert-end");
    this._by = html("span", "webmap-muted webmap-alert-by");
    this._act = acknowledge && button("webmap-alert-act", "Acknowledge", acknowledge);
    this.element = html(
      "li",
      "webmap-item webmap-alert",
      {},
      shape,
      this._robot,
      html("p", "webmap-alert-words", {}, this._text, this._time, this._count, this._end),
      this._act ?? "",
      this._by,
    );
  }

  /** @param {Alert} alert */
  show({ name, text, began, ended, count, by, acknowledged }) {
    this.element.dataset.state = ended === null ? "active" : "over";
    this.element.dataset.tone = ended === null ? "bad" : "none";
    this._outline.setAttribute("d", ended === null ? ACTIVE : OVER);
    setText(this._robot, name);
    setText(this._time, clock(began, true));
    this._time.dateTime = new Date(began * 1000).toISOString();
    setText(this._text, text);
    setText(this._count, count > 1 ? `× ${count.toLocaleString("en")}` : "");
    setText(this._end, ended === null ? "" : `over after ${span(ended - began)}`);
    setText(this._by, by === null ? "" : `${by}, ${clock(acknowledged ?? 0)}`);
    if (this._act) {
      setHidden(this._act, by !== null);
      this._act.setAttribute("aria-label", `Acknowledge ${name}: ${text}`);
    }
  }
}
