import { devicesOf } from "../../web/inputs/devices.js";
import { scaleOf } from "../../web/view.js";
import { button, html, setHidden, setText } from "../../web/tools/elements.js";
import { LabelMove } from "./labels_move.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { claimPresses, showNote, tool, toolName } from "../../web/tools/tool.js";

/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */

/** @typedef {{editable?: boolean, key?: string, icons?: string[], longest?: number}} Options */
/** @typedef {(message: Record<string, unknown>) => void} Send */

/**
 * Labels: keep them upright, send a robot to a pressed label, add, move and remove
 * labels.
 *
 * Options: `editable`, whether this page may edit; `key`, which begins to add a label;
 * `icons` to choose from; `longest`, the greatest length of a name in characters.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new Labels(map, options, send);
}

class Labels {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { editable = false, key = "l", icons = ["pin"], longest = 60 }, send) {
    this._map = map;
    this._send = send;
    this._editable = editable;
    this._key = key;
    this._icons = icons;
    this._longest = longest;
    this._active = false;
    /** @type {SVGGraphicsElement | null} The label whose sheet is open. */
    this._chosen = null;
    /** @type {LabelMove | null} */
    this._move = null;
    this._go = button("webmap-labels-go", "", () => this._activate(!this._active));
    this._go.append(...toolName("label", "Label"));
    this._go.title = `Add a label (${key.toUpperCase()})`;
    setHidden(this._go, !editable);
    this._message = html("span", "webmap-labels-word", { role: "status" });
    this._sheet = html("div", "webmap-labels-sheet");
    this._panel = tool("webmap-labels", "Labels", this._go, this._message, this._sheet);
    this._ending = new AbortController();
    this._listen();
    this.destroy = endOf(
      () => claimPresses(map.svg, "labels", false),
      () => this._close(""),
      () => this._ending.abort(),
      fitLabels(map),
      lay(map, this._panel, "top-left"),
      devicesOf(map.drive).claimEscape(() => this._leave()),
      map.onSelect(() => this._refresh()),
    );
    this._activate(false);
  }

  /** @param {{done?: boolean, refused?: string}} message */
  receive({ done, refused }) {
    if (done) {
      this._move?.accepted();
      this._close("");
    }
    if (typeof refused === "string") setText(this._message, refused);
    this._fit();
  }

  _listen() {
    const { signal } = this._ending;
    const first = { signal, capture: true };
    const { svg: root } = this._map;
    // Before the map's own listener, which would deselect the robot.
    root.addEventListener("click", (event) => this._clicked(event), first);
    root.addEventListener("keydown", (event) => this._pressed(event), first);
    const turn = () => this._editable && this._activate(!this._active);
    devicesOf(this._map.drive).listenToTool(this._map, this._key, turn, signal);
    const leave = (/** @type {KeyboardEvent} */ { key }) => key === "Escape" && this._leave();
    this._panel.addEventListener("keydown", leave, { signal });
  }

  /** @param {KeyboardEvent} event Enter, on a label that has the focus. */
  _pressed(event) {
    const label = labelOf(event.target);
    if (!label || event.key !== "Enter") return;
    event.stopPropagation();
    this._open(label);
  }

  /** @param {MouseEvent} event */
  _clicked(event) {
    const label = labelOf(event.target);
    if (this._active) {
      event.stopPropagation();
      this._openNew(this._map.worldOf(event));
    } else if (label) {
      event.stopPropagation();
      this._open(label);
    }
  }

  /** @param {boolean} active */
  _activate(active) {
    this._close("");
    this._active = active && this._editable;
    this._go.setAttribute("aria-pressed", String(this._active));
    claimPresses(this._map.svg, "labels", this._active);
    setText(this._message, this._active ? "Press on the map where the label goes." : "");
    this._fit();
  }

  /** @returns {boolean} Whether the tool was active. */
  _leave() {
    if (!this._active && this._sheet.hidden) return false;
    this._activate(false);
    return true;
  }

  /** @param {string} words */
  _close(words) {
    this._move?.destroy();
    this._move = null;
    this._chosen?.classList.remove("chosen");
    this._chosen = null;
    this._sheet.replaceChildren();
    this._sheet.hidden = true;
    setText(this._message, words);
    this._fit();
  }

  /** Take no room on the map while the panel is empty. */
  _fit() {
    this._panel.hidden =
      Boolean(this._go.hidden) && Boolean(this._sheet.hidden) && !this._message.textContent;
  }

  /** @param {SVGGraphicsElement} label */
  _open(label) {
    this._close("");
    this._chosen = label;
    label.classList.add("chosen");
    this._sheet.hidden = false;
    this._refresh();
    this._fit();
    this._sheet.querySelector("button")?.focus({ preventScroll: true });
  }

  /** Show the possible actions on the chosen label. */
  _refresh() {
    const label = this._chosen;
    if (!label || this._move) return;
    const title = html("p", "title wide", {}, label.dataset.name ?? "");
    const send = button("webmap-labels-send wide", "Send goal here", () => {
      void this._sendRobot(label);
    });
    const { selected } = this._map;
    send.disabled = selected === null;
    if (selected === null) send.textContent = "Select a robot to send a goal here";
    const close = button("webmap-labels-close", "Close", () => this._close(""));
    const remove = button("webmap-labels-remove", "Delete", () => {
      this._send({ remove: label.dataset.label ?? "" });
    });
    const move = button("webmap-labels-move wide", "Move", () => this._openMove(label));
    const fixed = !this._editable || label.dataset.kept !== "true";
    for (const each of [remove, move]) setHidden(each, fixed);
    this._sheet.replaceChildren(title, send, move, close, remove);
  }

  /** @param {SVGGraphicsElement} label */
  _openMove(label) {
    const place = placeOf(label);
    if (!place) return;
    setText(this._message, "Drag the label on the map or enter its position.");
    this._move = new LabelMove(this._map, label, place, (to) => {
      if (to) this._send({ move: label.dataset.label ?? "", to });
      else this._close("");
    });
    const title = html("p", "title wide", {}, label.dataset.name ?? "");
    this._sheet.replaceChildren(title, ...this._move.fields);
    this._fit();
    this._move.focus();
  }

  /** @param {{x: number, y: number}} place In metres. */
  _openNew(place) {
    this._activate(false);
    const name = html("input", "", {
      type: "text",
      maxlength: String(this._longest),
      autocomplete: "off",
    });
    const icon = html("select", "");
    for (const each of this._icons) icon.append(html("option", "", { value: each }, each));
    const save = () => {
      const add = { name: name.value, icon: icon.value, x: place.x, y: place.y };
      if (name.value.trim()) this._send({ add });
      else setText(this._message, "Enter a name for the label.");
    };
    name.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && !event.isComposing) save();
    });
    const cancel = button("webmap-labels-cancel", "Cancel", () => this._close(""));
    const keep = button("webmap-labels-save", "Save", save);
    this._sheet.hidden = false;
    this._sheet.replaceChildren(
      html("label", "webmap-field", {}, "Name", name),
      html("label", "webmap-field", {}, "Icon", icon),
      cancel,
      keep,
    );
    this._fit();
    name.focus({ preventScroll: true });
  }

  /** @param {SVGGraphicsElement} label */
  async _sendRobot(label) {
    const robot = this._map.selected;
    const place = placeOf(label);
    if (robot === null || !place) return;
    const given = Number.parseFloat(label.dataset.yaw ?? "");
    const yaw = Number.isFinite(given) ? given : this._wayTo(robot, place);
    try {
      await this._map.drive.goal(robot, { ...place, yaw });
      this._send({ goal: { robot, ...place, yaw } });
      this._close(`Goal sent to ${label.dataset.name ?? "the label"}.`);
    } catch (error) {
      const why = error instanceof Error ? error.message : error;
      showNote(this._message, `Goal not sent: ${why}`, this._map.drive, [robot]);
      this._fit();
    }
  }

  /**
   * @param {string} robot
   * @param {{x: number, y: number}} place
   * @returns {number} The heading of the robot's arrival at the place.
   */
  _wayTo(robot, place) {
    const element = this._map.world.querySelector(`[data-robot="${CSS.escape(robot)}"]`);
    if (element) this._map.crowd.draw(element);
    const from = element instanceof SVGGraphicsElement ? placeOf(element) : null;
    return from ? Math.atan2(place.y - from.y, place.x - from.x) : 0;
  }
}

