import {
  CameraView,
  DEFAULTS,
  listenToDrags,
  nextCorner,
  readState,
  roomFor,
  storeState,
} from "./camera_view.js";
import { resolve } from "../../web/access.js";
import { closeSheet } from "../../web/tools/elements.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('./camera_view.js').Dock} Dock */

/** @typedef {{dock: Dock, x: number, y: number}} Place */
/** @typedef {{id: number, name: string}} Camera */
/** @typedef {{op: 'cameras', robot: string, name: string, cameras: Camera[]}} Cameras */
/** @typedef {{op: 'picture', camera: number, url: string, stamp: number}} Picture */

/** Milliseconds between two updates of the age. */
const PERIOD = 100;

/** Milliseconds after which a picture is stale; the gate also stops at this age. */
const OLD = 1000;

/**
 * One camera of the selected robot, large. An operator who drives the robot while the
 * panel is open relies on it: when its picture is stale the robot stops.
 *
 * @param {MapCanvas} map
 * @param {object} _options
 * @param {(message: Record<string, unknown>) => void} send
 */
export default function attach(map, _options, send) {
  const panel = new CameraPanel(map, send);
  return {
    receive: (/** @type {Cameras | Picture} */ message) => panel.receive(message),
    destroy: () => panel.destroy(),
  };
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
    /** @type {number | null} The camera that the display was asked for. */
    this._watched = null;
    this._goesBy = () => {};
    this._view = new CameraView({
      choose: (id) => this.choose(id),
      dock: (dock) => this._dock(dock),
      close: () => this._close(),
    });
    this._picture = new NewestPicture(loadImage, (image) => this._view.show(image));
    this._ending = new AbortController();
    const { signal } = this._ending;
    document.addEventListener("visibilitychange", () => this._watch(), { signal });
    document.addEventListener("click", (event) => this._clicked(event), { signal });
    window.addEventListener("resize", () => this._place(), { signal });
    listenToDrags(
      this._view.head,
      () => this._kept.dock === "float",
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
    this._show();
  }

  destroy() {
    this._ending.abort();
    this._leave();
    clearInterval(this._timer);
    this._goesBy();
    this._view.element.remove();
    delete document.body.dataset.camera;
  }

  /** @param {Cameras | Picture} message */
  receive(message) {
    if (message.op === "cameras") this._take(message);
    else if (message.camera === this._camera?.id) {
      const { clock } = this._map;
      const age = clock === null ? 0 : 1000 * (clock - message.stamp);
      const url = resolve(message.url, document.baseURI);
      if (url !== null) this._picture.offer(url, age);
    }
  }

  /** @param {Cameras} there */
  _take(there) {
    const same = there.robot === this._there.robot;
    this._there = there;
    // Request again, as a reconnected page must: the display sends the current state.
    this._watched = null;
    const { cameras } = there;
    const chosen = same && cameras.find(({ id }) => id === this._camera?.id);
    const named = cameras.find(({ name }) => name === this._kept.camera);
    this._use(chosen || named || cameras.at(0) || null);
  }

  /**
   * Show a camera, and open its panel.
   *
   * @param {number} id
   */
  choose(id) {
    const camera = this._there.cameras.find((one) => one.id === id);
    if (!camera) return;
    Object.assign(this._kept, { open: true, camera: camera.name });
    storeState(this._kept);
    this._use(camera);
  }

  /** @param {Camera | null} camera */
  _use(camera) {
    if (camera?.id !== this._camera?.id) {
      this._picture.restart();
      this._view.clear();
    }
    this._camera = camera;
    this._show();
  }

  get _open() {
    return this._kept.open && this._camera !== null;
  }

  _close() {
    this._kept.open = false;
    storeState(this._kept);
    this._show();
    cardButton(this._camera?.id)?.focus();
  }

  /** @param {Dock} dock */
  _dock(dock) {
    const { dock: before, x, y } = this._kept;
    if (dock === "float" && before === "float") {
      // Without a pointer the panel moves from corner to corner.
      Object.assign(this._kept, nextCorner(x, y));
    }
    this._move({ ...this._kept, dock });
  }

  /** @param {Place} place */
  _move({ dock, x, y }) {
    Object.assign(this._kept, { dock, x, y });
    storeState(this._kept);
    this._show();
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
    if (this._open && this._camera?.id === id) this._close();
    else this.choose(id);
    closeSheet();
  }

  _show() {
    const open = this._open;
    const { dock } = this._kept;
    const { element } = this._view;
    // The waiting time while the panel was closed does not count.
    if (open && element.hidden) this._picture.restart();
    if (open) document.body.dataset.camera = dock;
    else delete document.body.dataset.camera;
    this._view.open(open, dock, this._there, this._camera);
    // A floating panel is over the map, but below the panels for driving and STOP.
    const before = dock === "float" ? this._map.svg : this._map.svg.parentElement;
    if (before?.nextElementSibling !== element) before?.after(element);
    this._goesBy();
    const { robot } = this._there;
    const age = () => this._picture.age;
    this._goesBy = open ? this._map.drive.goBy(robot, age) : () => {};
    this._watch();
    this._place();
    this._look();
  }

  /** Request pictures while the panel is visible. */
  _watch() {
    const seen = this._open && document.visibilityState === "visible";
    const wanted = seen ? (this._camera?.id ?? null) : null;
    if (wanted === this._watched) return;
    this._watched = wanted;
    this._send({ op: "watch", camera: wanted });
  }

  _look() {
    for (const button of document.querySelectorAll("button[data-camera-id]")) {
      const id = Number(button.getAttribute("data-camera-id"));
      const large = this._open && id === this._camera?.id;
      if (button.getAttribute("aria-pressed") !== String(large)) {
        button.setAttribute("aria-pressed", String(large));
      }
    }
    if (!this._open) return;
    const { age, shown } = this._picture;
    const mine = this._map.drive.robots.get(this._there.robot)?.mine === true;
    this._view.showAge(age, shown, age > OLD, mine);
  }

  _place() {
    const { style } = this._view.element;
    if (!this._open || this._kept.dock !== "float") {
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

/**
 * @param {string} url
 * @returns {Promise<HTMLImageElement>}
 */
async function loadImage(url) {
  const image = new Image();
  image.src = url;
  await image.decode();
  return image;
}

/** @param {number | undefined} id */
function cardButton(id) {
  const button = document.querySelector(`[data-camera-id="${id}"]`);
  return button instanceof HTMLElement ? button : null;
}

/** Milliseconds after which an unfinished load no longer blocks the next. */
const PATIENCE = 2000;

/**
 * The newest picture of one camera. One picture is loaded at a time; of the pictures
 * that arrive meanwhile only the newest is loaded. The age of the shown picture is
 * known.
 *
 * Times are in milliseconds of the page's own clock.
 *
 * @template T
 */
export class NewestPicture {
  /**
   * @param {(url: string) => Promise<T>} load Loads a whole picture.
   * @param {(picture: T) => void} show
   * @param {() => number} now
   */
  constructor(load, show, now = () => performance.now()) {
    this._load = load;
    this._show = show;
    this._now = now;
    this._since = now();
    /** @type {number | null} Time when the shown picture was taken. */
    this._taken = null;
    /** @type {{url: string, taken: number} | null} */
    this._next = null;
    /** Identifies the current load; results of earlier loads are ignored. */
    this._number = 0;
    this._busySince = -Infinity;
  }

  /** Begin again without a picture, for another camera. */
  restart() {
    this._number++;
    this._busySince = -Infinity;
    this._next = null;
    this._taken = null;
    this._since = this._now();
  }

  /** Whether a picture is shown. */
  get shown() {
    return this._taken !== null;
  }

  /** Age of the shown picture; without a picture, the waiting time. */
  get age() {
    return Math.max(0, this._now() - (this._taken ?? this._since));
  }

  /**
   * Offer a new picture.
   *
   * @param {string} url
   * @param {number} age Its age already.
   */
  offer(url, age) {
    this._next = { url, taken: this._now() - Math.max(0, age) };
    if (this._now() - this._busySince >= PATIENCE) this._begin();
  }

  _begin() {
    const next = this._next;
    if (next === null) return;
    this._next = null;
    this._busySince = this._now();
    const number = ++this._number;
    this._load(next.url)
      .then(
        (picture) => {
          if (number !== this._number) return;
          this._taken = next.taken;
          this._show(picture);
        },
        // The display replaced it by a newer picture, which is on its way.
        () => {},
      )
      .finally(() => {
        if (number !== this._number) return;
        this._busySince = -Infinity;
        this._begin();
      });
  }
}
