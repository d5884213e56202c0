import {
  cameraAt,
  CameraView,
  DEFAULTS,
  listenToDrags,
  MOST,
  nextCamera,
  nextCorner,
  placeOf,
  readState,
  roomFor,
  storeState,
} from "./camera_view.js";
import { CardVideos } from "./video_picture.js";
import { resolve } from "../../web/access.js";
import { devicesOf } from "../../web/inputs/devices.js";
import { closeSheet, setAttribute } from "../../web/tools/elements.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('./camera_view.js').Dock} Dock */

/** @typedef {{dock: Dock, x: number, y: number}} Place */
/** @typedef {import('./camera_cell.js').Camera} Camera */
/** @typedef {import('./camera_cell.js').CameraCell} CameraCell */
/** @typedef {import('./camera_cell.js').RobotCameras} RobotCameras */
/** @typedef {import('./camera_cell.js').Target} Target */
/** @typedef {{op: 'cameras'} & RobotCameras} Cameras Of the selected robot. */
/** @typedef {{op: 'robots', robots: RobotCameras[]}} Robots For the wall. */
/** @typedef {{op: 'picture', camera: number, url: string, stamp: number}} Picture */
/** @typedef {{op: 'video', camera: number, url: string}} Video */
/** @typedef {Cameras | Robots | Picture | Video} Message */

/** Milliseconds between two updates of the age. */
const PERIOD = 100;

/**
 * One camera of the selected robot, large, or a wall of cameras of several robots. An
 * operator who drives a robot while its camera is shown here relies on it: when its
 * picture is stale the robot stops. Of several cameras of a robot the oldest counts.
 *
 * @param {MapCanvas} map
 * @param {object} _options
 * @param {(message: Record<string, unknown>) => void} send
 */
export default function attach(map, _options, send) {
  return new CameraPanel(map, send);
}

class CameraPanel {
  /**
   * @param {MapCanvas} map
   * @param {(message: Record<string, unknown>) => void} send
   */
  constructor(map, send) {
    this._map = map;
    this._send = send;
    this._kept = readState();
    /** @type {Cameras} */
    this._there = { op: "cameras", robot: "", name: "", cameras: [] };
    /** @type {Camera | null} */
    this._camera = null;
    /** @type {RobotCameras[]} All robots with cameras, while there is a wall. */
    this._robots = [];
    /** Whether a new wall waits for its first cameras. */
    this._fresh = false;
    /** Whether the panel fills the window, below the bar with STOP. */
    this._full = false;
    /** What the display was asked for. */
    this._asked = "";
    this._goesBy = () => {};
    /** @type {Map<number, string>} The addresses of the videos, by camera. */
    this._videos = new Map();
    this._cards = new CardVideos(() => map.clock);
    this._view = new CameraView({
      choose: (id) => this.choose(id),
      dock: (dock) => this._dock(dock),
      wall: () => this._turnWall(),
      full: () => this._turnFull(),
      close: () => this._close(),
      add: () => this._add(nextCamera(this._robots, this._targets, this._there.robot)),
      seen: () => this._rely(),
      select: (robot) => this._send({ op: "select", robot }),
      put: (cell, id) =>
        this._put(this._view.cells.indexOf(cell), placeOf(this._robots, id)),
      remove: (cell) => this._remove(cell),
    });
    this._ending = new AbortController();
    const { signal } = this._ending;
    const changed = () => {
      this._watch();
      this._look();
    };
    document.addEventListener("visibilitychange", changed, { signal });
    document.addEventListener("click", (event) => this._clicked(event), { signal });
    window.addEventListener("resize", () => this._place(), { signal });
    listenToFullScreen(map.drive, () => this._full, () => this._setFull(false), signal);
    listenToDrags(
      this._view.head,
      () => this._kept.dock === "float" && !this._full,
      () => roomFor(this._view.element, map.svg),
      () => this._view.element.getBoundingClientRect(),
      (x, y) => this._float(x, y),
      signal,
    );
    this._timer = setInterval(() => this._look(), PERIOD);
    // Whether the panel is open is not part of the layout, because an operator who
    // drives with it open relies on it.
    this._leave = map.layout.add("camera", {
      read: () => ({ dock: this._kept.dock, x: this._kept.x, y: this._kept.y }),
      write: (place) => this._move(place),
      reset: () => this._move(DEFAULTS),
    });
    this._offEscape = devicesOf(map.drive).claimEscape(() => this._setFull(false));
    this._show();
  }

  destroy() {
    this._setFull(false);
    this._ending.abort();
    this._leave();
    this._offEscape();
    clearInterval(this._timer);
    this._goesBy();
    this._cards.destroy();
    this._view.destroy();
    delete document.body.dataset.camera;
    delete document.body.dataset.cameraWall;
  }

