/**
 * The map in a notebook, over the notebook's own connection to its kernel.
 *
 * It only looks: its bundle has the picture and the view, and nothing that commands.
 * Python refuses every other message (`widget.py`).
 */

import { default as metreGrid } from "../features/view/metre_grid.js";
import { default as mouseViewControl } from "../features/view/mouse_view_control.js";
import { default as pointerReadout } from "../features/view/pointer_readout.js";
import { default as scaleBar } from "../features/view/scale_bar.js";
import { LONGEST_TEXTS } from "../web/constants.js";
import { Frames } from "../web/frames.js";
import { Scene } from "../web/scene.js";
import { html, setText } from "../web/tools/elements.js";
import { usePictures } from "./addresses.js";

/** @typedef {import('../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */

/**
 * What a notebook gives to a widget; see anywidget.
 *
 * @typedef {object} Model
 * @property {(name: string) => any} get A trait.
 * @property {(content: object) => void} send Sends to Python.
 * @property {(event: string, fn: (...given: any[]) => void) => void} on
 * @property {(event: string, fn: (...given: any[]) => void) => void} off
 */

/** @typedef {(map: MapCanvas, options: any, send: () => void) => BrowserPart} Attach */

/** @type {Record<string, Attach | undefined>} Browser parts that need no server. */
const PARTS = {
  "features/view/metre_grid.js": metreGrid,
  "features/view/mouse_view_control.js": mouseViewControl,
  "features/view/pointer_readout.js": pointerReadout,
  "features/view/scale_bar.js": scaleBar,
};

/** The container of a page that WebMap makes. */
const CONTAINER = "webmap_container";

/** Milliseconds between two looks at the theme and the silence. */
const LOOK_PERIOD = 1000;
/** Looks after which the view is named to Python: one that stays silent is closed. */
const ALIVE_PERIOD = 10;
/** Milliseconds without a frame until the widget shows it. */
const SILENT = 3000;
/** Most failures that are shown: the newest. */
const SHOWN = 3;

const LOOKS = "This map is for looking only: it has no STOP, and robots are not driven here.";
const NO_KERNEL =
  "No data from the kernel, which is busy, has ended or was restarted: the map is old.";

/** Sentences below the map, each with a key. */
class Words {
  constructor() {
    this.element = html("ul", "webmap-widget-words", { role: "status" });
    /** @type {Map<string, HTMLElement>} */
    this._shown = new Map();
  }

  /**
   * @param {string} key
   * @param {string} text "" to remove it.
   * @param {string} className
   */
  show(key, text, className = "") {
    if (!text) {
      this._shown.get(key)?.remove();
      this._shown.delete(key);
      return;
    }
    const line = this._shown.get(key) ?? html("li", className);
    setText(line, text);
    if (!this._shown.has(key)) this.element.append(line);
    this._shown.set(key, line);
  }

  /**
   * Show a failure until others replace it.
   *
   * @param {string} text
   */
  fail(text) {
    this.show(text, text, "failure");
    const failures = [...this._shown].filter(([, { className }]) => className === "failure");
    for (const [key] of failures.slice(0, -SHOWN)) this.show(key, "");
  }
}

/** The browser parts of one view; what is not in {@link PARTS} is only named. */
class Parts {
  /** @param {(names: string) => void} onMissing */
  constructor(onMissing) {
    this._onMissing = onMissing;
    /** @type {Map<number, {canvas: MapCanvas, part: BrowserPart}>} */
    this._attached = new Map();
    /** @type {Set<string>} */
    this._missing = new Set();
  }

  /**
   * @param {MapCanvas} canvas
   * @param {number} instance
   * @param {string} module
   * @param {string} _css
   * @param {unknown} options
   */
  attach(canvas, instance, module, _css, options) {
    this.detach(instance);
    const make = PARTS[module];
    if (make) this._attached.set(instance, { canvas, part: make(canvas, options, () => {}) });
    else {
      this._missing.add(module.replace(/^.*\/|\.js$/g, ""));
      this._onMissing([...this._missing].sort().join(", "));
    }
  }

  /** @param {number} instance */
  detach(instance) {
    this._attached.get(instance)?.part.destroy();
    this._attached.delete(instance);
  }

  /** @param {MapCanvas} canvas */
  detachFrom(canvas) {
    for (const [instance, attached] of [...this._attached]) {
      if (attached.canvas === canvas) this.detach(instance);
    }
  }

  /** No part here has messages. */
  receive() {}
}

/** One output cell that shows the map; Python has a page for each. */
class View {
  /**
   * @param {Model} model
   * @param {HTMLElement} place
   */
  constructor(model, place) {
    this._model = model;
    this._id = Array.from(crypto.getRandomValues(new Uint32Array(4)), String).join("-");
    this._words = new Words();
    this._words.show("looks", LOOKS);
    this._container = html("div", "", { id: CONTAINER });
    this._body = html("div", "webmap-widget", {}, this._container);
    // Keys on the map are not for the cells of JupyterLab.
    this._host = html("div", "", { "data-lm-suppress-shortcuts": "true" });
    const root = this._host.attachShadow({ mode: "open" });
    this._sheet = new CSSStyleSheet();
    this._sheet.replaceSync(model.get("sheet"));
    this._schemes = [...this._sheet.cssRules].filter(
      (rule) => rule instanceof CSSMediaRule && rule.conditionText.includes("color-scheme"),
    );
    root.adoptedStyleSheets = [this._sheet];
    root.append(this._body, this._words.element);
    place.append(this._host);

    const send = (/** @type {object} */ message) => this._send(message);
    const notice = (/** @type {string} */ text) => {
      this._words.fail(text);
      send({ op: "trouble", text: text.slice(0, LONGEST_TEXTS.trouble) });
    };
    this._scene = new Scene({
      send,
      notice,
      error: (text) => this._words.fail(text),
      problem: (number, text) => this._words.show(`problem ${number}`, text, "problem"),
      recheckProblems: () => {},
      onEvent: () => {},
      drive: () => {
        throw new Error("a map in a notebook has no connection to the gate");
      },
      parts: new Parts((names) => this._words.show("missing", `Not in a notebook: ${names}.`)),
      root,
      body: this._body,
    });
    /** @type {Map<string, string>} Those of the frames that wait. */
    this._pictures = new Map();
    this._frames = new Frames(
      (data, received) => {
        usePictures(this._pictures);
        return this._scene.apply(data, received);
      },
      send,
      (error) => notice(`This map cannot read a message from WebMap: ${error}`),
    );
    this._heard = performance.now();
    this._looks = 0;
    this._open = false;
    this._seen = false;
    /** @type {boolean | null} null until it is known. */
    this._dark = null;
    this._listen();
  }

