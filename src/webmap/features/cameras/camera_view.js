import { setHidden, setText } from "../../web/tools/elements.js";



/** @typedef {import('./camera_panel.js').Camera} Camera */
/** @typedef {import('./camera_panel.js').Cameras} Cameras */

const SVG = "http://www.w3.org/2000/svg";

/** @type {Record<Dock | 'close', {label: string, path: string}>} */
const SIGNS = {
  side: { label: "Beside the map", path: "M4 5h16v14H4zM10 5v14M4.5 12h5" },
  below: { label: "Above or below the map", path: "M4 5h16v14H4zM4 13h16M12 13.5v5" },
  float: {
    label: "Over the map: press again for the next corner",
    path: "M4 5h16v14H4zM11 11h6v5h-6z",
  },
  close: { label: "Close the camera", path: "M6 6l12 12M18 6L6 18" },
};

/** The visible elements of the camera's panel, and its buttons. */
export class CameraView {
  /**
   * @param {{
   *   choose: (id: number) => void, dock: (dock: Dock) => void, close: () => void,
   * }} acts
   */
  constructor(acts) {
    this._acts = acts;
    this._name = make("h2", "camera-name");
    this._choice = make("div", "camera-choice");
    this._choice.setAttribute("role", "group");
    this._choice.setAttribute("aria-label", "Cameras");
    this._age = make("span", "camera-age");
    const places = make("div", "camera-places");
    places.setAttribute("role", "group");
    places.setAttribute("aria-label", "Position of the camera picture");
    /** @type {Map<Dock, HTMLButtonElement>} */
    this._docks = new Map();
    for (const dock of DOCKS) {
      const button = signButton(dock, () => acts.dock(dock));
      this._docks.set(dock, button);
      places.append(button);
    }
    places.append(signButton("close", () => acts.close()));
    this.head = make("div", "camera-head");
    this.head.append(this._name, this._choice, this._age, places);
    this._message = make("p", "camera-word");
    this._message.setAttribute("role", "status");
    this._frame = make("div", "camera-frame");
    this._frame.append(this._message);
    this.element = make("section", "camera-panel");
    this.element.setAttribute("aria-label", "Camera");
    this.element.hidden = true;
    this.element.append(this.head, this._frame);
    this._listed = "";
  }

  /** @param {HTMLImageElement} image */
  show(image) {
    image.alt = this._alt;
    image.className = "camera-image";
    image.draggable = false;
    this._frame.querySelector("img")?.remove();
    this._frame.prepend(image);
  }

  clear() {
    this._frame.querySelector("img")?.remove();
  }

  get _alt() {
    return `Picture of ${this._name.textContent}`;
  }

  /**
   * @param {boolean} open
   * @param {Dock} dock
   * @param {Cameras} there
   * @param {Camera | null} camera
   */
  open(open, dock, there, camera) {
    setHidden(this.element, !open);
    if (!open || camera === null) return;
    this.element.dataset.dock = dock;
    this.element.dataset.robot = there.robot;
    setText(this._name, `${there.name}: ${camera.name}`);
    for (const [which, button] of this._docks) {
      button.setAttribute("aria-pressed", String(which === dock));
    }
    this._list(there.cameras, camera);
  }

  /**
   * @param {Camera[]} cameras
   * @param {Camera} chosen
   */
  _list(cameras, chosen) {
    const listed = JSON.stringify(cameras);
    if (listed !== this._listed) {
      this._listed = listed;
      const buttons = cameras.map(({ id, name }) => {
        const button = make("button", "button");
        button.type = "button";
        button.textContent = name;
        button.dataset.choice = String(id);
        button.addEventListener("click", () => this._acts.choose(id));
        return button;
      });
      this._choice.replaceChildren(...buttons);
      setHidden(this._choice, cameras.length < 2);
    }
    for (const button of this._choice.querySelectorAll("button")) {
      const pressed = button.dataset.choice === String(chosen.id);
      button.setAttribute("aria-pressed", String(pressed));
    }
  }

  /**
   * @param {number} age In ms; without a picture, the waiting time.
   * @param {boolean} shown Whether there is a picture.
   * @param {boolean} old
   * @param {boolean} mine Whether this page has control of the robot.
   */
  showAge(age, shown, old, mine) {
    this.element.classList.toggle("stale", old);
    setText(this._age, shown ? ageText(age) : "");
    // Whole seconds, so that a screen reader does not read ten values a second.
    const seconds = Math.floor(age / 1000);
    let words = "";
    if (!shown && !old) words = "Waiting for a picture.";
    else if (!shown) words = "No picture yet.";
    else if (old) words = seconds < 60 ? "Frozen." : "Frozen for over a minute.";
    if (old && mine) {
      words += " Commands are ignored: choose another camera or close this one.";
    }
    setText(this._message, words);
  }
}

/** @param {number} age */
function ageText(age) {
  const seconds = age / 1000;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  return seconds < 100 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;
}

/**
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {string} className
 */
function make(tag, className) {
  const element = document.createElement(tag);
  element.className = className;
  return element;
}

/**
 * @param {Dock | 'close'} what
 * @param {() => void} act
 */
function signButton(what, act) {
  const { label, path } = SIGNS[what];
  const button = make("button", `button square quiet camera-${what}`);
  button.type = "button";
  button.title = label;
  button.setAttribute("aria-label", label);
  const icon = document.createElementNS(SVG, "svg");
  icon.setAttribute("class", "icon");
  icon.setAttribute("viewBox", "0 0 24 24");
  icon.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(SVG, "path");
  line.setAttribute("d", path);
  icon.append(line);
  button.append(icon);
  button.addEventListener("click", act);
  return button;
}

