import { byId, html, setHidden, setText } from "../web/tools/elements.js";

/**
 * The command palette: one field that finds robots, STOP and other commands, tools,
 * layers, places and settings, and does what the line says. Each entry presses the
 * button that the page has for it, so that the palette can do nothing that the page
 * cannot: STOP is sent as by its button, and Reset waits for its second press.
 */

/** @typedef {import('../web/drive.js').Drive} Drive */
/** @typedef {{kind: string, name: string, state?: string, act: () => void}} Entry */

/** The most lines that are shown. */
const MOST = 12;

const STOP = "STOP";

/**
 * Buttons of the page, by kind; hidden and disabled ones are left out. STOP is last, so
 * that Enter without a text does not press it.
 */
const BUTTONS = /** @type {const} */ ([
  ["Robot", "#robots > .row > button", ".name"],
  ["Selected robot", "#card :is(.actions, .card-buttons) button", ""],
  ["Selected robot", "#card [data-act=follow]", ""],
  ["Selected robots", ".webmap-several > button:not(.webmap-stop-button)", ""],
  ["Camera", "#card [data-camera-id]", ".camera-title"],
  ["Camera", ".camera-panel :is(.camera-wall, .camera-full)", ""],
  ["Control", ".webmap-teleop-acts button", ""],
  ["Tool", ".tools .webmap-tool-go", ".webmap-tool-name"],
  ["Layer", ".webmap-layers-row", "span"],
  ["View", ".map-tools button", ""],
  ["Setting", ".webmap-export-menu button", ""],
  ["Setting", "#panel-turn, #help-open", ""],
  [STOP, ".webmap-teleop-stop", ""],
  [STOP, ".webmap-several-stop", ""],
  [STOP, ".webmap-stop-all", ""],
  ["All robots", ".webmap-stop-row button", ""],
]);

/**
 * @param {Drive} drive
 * @param {AbortSignal} signal
 */
export function listenToPalette(drive, signal) {
  const palette = new Palette(drive);
  const turn = () => palette.turn();
  byId("palette-open").addEventListener("click", turn, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key.toLowerCase() !== "k" || !(event.ctrlKey || event.metaKey)) return;
    event.preventDefault();
    turn();
  };
  document.addEventListener("keydown", key, { signal });
  const outside = (/** @type {PointerEvent} */ { target }) => {
    const own = target instanceof Element && target.closest("#palette, #palette-open");
    if (!own) palette.close();
  };
  document.addEventListener("pointerdown", outside, { signal });
  return drive.on("stop", () => palette.close());
}

class Palette {
  /** @param {Drive} drive */
  constructor(drive) {
    this._drive = drive;
    this._dialog = /** @type {HTMLDialogElement} */ (byId("palette"));
    this._field = /** @type {HTMLInputElement} */ (byId("palette-field"));
    this._list = byId("palette-list");
    /** @type {Entry[]} */
    this._entries = [];
    /** @type {Entry[]} */
    this._found = [];
    this._current = 0;
    /** @type {Element | null} */
    this._from = null;
    this._field.addEventListener("input", () => this._find());
    this._field.addEventListener("keydown", (event) => this._key(event));
  }

  turn() {
    if (this._dialog.open) this.close();
    else this._open();
  }

  _open() {
    this._drive.goNeutral();
    this._from = document.activeElement;
    document.dispatchEvent(new Event("webmap-find"));
    this._entries = entries();
    this._field.value = "";
    this._dialog.show();
    this._field.focus();
    this._find();
  }

  close() {
    if (!this._dialog.open) return;
    this._dialog.close();
    if (this._from instanceof HTMLElement) this._from.focus({ preventScroll: true });
  }

  _find() {
    this._found = matching(this._entries, this._field.value).slice(0, MOST);
    this._current = 0;
    const lines = this._found.map((entry, index) => {
      const line = html(
        "li",
        "palette-line",
        { role: "option", id: `palette-${index}` },
        html("span", "palette-kind", {}, entry.kind),
        html("span", "palette-name", {}, entry.name),
        html("span", "palette-state", {}, entry.state ?? ""),
      );
      line.addEventListener("click", () => this._do(entry));
      return line;
    });
    this._list.replaceChildren(...lines);
    setHidden(this._list, lines.length === 0);
    setText(byId("palette-none"), lines.length > 0 ? "" : "Nothing on this page has this name.");
    this._mark();
  }

