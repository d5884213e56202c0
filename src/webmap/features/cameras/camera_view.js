import { CameraCell, signButton } from "./camera_cell.js";
import { readStored, store } from "../../web/stored.js";
import { html, setHidden, setText } from "../../web/tools/elements.js";

/** @typedef {import('./camera_cell.js').Camera} Camera */
/** @typedef {import('./camera_cell.js').RobotCameras} RobotCameras */
/** @typedef {import('./camera_cell.js').Target} Target */

/** @type {Record<Dock | 'wall' | 'full' | 'close', import('./camera_cell.js').Sign>} */
const SIGNS = {
  side: { label: "Beside the map", path: "M4 5h16v14H4zM10 5v14M4.5 12h5" },
  below: { label: "Above or below the map", path: "M4 5h16v14H4zM4 13h16M12 13.5v5" },
  float: {
    label: "Over the map: press again for the next corner",
    path: "M4 5h16v14H4zM11 11h6v5h-6z",
  },
  wall: { label: "Camera wall", path: "M4 5h7v6H4zM13 5h7v6h-7zM4 13h7v6H4zM13 13h7v6h-7z" },
  full: { label: "Full screen", path: "M14 4h6v6M20 4l-6.5 6.5M10 20H4v-6M4 20l6.5-6.5" },
  close: { label: "Close the camera", path: "M6 6l12 12M18 6L6 18" },
};

/** Most cameras of a wall. */
export const MOST = 4;

/** The visible elements of the camera's panel, and its buttons. */
export class CameraView {
  /**
   * @param {{
   *   choose: (id: number) => void, dock: (dock: Dock) => void, wall: () => void,
   *   full: () => void, close: () => void, add: () => void, seen: () => void,
   *   select: (robot: string) => void, put: (cell: CameraCell, id: number) => void,
   *   remove: (cell: CameraCell) => void,
   * }} acts
   */
  constructor(acts) {
    this._acts = acts;
    this._name = html("h2", "camera-name", { dir: "auto" });
    this._choice = html("div", "camera-choice", { role: "group", "aria-label": "Cameras" });
    this._age = html("span", "camera-age");
    /** @type {Map<string, HTMLButtonElement>} */
    this._docks = new Map();
    for (const dock of DOCKS) {
      this._docks.set(dock, signButton(dock, SIGNS[dock], () => acts.dock(dock)));
    }
    this._wall = signButton("wall", SIGNS.wall, () => acts.wall());
    this._full = signButton("full", SIGNS.full, () => acts.full());
    const places = html(
      "div",
      "camera-places",
      { role: "group", "aria-label": "Position of the camera picture" },
      ...this._docks.values(),
      this._wall,
      this._full,
      signButton("close", SIGNS.close, () => acts.close()),
    );
    this.head = html("div", "camera-head", {}, this._name, this._choice, this._age, places);
    this._add = html("button", "button camera-add", { type: "button" }, "Add camera");
    this._add.addEventListener("click", () => acts.add());
    this._grid = html("div", "camera-grid", {}, this._add);
    this.element = html("section", "camera-panel", {}, this.head, this._grid);
    this.element.hidden = true;
    /** @type {CameraCell[]} */
    this.cells = [];
    this._listed = "";
    this._observer = new IntersectionObserver((entries) => this._look(entries));
  }

  destroy() {
    this._observer.disconnect();
    for (const cell of this.cells) cell.restart();
    this.element.remove();
  }

  /**
   * @param {Target[]} targets What the cells show; none closes the panel.
   * @param {boolean} open
   * @param {Dock | 'full'} dock
   * @param {Camera[]} cameras Of the selected robot.
   * @param {RobotCameras[] | null} robots What the choosers of a wall list.
   */
  open(targets, open, dock, cameras, robots) {
    const wall = robots !== null;
    setHidden(this.element, !open);
    this.element.dataset.dock = dock;
    this.element.classList.toggle("wall", wall);
    this.element.setAttribute("aria-label", wall ? "Camera wall" : "Camera");
    this._fill(targets, wall);
    if (!open) return;
    targets.forEach((target, index) => this.cells[index].use(target, robots));
    for (const [which, button] of this._docks) {
      button.setAttribute("aria-pressed", String(which === dock));
    }
    this._wall.setAttribute("aria-pressed", String(wall));
    this._full.setAttribute("aria-pressed", String(dock === "full"));
    this._grid.dataset.cells = String(Math.min(MOST, targets.length + 1));
    setHidden(this._add, !wall || targets.length >= MOST);
    this._add.disabled = nextCamera(robots ?? [], targets, "") === null;
    const [{ name, label, camera }] = [...targets, { name: "", label: "", camera: null }];
    setText(this._name, wall ? "Cameras" : `${name}: ${label}`);
    setHidden(this._age, wall);
    setHidden(this._choice, wall || cameras.length < 2);
    if (!wall && camera) this._list(cameras, camera);
  }