  /** @param {Message} message */
  receive(message) {
    if (message.op === "cameras") this._take(message);
    else if (message.op === "robots") this._takeAll(message.robots);
    else if (message.op === "video") {
      this._videos.set(message.camera, message.url);
      this._look();
    } else {
      const { clock } = this._map;
      const age = clock === null ? 0 : 1000 * (clock - message.stamp);
      const url = resolve(message.url, document.baseURI);
      if (url === null) return;
      for (const { target, picture } of this._view.cells) {
        if (target.camera?.id === message.camera) picture.offer(url, age);
      }
    }
  }

  /** @param {Cameras} there */
  _take(there) {
    const same = there.robot === this._there.robot;
    this._there = there;
    // Request again, as a reconnected page must: the display sends the current state.
    this._asked = "";
    const { cameras } = there;
    const chosen = same && cameras.find(({ id }) => id === this._camera?.id);
    const named = cameras.find(({ name }) => name === this._kept.camera);
    this._camera = chosen || named || cameras.at(0) || null;
    if (!this._open) this._setFull(false);
    this._show();
  }

  /** @param {RobotCameras[]} robots */
  _takeAll(robots) {
    this._robots = robots;
    while (this._fresh && this._kept.cells.length < 2) {
      const next = nextCamera(robots, this._targets, this._there.robot);
      if (next === null) break;
      this._kept.cells.push(next);
    }
    this._fresh = false;
    this._asked = "";
    this._change({});
  }

  /**
   * Show a camera alone, and open its panel.
   *
   * @param {number} id
   */
  choose(id) {
    const camera = this._there.cameras.find((one) => one.id === id);
    if (!camera) return;
    this._camera = camera;
    this._change({ open: true, wall: false, camera: camera.name });
  }

  /**
   * Change what the browser stores, and show it.
   *
   * @param {Partial<import('./camera_view.js').PanelState>} changes
   */
  _change(changes) {
    Object.assign(this._kept, changes);
    storeState(this._kept);
    this._show();
  }

  get _open() {
    return this._kept.open && (this._kept.wall || this._camera !== null);
  }

  /** @returns {Target[]} What the cells show. */
  get _targets() {
    if (!this._open) return [];
    const { wall, cells } = this._kept;
    if (wall) return cells.map((place) => cameraAt(this._robots, place));
    const { robot, name } = this._there;
    return [{ robot, name, label: this._camera?.name ?? "", camera: this._camera }];
  }

  _close() {
    this._setFull(false);
    this._change({ open: false });
    cardButton(this._camera?.id)?.focus();
  }

  _turnWall() {
    const wall = !(this._open && this._kept.wall);
    this._fresh = wall && this._kept.cells.length === 0;
    if (!wall && this._camera === null) this._close();
    this._change({ wall, ...(wall && { open: true }) });
  }

  /** @param {import('./camera_view.js').Place | null} place */
  _add(place) {
    if (place) this._change({ cells: [...this._kept.cells, place].slice(0, MOST) });
  }

  /**
   * @param {number} index
   * @param {import('./camera_view.js').Place | null} place
   */
  _put(index, place) {
    if (place === null) return;
    const cells = this._kept.cells.map((one, at) => (at === index ? place : one));
    this._change({ cells });
  }

  /** @param {CameraCell} cell */
  _remove(cell) {
    const index = this._view.cells.indexOf(cell);
    this._view.drop(cell);
    this._change({ cells: this._kept.cells.filter((_, at) => at !== index) });
  }

  _turnFull() {
    // Without a selected robot there are only the cameras of the wall.
    if (!this._open && this._camera === null) this._turnWall();
    this._kept.open = true;
    this._setFull(!this._full);
  }

  /**
   * Let the panel fill the window below the bar, where STOP stays, and the window fill
   * the screen.
   *
   * @param {boolean} full
   * @returns {boolean} Whether that is a change.
   */
  _setFull(full) {
    if (full === this._full) return false;
    this._full = full;
    this._change({});
    if (full) void fillScreen();
    else if (document.fullscreenElement) void document.exitFullscreen();
    return true;
  }

  /** @param {Dock} dock */
  _dock(dock) {
    const { dock: before, x, y } = this._kept;
    if (dock === "float" && before === "float") {
      // Without a pointer the panel moves from corner to corner.
      if (!this._full) Object.assign(this._kept, nextCorner(x, y));
    }
    this._setFull(false);
    this._move({ ...this._kept, dock });
  }