  _listen() {
    const receive = (/** @type {any} */ content, /** @type {DataView[]} */ buffers) => {
      if (content.view === this._id) this._receive(content, buffers);
    };
    const change = () => this._dress();
    this._model.on("msg:custom", receive);
    this._model.on("change:theme", change);
    this._model.on("change:height", change);
    // What is out of view is not drawn, so Python sends nothing more.
    const visible = new IntersectionObserver(([entry]) => {
      this._seen = entry.isIntersecting;
      this._heard = performance.now();
      if (this._seen && !this._open) this._hello();
      else if (this._seen && this._frames.wait) this._frames.drawSoon();
    });
    visible.observe(this._body);
    const looking = setInterval(() => this._look(), LOOK_PERIOD);
    this._stop = () => {
      visible.disconnect();
      clearInterval(looking);
      this._model.off("msg:custom", receive);
      this._model.off("change:theme", change);
      this._model.off("change:height", change);
    };
    this._dress();
  }

  /** Leave the notebook: Python closes the page. */
  end() {
    this._stop?.();
    this._frames.clear();
    this._scene.end();
    this._model.send({ view: this._id });
    this._host.remove();
  }

  /** @param {object} message */
  _send(message) {
    this._model.send({ view: this._id, text: JSON.stringify(message) });
  }

  /** Ask for the whole picture. */
  _hello() {
    const { width, height } = this._container.getBoundingClientRect();
    this._open = true;
    this._send({
      op: "hello",
      page: this._id,
      url: "/",
      width,
      height,
      dpr: devicePixelRatio,
      theme: this._dark ? "dark" : "light",
      containers: { [CONTAINER]: [width, height] },
    });
  }

  /**
   * @param {{unknown?: boolean, ended?: string, pictures?: Record<string, string>}} content
   * @param {DataView[]} buffers
   */
  _receive({ unknown, ended, pictures = {} }, buffers) {
    this._heard = performance.now();
    this._words.show("silent", "");
    if (unknown) this._hello();
    this._words.show("ended", ended ?? "");
    const [frame] = buffers;
    if (!frame) return;
    if (!this._frames.wait) this._pictures.clear();
    for (const [address, data] of Object.entries(pictures)) this._pictures.set(address, data);
    const { byteOffset, byteLength } = frame;
    const bytes = new Uint8Array(frame.buffer, byteOffset, byteLength);
    this._frames.add(bytes.slice().buffer, performance.now());
    if (this._seen) this._frames.drawSoon();
  }

  /** Follow the theme of the notebook, and notice when nothing comes. */
  _look() {
    this._dress();
    this._looks += 1;
    if (this._open && this._looks % ALIVE_PERIOD === 0) this._send({ op: "seen", frame: 0 });
    const now = performance.now();
    if (!this._open || !this._seen || document.hidden || this._frames.wait) this._heard = now;
    if (now - this._heard > SILENT) this._words.show("silent", NO_KERNEL, "failure");
  }

  _dress() {
    this._container.style.height = `${this._model.get("height")}px`;
    const theme = this._model.get("theme");
    const dark = theme === "auto" ? isDark(this._host.parentElement) : theme === "dark";
    this._body.style.background = theme === "auto" ? "" : "Canvas";
    this._host.style.colorScheme = dark ? "dark" : "light";
    if (dark === this._dark) return;
    this._dark = dark;
    this._dressed();
  }

  /** Let the rules for the theme of the system apply for that of the notebook. */
  _dressed() {
    for (const rule of this._schemes) {
      if (rule instanceof CSSMediaRule) rule.media.mediaText = this._dark ? "all" : "not all";
    }
    this._scene.restyle();
  }
}

const ink = html("canvas", "", { width: "1", height: "1" }).getContext("2d", {
  willReadFrequently: true,
});

/**
 * @param {Element | null} element
 * @returns {boolean} Whether its text is light, so what is behind it is dark. The
 *     notebook may be transparent, and its theme need not be that of the system.
 */
function isDark(element) {
  if (!element || !ink) return false;
  // The canvas reads colours of every form.
  ink.fillStyle = getComputedStyle(element).color;
  ink.fillRect(0, 0, 1, 1);
  const [red, green, blue] = ink.getImageData(0, 0, 1, 1).data;
  return 0.299 * red + 0.587 * green + 0.114 * blue > 127;
}

/** The widget for anywidget: `render` is called for each output cell. */
export default function widget() {
  return {
    /** @param {{model: Model, el: HTMLElement}} given */
    render({ model, el }) {
      const view = new View(model, el);
      return () => view.end();
    },
  };
}