  _mark() {
    const lines = [...this._list.querySelectorAll(".palette-line")];
    lines.forEach((line, index) => {
      line.setAttribute("aria-selected", `${index === this._current}`);
    });
    lines[this._current]?.scrollIntoView({ block: "nearest" });
    if (lines.length > 0) {
      this._field.setAttribute("aria-activedescendant", `palette-${this._current}`);
    } else this._field.removeAttribute("aria-activedescendant");
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const count = this._found.length;
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by !== undefined && count > 0) {
      event.preventDefault();
      this._current = (this._current + by + count) % count;
      this._mark();
    } else if (event.key === "Enter" && count > 0) {
      event.preventDefault();
      this._do(this._found[this._current]);
    } else if (event.key === "Escape") {
      event.preventDefault();
      event.stopPropagation();
      this.close();
    }
  }

  /** @param {Entry} entry */
  _do(entry) {
    this.close();
    entry.act();
  }
}

/**
 * @param {Entry[]} all
 * @param {string} text
 * @returns {Entry[]} The entries that have every word of the text in their kind or
 *     name; those whose name begins with the text are first, and STOP before them.
 */
export function matching(all, text) {
  const wanted = text.trim().toLowerCase();
  const words = wanted.split(/\s+/).filter(Boolean);
  const found = all.filter(({ kind, name }) => {
    const in_ = `${kind} ${name}`.toLowerCase();
    return words.every((word) => in_.includes(word));
  });
  if (wanted === "") return found;
  const rank = (/** @type {Entry} */ { kind, name }) => {
    if (!name.toLowerCase().startsWith(wanted)) return 2;
    return kind === STOP ? 0 : 1;
  };
  return found.sort((one, other) => rank(one) - rank(other));
}

/** @returns {Entry[]} Everything that the page has now. */
function entries() {
  /** @type {Entry[]} */
  const all = [];
  for (const [kind, selector, part] of BUTTONS) {
    for (const element of document.querySelectorAll(selector)) {
      const name = nameOf(element, part);
      if (name === "" || !usable(element)) continue;
      const words = element.querySelector(".state");
      all.push({ kind, name, state: words ? textOf(words) : "", act: () => press(element) });
    }
  }
  for (const label of document.querySelectorAll(".labels > .label")) {
    const name = label.getAttribute("data-name") ?? "";
    if (name === "") continue;
    const act = () => {
      label.dispatchEvent(new MouseEvent("click", { bubbles: true }));
    };
    all.push({ kind: "Place", name, act });
  }
  return all;
}

/**
 * @param {Element} element
 * @param {string} part A selector of the part that has the name.
 */
function nameOf(element, part) {
  const named = part === "" ? element : element.querySelector(part);
  const label = element.getAttribute("aria-label");
  return (part === "" && label) || (named && textOf(named).trim()) || label || "";
}

/**
 * @param {Element} element
 * @returns {string} Its text without parts that are switched off, also where a folded
 *     panel contains it.
 */
function textOf(element) {
  const texts = [...element.childNodes].map((node) => {
    if (!(node instanceof Element)) return node.textContent ?? "";
    return isOff(node) ? "" : textOf(node);
  });
  return texts.join("");
}

/** @param {Element} element */
function isOff(element) {
  return getComputedStyle(element).display === "none";
}

/** @param {Element} element */
function usable(element) {
  if (element instanceof HTMLButtonElement && element.disabled) return false;
  if (isOff(element)) return false;
  // Some buttons open what they are in.
  return element.closest("[hidden]:not(.webmap-export-menu, .camera-panel)") === null;
}

/** @param {Element} element */
function press(element) {
  if (!(element instanceof HTMLElement)) return;
  element.click();
  const row = element.closest("#robots > .row");
  if (!row) element.focus({ preventScroll: true });
}