  /** @param {Place} place */
  _move({ dock, x, y }) {
    this._change({ dock, x, y });
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  _float(x, y) {
    Object.assign(this._kept, { x, y });
    storeState(this._kept);
    this._place();
  }

  /** @param {MouseEvent} event */
  _clicked({ target }) {
    if (!(target instanceof Element)) return;
    const button = target.closest("[data-camera-id]");
    if (!(button instanceof HTMLElement)) return;
    const id = Number(button.dataset.cameraId);
    const cell = this._view.cells.find((one) => one.target.camera?.id === id);
    if (this._open && this._kept.wall) {
      if (cell) this._remove(cell);
      else if (this._kept.cells.length < MOST) this._add(placeOf([this._there], id));
      else this._put(MOST - 1, placeOf([this._there], id));
    } else if (cell) this._close();
    else this.choose(id);
    closeSheet();
  }

  _show() {
    const open = this._open;
    const { wall, dock: kept } = this._kept;
    const dock = this._full ? "full" : kept;
    const { element } = this._view;
    if (open) document.body.dataset.camera = dock;
    else delete document.body.dataset.camera;
    document.body.toggleAttribute("data-camera-wall", open && wall);
    const robots = wall ? this._robots : null;
    this._view.open(this._targets, open, dock, this._there.cameras, robots);
    // Over the map, but below the panels for driving and STOP.
    const over = dock === "float" || dock === "full";
    const before = over ? this._map.svg : this._map.svg.parentElement;
    if (before?.nextElementSibling !== element) before?.after(element);
    this._rely();
    this._place();
    this._look();
  }

  /** Note that the operator relies on the pictures in view, and request these. */
  _rely() {
    this._goesBy();
    const counting = this._view.cells.filter(({ counts }) => counts);
    const offs = [...new Set(counting.map(({ target }) => target.robot))].map((robot) => {
      const own = counting.filter(({ target }) => target.robot === robot);
      const age = () => Math.max(...own.map(({ picture }) => picture.age));
      return this._map.drive.goBy(robot, age);
    });
    this._goesBy = () => offs.forEach((off) => off());
    this._watch();
  }

  /** Request pictures while the panel is visible. */
  _watch() {
    const seen = this._open && document.visibilityState === "visible";
    const counting = seen ? this._view.cells.filter(({ counts }) => counts) : [];
    const cameras = counting.map(({ target }) => target.camera?.id);
    const message = { op: "watch", cameras, wall: this._open && this._kept.wall };
    const asked = JSON.stringify(message);
    if (asked === this._asked) return;
    this._asked = asked;
    this._send(message);
  }

  _look() {
    const shown = this._view.cells.map(({ target }) => target.camera?.id);
    for (const button of document.querySelectorAll("button[data-camera-id]")) {
      const large = shown.includes(Number(button.getAttribute("data-camera-id")));
      setAttribute(button, "aria-pressed", String(large));
    }
    this._cards.look();
    const seen = document.visibilityState === "visible";
    for (const cell of this._view.cells) {
      const id = seen && cell.counts ? cell.target.camera?.id : undefined;
      cell.play(this._videos.get(id ?? -1) ?? null, () => this._map.clock);
    }
    const { robots } = this._map.drive;
    this._view.look(this._there.robot, (robot) => robots.get(robot)?.mine === true);
  }

  _place() {
    const { style } = this._view.element;
    if (!this._open || this._full || this._kept.dock !== "float") {
      style.removeProperty("left");
      style.removeProperty("top");
      return;
    }
    const { element } = this._view;
    const { left, top, width, height } = roomFor(element, this._map.svg);
    style.left = `${left + this._kept.x * width}px`;
    style.top = `${top + this._kept.y * height}px`;
  }
}

/** @param {number | undefined} id */
function cardButton(id) {
  const button = document.querySelector(`[data-camera-id="${id}"]`);
  return button instanceof HTMLElement ? button : null;
}

/** Fill the screen. The browser may refuse that: the panel fills the window anyway. */
async function fillScreen() {
  const { keyboard } = /** @type {any} */ (navigator);
  try {
    await document.documentElement.requestFullscreen();
    // Escape is STOP, so the page needs it; some browsers leave it to the page.
    await keyboard?.lock(["Escape"]);
  } catch {
    // Not allowed, or not available: Escape then comes as the end of the full screen.
  }
}

/**
 * Treat the end of the full screen like Escape, which the browser may have used for it
 * and not passed on: a driven robot stops, otherwise the panel is small again.
 *
 * @param {import('../../web/drive.js').Drive} drive
 * @param {() => boolean} full Whether the panel fills the window.
 * @param {() => void} leave
 * @param {AbortSignal} signal
 */
function listenToFullScreen(drive, full, leave, signal) {
  let shift = false;
  const key = (/** @type {KeyboardEvent} */ { shiftKey }) => (shift = shiftKey);
  document.addEventListener("keydown", key, { signal, capture: true });
  document.addEventListener("keyup", key, { signal, capture: true });
  const changed = () => {
    if (document.fullscreenElement || !full()) return;
    const { driven, taking, choice } = drive.status;
    if (shift) drive.stop("*");
    else if (driven !== null || taking) drive.stop(driven ?? choice ?? "*");
    else leave();
  };
  document.addEventListener("fullscreenchange", changed, { signal });
}
