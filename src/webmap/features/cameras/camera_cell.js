import { VideoPicture } from "./video_picture.js";
import {
  html,
  setAttribute,
  setHidden,
  setText,
  svg,
} from "../../web/tools/elements.js";

/**
 * A camera of a robot, as the display lists it, and the cameras of one robot.
 *
 * @typedef {{id: number, name: string}} Camera
 * @typedef {{robot: string, name: string, cameras: Camera[]}} RobotCameras
 */

/**
 * The camera that a cell shows; without a camera if the display does not have it now.
 *
 * @typedef {{robot: string, name: string, label: string, camera: Camera | null}} Target
 */

/** Milliseconds after which a picture is stale; the gate also stops at this age. */
const OLD = 1000;

/**
 * A picture with its age and, on a wall, the names of its robot and camera and the
 * buttons to change it.
 */
export class CameraCell {
  /**
   * @param {{
   *   select: (robot: string) => void, put: (cell: CameraCell, id: number) => void,
   *   remove: (cell: CameraCell) => void,
   * }} acts
   */
  constructor(acts) {
    /** @type {Target} */
    this.target = { robot: "", name: "", label: "", camera: null };
    /** Whether the cell is in view: the others get no pictures. */
    this.seen = true;
    this.picture = new NewestPicture(loadImage, (image) => this._show(image));
    /** @type {VideoPicture | null} Of a camera with video. */
    this._video = null;
    const attributes = { type: "button", dir: "auto" };
    this._robot = html("button", "button quiet camera-robot", attributes);
    this._robot.addEventListener("click", () => acts.select(this.target.robot));
    this._choice = html("select", "button camera-chooser", {
      "aria-label": "Camera",
      title: "Choose another camera",
    });
    // With the focus on the list, keys would drive no robot.
    let pressed = false;
    this._choice.addEventListener("pointerdown", () => (pressed = true));
    this._choice.addEventListener("keydown", () => (pressed = false));
    this._choice.addEventListener("change", () => {
      if (pressed) this._choice.blur();
      acts.put(this, Number(this._choice.value));
    });
    const remove = signButton("remove", REMOVE, () => acts.remove(this));
    const parts = [this._robot, this._choice, remove];
    this._caption = html("div", "camera-caption", {}, ...parts);
    this._age = html("span", "camera-cell-age");
    this._message = html("p", "camera-word", { role: "status" });
    this._frame = html("div", "camera-frame", {}, this._message, this._age);
    const both = [this._caption, this._frame];
    this.element = html("div", "camera-cell", { role: "group" }, ...both);
    this._listed = "";
  }

  /**
   * @param {Target} target
   * @param {RobotCameras[] | null} robots What the chooser of a wall lists.
   */
  use(target, robots) {
    const { robot, name, label, camera } = target;
    if (camera?.id !== this.target.camera?.id) this.restart();
    this.target = target;
    setAttribute(this.element, "aria-label", `${name}: ${label}`);
    setHidden(this._caption, robots === null);
    if (robots === null) return;
    setText(this._robot, name || robot);
    this._robot.title = `Select ${name || robot}`;
    this._list(robots);
    this._choice.value = String(camera?.id ?? "");
  }

  /** @param {RobotCameras[]} robots */
  _list(robots) {
    const { camera, label } = this.target;
    const listed = JSON.stringify([robots, camera ? "" : label]);
    if (listed === this._listed) return;
    this._listed = listed;
    const groups = robots.map(({ name, cameras }) => {
      const options = cameras.map((one) => new Option(one.name, String(one.id)));
      return html("optgroup", "", { label: name, dir: "auto" }, ...options);
    });
    const lost = html("option", "", { value: "", disabled: "" }, label);
    this._choice.replaceChildren(...(camera ? [] : [lost]), ...groups);
  }

  /** Remove the picture, and wait for a new one. */
  restart() {
    this.picture.restart();
    this._video?.end();
    this._video = null;
    this._frame.querySelector(".camera-image")?.remove();
  }

  /**
   * Show a video; a picture that is there stays until the first of the video.
   *
   * @param {string | null} address null ends the video.
   * @param {() => number | null} clock The clock of the display in seconds, if known.
   */
  play(address, clock) {
    if ((this._video?.address ?? null) === address) return;
    this._video?.end();
    this._video = null;
    if (address === null) return;
    const video = new VideoPicture(address, clock, (taken) => {
      this.picture.shows(taken);
      if (!video.canvas.isConnected) this._put(video.canvas);
    });
    this._video = video;
  }

  /** @param {HTMLImageElement} image */
  _show(image) {
    image.draggable = false;
    image.className = "camera-image";
    this._put(image);
  }

  /** @param {HTMLElement} image */
  _put(image) {
    const { name, label } = this.target;
    image.setAttribute(
      image instanceof HTMLImageElement ? "alt" : "aria-label",
      `Picture of ${name}: ${label}`,
    );
    this._frame.querySelector(".camera-image")?.remove();
    this._frame.prepend(image);
  }

  /** Whether the operator relies on the picture of this cell. */
  get counts() {
    return this.seen && this.target.camera !== null;
  }

  /**
   * Show the age and what is wrong.
   *
   * @param {boolean} selected Whether the robot is selected.
   * @param {boolean} mine Whether this page has control of the robot.
   */
  look(selected, mine) {
    const { age, shown } = this.picture;
    const { old } = this;
    const there = this.target.camera !== null;
    this.element.classList.toggle("stale", old);
    setAttribute(this.element, "aria-current", String(selected));
    setText(this._age, this.age);
    // Whole seconds, so that a screen reader does not read ten values a second.
    const seconds = Math.floor(age / 1000);
    let words = "";
    if (!there) words = "This camera is not available.";
    else if (!shown && !old) words = "Waiting for a picture.";
    else if (!shown) words = "No picture yet.";
    else if (old) words = seconds < 60 ? "Frozen." : "Frozen for over a minute.";
    if (there && this._video?.words) words = `${words} ${this._video.words}`.trim();
    if (old && mine) {
      words += " Commands are ignored: choose another camera or close this one.";
    }
    setText(this._message, words);
  }

  /** Whether the picture, or the time without one, is too old to drive by. */
  get old() {
    return this.target.camera !== null && this.picture.age > OLD;
  }

  /** The age of the picture, in words. */
  get age() {
    return this.picture.shown ? ageText(this.picture.age) : "";
  }
}

/** @param {number} age */
function ageText(age) {
  const seconds = age / 1000;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  return seconds < 100 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;
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

/** @typedef {{label: string, path: string}} Sign */

/** @type {Sign} */
const REMOVE = { label: "Remove from the wall", path: "M6 6l12 12M18 6L6 18" };

/**
 * @param {string} what
 * @param {Sign} sign
 * @param {() => void} act
 */
export function signButton(what, { label, path }, act) {
  const icon = svg(
    "svg",
    { class: "icon", viewBox: "0 0 24 24", "aria-hidden": "true" },
    svg("path", { d: path }),
  );
  const attributes = { type: "button", title: label, "aria-label": label };
  const button = html("button", `button square quiet camera-${what}`, attributes, icon);
  button.addEventListener("click", act);
  return button;
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

  /**
   * Note that a picture is shown that came in another way.
   *
   * @param {number} taken When it was taken.
   */
  shows(taken) {
    this._taken = taken;
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