/**
 * @param {EventTarget | null} target
 * @returns {SVGGraphicsElement | null}
 */
function labelOf(target) {
  const label = target instanceof Element ? target.closest(".labels > .label") : null;
  return label instanceof SVGGraphicsElement ? label : null;
}

/**
 * @param {SVGGraphicsElement} element Of the world.
 * @returns {{x: number, y: number} | null} Its position, in metres.
 */
function placeOf(element) {
  const list = element.transform.baseVal;
  const matrix = list.numberOfItems > 0 ? list.getItem(0).matrix : null;
  return matrix && { x: matrix.e, y: matrix.f };
}

/** @typedef {{x: number, y: number, across: number}} Name */

/** BrowserPart the height of a name with its spot, in pixels. */
const HEIGHT = 46;

/**
 * Choose which names are shown, so that no name covers another.
 *
 * @param {Name[]} names Their positions on the screen and their widths, in pixels;
 *     earlier names have priority.
 * @returns {boolean[]} For each name, whether there is no room.
 */
export function namesWithoutRoom(names) {
  /** @type {Name[]} */
  const shown = [];
  return names.map((name) => {
    const hit = shown.some(
      (other) =>
        Math.abs(name.x - other.x) < (name.across + other.across) / 2 + 4 &&
        Math.abs(name.y - other.y) < HEIGHT,
    );
    if (!hit) shown.push(name);
    return hit;
  });
}

/**
 * Keep labels upright and at a constant size in every view, and keep names from
 * covering one another.
 *
 * @param {MapCanvas} map
 * @returns {() => void} Ends the updates.
 */
function fitLabels(map) {
  let frame = 0;
  const look = () => {
    frame = 0;
    const { a, b } = map.view;
    const { style } = map.svg;
    style.setProperty("--label-size", (1 / scaleOf(map.view)).toPrecision(6));
    style.setProperty("--label-turn", `${Math.atan2(b, a).toFixed(5)}rad`);
    const labels = [...map.world.querySelectorAll(".labels > .label")];
    const names = labels.map((label) => {
      const m = label instanceof SVGGraphicsElement ? label.getCTM() : null;
      const text = label.querySelector(".name");
      const across = text instanceof SVGTextElement ? text.getComputedTextLength() : 0;
      return { x: m?.e ?? 0, y: m?.f ?? 0, across: Math.max(across, 30) };
    });
    namesWithoutRoom(names).forEach((hit, i) => labels[i].classList.toggle("crowded", hit));
  };
  const soon = () => {
    if (frame === 0) frame = requestAnimationFrame(look);
  };
  const off = map.onView(soon);
  const observer = new MutationObserver((records) => {
    const among = (/** @type {Node} */ node) =>
      node instanceof Element && node.closest(".labels") !== null;
    if (records.some(({ target }) => among(target))) soon();
  });
  observer.observe(map.world, { childList: true, subtree: true });
  look();
  return () => {
    cancelAnimationFrame(frame);
    observer.disconnect();
    off();
    map.svg.style.removeProperty("--label-size");
    map.svg.style.removeProperty("--label-turn");
  };
}