  /**
   * Make as many cells as there are cameras. The cells of a wall keep their places.
   *
   * @param {Target[]} targets
   * @param {boolean} wall
   */
  _fill(targets, wall) {
    while (this.cells.length > targets.length) this.drop(this.cells[this.cells.length - 1]);
    while (this.cells.length < targets.length) {
      const cell = new CameraCell(this._acts);
      this.cells.push(cell);
      this._add.before(cell.element);
    }
    this._observer.disconnect();
    for (const cell of this.cells) {
      if (wall) this._observer.observe(cell.element);
      else cell.seen = true;
    }
  }

  /** @param {CameraCell} cell */
  drop(cell) {
    this.cells = this.cells.filter((other) => other !== cell);
    this._observer.unobserve(cell.element);
    cell.restart();
    cell.element.remove();
  }

  /** @param {IntersectionObserverEntry[]} entries */
  _look(entries) {
    let changed = false;
    for (const { target, isIntersecting } of entries) {
      const cell = this.cells.find(({ element }) => element === target);
      if (!cell || cell.seen === isIntersecting) continue;
      // The waiting time while the cell was out of view does not count.
      cell.restart();
      cell.seen = isIntersecting;
      changed = true;
    }
    if (changed) this._acts.seen();
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
        const attributes = { type: "button", "data-choice": String(id) };
        const button = html("button", "button", attributes, name);
        button.addEventListener("click", () => this._acts.choose(id));
        return button;
      });
      this._choice.replaceChildren(...buttons);
    }
    for (const button of this._choice.querySelectorAll("button")) {
      const pressed = button.dataset.choice === String(chosen.id);
      button.setAttribute("aria-pressed", String(pressed));
    }
  }

  /**
   * Show the ages.
   *
   * @param {string} selected The selected robot.
   * @param {(robot: string) => boolean} mine Whether this page has control of a robot.
   */
  look(selected, mine) {
    for (const cell of this.cells) {
      const { robot } = cell.target;
      cell.look(robot === selected, mine(robot));
    }
    setText(this._age, this.cells[0]?.age ?? "");
    this._age.classList.toggle("stale", this.cells[0]?.old === true);
  }
}

/**
 * @param {RobotCameras[]} robots
 * @param {Place} place
 * @returns {Target} The camera of a place of the wall: after a restart of the display it
 *     has another id, but the same names.
 */
export function cameraAt(robots, { robot, name, camera, id }) {
  const owner = robots.find((one) => one.robot === robot) ?? null;
  const named = owner?.cameras.filter((one) => one.name === camera) ?? [];
  const found = named.find((one) => one.id === id) ?? named.at(0) ?? null;
  return { robot, name: owner?.name ?? name, label: camera, camera: found };
}

/**
 * @param {RobotCameras[]} robots
 * @param {number} id
 * @returns {Place | null} The place of a wall that shows a camera.
 */
export function placeOf(robots, id) {
  for (const { robot, name, cameras } of robots) {
    const camera = cameras.find((one) => one.id === id);
    if (camera) return { robot, name, camera: camera.name, id };
  }
  return null;
}

/**
 * @param {RobotCameras[]} robots
 * @param {Target[]} targets The cameras of a wall.
 * @param {string} selected The selected robot.
 * @returns {Place | null} The camera to add: of the selected robot, of a robot without a
 *     camera on the wall, or any other one.
 */
export function nextCamera(robots, targets, selected) {
  const shown = new Set(targets.map(({ camera }) => camera?.id));
  const own = robots.filter(({ robot }) => robot === selected);
  const others = robots.filter(({ robot }) => targets.every((one) => one.robot !== robot));
  const first = [...own, ...others].flatMap(({ cameras }) => cameras.slice(0, 1));
  const all = [...first, ...robots.flatMap(({ cameras }) => cameras)];
  const next = all.find(({ id }) => !shown.has(id));
  return next ? placeOf(robots, next.id) : null;
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
 * @property {boolean} wall Whether the panel shows the wall.
 * @property {Place[]} cells The cameras of the wall.
 *
 * @typedef {object} Place A camera on the wall.
 * @property {string} robot
 * @property {string} name The name of the robot.
 * @property {string} camera The name of the camera.
 * @property {number} id
 */

const DOCKS = /** @type {const} */ (["side", "below", "float"]);

/** The position until the operator moves the panel. */
export const DEFAULTS = { dock: /** @type {const} */ ("side"), x: 0, y: 0 };

const KEY = "webmap.camera";

/** @returns {PanelState} The stored state, or the defaults. */
export function readState() {
  const stored = readStored(KEY);
  const part = (/** @type {unknown} */ value, /** @type {number} */ otherwise) =>
    typeof value === "number" && value >= 0 && value <= 1 ? value : otherwise;
  return {
    open: stored?.open === true,
    dock: DOCKS.includes(stored?.dock) ? stored.dock : "side",
    camera: typeof stored?.camera === "string" ? stored.camera : "",
    x: part(stored?.x, 0),
    y: part(stored?.y, 0),
    wall: stored?.wall === true,
    cells: Array.isArray(stored?.cells) ? stored.cells.filter(isPlace).slice(0, MOST) : [],
  };
}

/** @param {any} value */
function isPlace(value) {
  const texts = [value?.robot, value?.name, value?.camera];
  return texts.every((text) => typeof text === "string") && typeof value.id === "number";
}

/** @param {PanelState} kept */
export function storeState(kept) {
  store(KEY, kept);
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