/**
 * The position of the camera's panel, and the state that the browser stores.
 *
 * @typedef {'side' | 'below' | 'float'} Dock
 *
 * @typedef {object} PanelState
 * @property {boolean} open
 * @property {Dock} dock
 * @property {string} camera The name of the camera that was chosen last.
 * @property {number} x Position while floating: share of the free room, from 0 to 1.
 * @property {number} y
 */

const DOCKS = /** @type {const} */ (["side", "below", "float"]);

/** The position until the operator moves the panel. */
export const DEFAULTS = { dock: /** @type {const} */ ("side"), x: 0, y: 0 };

const KEY = "webmap.camera";

/** @returns {PanelState} The stored state, or the defaults. */
export function readState() {
  /** @type {any} */
  let stored = null;
  try {
    stored = JSON.parse(localStorage.getItem(KEY) ?? "null");
  } catch {
    // Not written by WebMap, or no storage: use the defaults.
  }
  const part = (/** @type {unknown} */ value, /** @type {number} */ otherwise) =>
    typeof value === "number" && value >= 0 && value <= 1 ? value : otherwise;
  return {
    open: stored?.open === true,
    dock: DOCKS.includes(stored?.dock) ? stored.dock : "side",
    camera: typeof stored?.camera === "string" ? stored.camera : "",
    x: part(stored?.x, 0),
    y: part(stored?.y, 0),
  };
}

/** @param {PanelState} kept */
export function storeState(kept) {
  try {
    localStorage.setItem(KEY, JSON.stringify(kept));
  } catch {
    // Without storage a reload restores the defaults.
  }
}

/**
 * Return the corner after the nearest corner, clockwise.
 *
 * @param {number} x
 * @param {number} y
 */
export function nextCorner(x, y) {
  if (y < 0.5) return x < 0.5 ? { x: 1, y: 0 } : { x: 1, y: 1 };
  return x < 0.5 ? { x: 0, y: 0 } : { x: 0, y: 1 };
}

/**
 * Least distance between a floating panel and other elements, or the map's top, in
 * pixels.
 */
const GAP = 12;
const TOOLS = 72;

/**
 * Return the free room for the top left corner of a floating panel over a map, between
 * all other elements.
 *
 * @param {Element} floating
 * @param {Element} over
 */
export function roomFor(floating, over) {
  const map = over.getBoundingClientRect();
  const { width, height } = floating.getBoundingClientRect();
  const tools = rectangle(".map-tools");
  const card = rectangle("#card");
  const teleop = rectangle(".webmap-teleop");
  const middle = (map.left + map.right) / 2;
  const left = Math.max(map.left, tools.left < middle ? tools.right : 0) + GAP;
  const ends = [card, tools].map((thing) => (thing.left > middle ? thing.left : Infinity));
  const right = Math.min(map.right, ...ends) - GAP;
  const top = map.top + TOOLS;
  const bottom = Math.min(map.bottom, teleop.top > top ? teleop.top : Infinity) - GAP;
  return {
    left,
    top,
    width: Math.max(0, right - left - width),
    height: Math.max(0, bottom - top - height),
  };
}

/**
 * @param {string} selector
 * @returns {{left: number, top: number, right: number}} Empty if the element is not
 *     shown.
 */
function rectangle(selector) {
  const element = document.querySelector(selector);
  const found = element?.getBoundingClientRect();
  if (!found || found.width === 0) return { left: Infinity, top: Infinity, right: 0 };
  return found;
}

/**
 * Let an element be dragged within its free room.
 *
 * @param {HTMLElement} handle The element to drag.
 * @param {() => boolean} wanted Whether it can be dragged now.
 * @param {() => {left: number, top: number, width: number, height: number}} room For
 *     its top left corner, in pixels.
 * @param {() => {left: number, top: number}} place The current position of that corner.
 * @param {(x: number, y: number) => void} move Takes shares of the room.
 * @param {AbortSignal} signal
 */
export function listenToDrags(handle, wanted, room, place, move, signal) {
  /** @type {{id: number, dx: number, dy: number} | null} */
  let drag = null;
  const on = (
    /** @type {'pointerdown' | 'pointermove' | 'pointerup' | 'pointercancel'} */ kind,
    /** @type {(event: PointerEvent) => void} */ fn,
  ) => handle.addEventListener(kind, fn, { signal });
  on("pointerdown", (event) => {
    if (!wanted() || !event.isPrimary) return;
    if (event.target instanceof Element && event.target.closest("button")) return;
    const { left, top } = place();
    drag = { id: event.pointerId, dx: event.clientX - left, dy: event.clientY - top };
    handle.setPointerCapture(event.pointerId);
  });
  on("pointermove", (event) => {
    if (drag?.id !== event.pointerId) return;
    const { left, top, width, height } = room();
    const part = (/** @type {number} */ value, /** @type {number} */ size) =>
      size > 0 ? Math.min(1, Math.max(0, value / size)) : 0;
    move(
      part(event.clientX - drag.dx - left, width),
      part(event.clientY - drag.dy - top, height),
    );
  });
  const end = () => (drag = null);
  on("pointerup", end);
  on("pointercancel", end);
}
