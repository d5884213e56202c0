import { OWN_FILES, resolve } from "./access.js";
import {
  FIRST_PARTS,
  FIRST_SHEETS,
  LATER,
  LATER_PARTS,
  PARTS,
  PART_FOLDERS,
  PART_SHEETS,
} from "./constants.js";

/** @typedef {import('./map.js').MapCanvas} MapCanvas */

/**
 * The part of a module that runs in the browser, from its default export.
 *
 * @typedef {object} BrowserPart
 * @property {(message: any) => void} [receive] Handles messages of the part in Python.
 * @property {() => void} destroy Reverts everything that the part did.
 */

/**
 * @typedef {object} Attached
 * @property {MapCanvas} canvas
 * @property {BrowserPart | null} part null until the module is loaded.
 * @property {unknown[]} waiting Messages that came before the module was loaded.
 */

/**
 * @typedef {object} BrowserPartsPage
 * @property {(message: object) => void} send Sends to the server.
 * @property {(text: string) => void} notice Shows to the viewer, sends to the server.
 * @property {() => Promise<unknown>} ready Resolves when modules may be loaded.
 * @property {() => void} onStyles Called when a style sheet was loaded.
 */

/** The bundle of each browser part that a page starts with: STOP and driving. */
const FIRST = new Map(Object.entries(FIRST_PARTS));

/** Milliseconds for which the other parts wait for STOP and driving. */
const FIRST_PATIENCE = 1000;

/** The media of a style sheet that is loaded and does not apply yet. */
const WAITS = "not all";

/** Loads, attaches and detaches the browser parts of modules. */
export class BrowserParts {
  /** @param {BrowserPartsPage} page */
  constructor(page) {
    this._page = page;
    /** @type {Map<number, Attached>} */
    this._attached = new Map();
    /** @type {Set<string>} */
    this._styles = new Set();
    /** @type {Promise<void>[]} STOP and driving, which are being loaded. */
    this._first = [];
    /** @type {(() => Promise<void>)[]} Load the other parts. */
    this._later = [];
  }

  /**
   * @param {MapCanvas} canvas
   * @param {number} instance
   * @param {string} module
   * @param {string} css "" for none.
   * @param {unknown} options
   */
  attach(canvas, instance, module, css, options) {
    this.detach(instance);
    /** @type {Attached} */
    const attached = { canvas, part: null, waiting: [] };
    this._attached.set(instance, attached);
    const url = resolve(module, OWN_FILES);
    const part = ownPart(url);
    const first = part !== null && FIRST.has(part);
    const sheet = first ? FIRST_SHEETS : PART_SHEETS;
    const style = css ? this._addStyle(part ? sheet : css, first) : null;
    const load = () => {
      if (style) style.link.href = style.url;
      const code = (part ? partOf(part) : moduleOf(url)).finally(() => {
        if (style) this._apply(style.link);
      });
      return this._load(attached, instance, code, options).catch((error) => {
        // Not every browser loads a failed import of a module again.
        const hint = error instanceof TypeError ? " Reload the page to try again." : "";
        this._page.notice(`Module ${module} failed: ${error}.${hint}`);
      });
    };
    if (first) this._first.push(load());
    else if (this._later.push(load) === 1) void this._loadLater();
  }

  /** Load parts when the picture is on the screen, and STOP works. */
  async _loadLater() {
    await painted();
    const patience = new Promise((done) => setTimeout(done, FIRST_PATIENCE));
    await Promise.race([Promise.all(this._first.splice(0)), patience]);
    for (const load of this._later.splice(0)) void load();
  }

  /**
   * @param {Attached} attached
   * @param {number} instance
   * @param {Promise<any>} loading The module.
   * @param {unknown} options
   */
  async _load(attached, instance, loading, options) {
    const [code] = await Promise.all([loading, this._page.ready()]);
    // It may have been detached while it was loading.
    if (this._attached.get(instance) !== attached) return;
    const { send } = this._page;
    /** @param {object} data */
    const sendData = (data) => send({ op: "module", instance, data });
    attached.part = code.default(attached.canvas, options, sendData) ?? null;
    send({ op: "ready", instance });
    for (const message of attached.waiting.splice(0)) this.receive(instance, message);
  }

  /**
   * @param {number} instance
   * @param {unknown} message
   */
  receive(instance, message) {
    const attached = this._attached.get(instance);
    if (!attached) return;
    if (!attached.part) attached.waiting.push(message);
    else this._try(() => attached.part?.receive?.(message));
  }

  /** @param {number} instance */
  detach(instance) {
    const attached = this._attached.get(instance);
    this._attached.delete(instance);
    if (attached) this._try(() => attached.part?.destroy());
  }

  /** @param {MapCanvas} canvas Detach all modules of this map. */
  detachFrom(canvas) {
    for (const [instance, attached] of [...this._attached].reverse()) {
      if (attached.canvas === canvas) this.detach(instance);
    }
  }

  /** @param {() => void} fn */
  _try(fn) {
    try {
      fn();
    } catch (error) {
      this._page.notice(`A module failed: ${error}`);
    }
  }

  /**
   * Apply a style sheet together with its parts: applied before, the browser would
   * compute the styles of the page once more.
   *
   * @param {HTMLLinkElement} link
   */
  _apply(link) {
    if (link.media !== WAITS) return;
    link.media = "all";
    if (link.sheet) this._page.onStyles();
  }

  /**
   * @param {string} css
   * @param {boolean} first Whether it is of STOP and driving, and applies at once.
   * @returns {{link: HTMLLinkElement, url: string} | null} In the order of the modules;
   *     null if there is nothing to load.
   */
  _addStyle(css, first) {
    const url = resolve(css, OWN_FILES);
    if (url === null || this._styles.has(url)) return null;
    this._styles.add(url);
    const link = document.createElement("link");
    link.rel = "stylesheet";
    if (!first) link.media = WAITS;
    link.addEventListener("load", () => {
      if (link.media !== WAITS) this._page.onStyles();
    });
    document.head.append(link);
    return { link, url };
  }
}

/**
 * @param {string | null} url
 * @returns {string | null} The name of a browser part of WebMap; null for another module.
 */
function ownPart(url) {
  if (!url?.startsWith(OWN_FILES.href)) return null;
  const name = url.slice(OWN_FILES.href.length);
  return PART_FOLDERS.some((folder) => name.startsWith(folder)) ? name : null;
}

/** @type {Map<string, Promise<any>>} The bundles that were requested, by their address. */
const bundles = new Map();

/**
 * Load WebMap's own part of this name, with the others of its bundle.
 *
 * @param {string} name
 * @param {(url: string) => Promise<any>} [load]
 * @returns {Promise<any>}
 */
export async function partOf(name, load = importOf) {
  const bundle = FIRST.get(name) ?? (LATER_PARTS.includes(name) ? LATER : PARTS);
  return moduleIn(bundle, name, load);
}

/**
 * Load a module that another one imports when somebody uses it: the server replaces
 * `import("./x.js")` by a call of this function.
 *
 * @param {string} name
 * @returns {Promise<any>}
 */
export async function laterModule(name) {
  return moduleIn(LATER, name, importOf);
}

/**
 * All that wait for a bundle share one import, so that parts are attached together: with
 * an import for each, the browser computed styles and painted between them.
 *
 * @param {string} bundle
 * @param {string} name
 * @param {(url: string) => Promise<any>} load
 * @returns {Promise<any>}
 */
async function moduleIn(bundle, name, load) {
  const { href } = new URL(bundle, OWN_FILES);
  const loading = bundles.get(href) ?? load(href);
  bundles.set(href, loading);
  try {
    const { $modules } = await loading;
    if (!$modules[name]) throw new Error("WebMap has no such module");
    return $modules[name];
  } catch (error) {
    bundles.delete(href);
    throw error;
  }
}

/** @param {string | null} url */
async function moduleOf(url) {
  if (url === null) throw new Error("it is on another server");
  return importOf(url);
}

/** @returns {Promise<void>} Resolves when the browser has painted what is there now. */
function painted() {
  return new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
}

/** Milliseconds before each new attempt to load a module. */
const AGAIN = [200, 1000];

/**
 * The address under which each module was loaded: another address is another module.
 * @type {Map<string, string>}
 */
const had = new Map();

/**
 * Import a module, and try again if it cannot be loaded: over a bad link a page would
 * otherwise have no STOP button until it is reloaded.
 *
 * @param {string} url
 * @param {(url: string) => Promise<any>} [load]
 * @returns {Promise<any>}
 * @throws {TypeError} If it cannot be loaded; also any error of the module itself.
 */
export async function importOf(url, load = (address) => import(address)) {
  const known = had.get(url);
  if (known !== undefined) return load(known);
  for (let tries = 0; ; tries++) {
    const address = asked(url, tries);
    try {
      const module = await load(address);
      had.set(url, address);
      return module;
    } catch (error) {
      // A loaded module that throws would throw again; the origin of a TypeError is
      // unknown.
      if (!(error instanceof TypeError) || tries >= AGAIN.length) throw error;
      await new Promise((done) => setTimeout(done, AGAIN[tries]));
    }
  }
}

/**
 * @param {string} url
 * @param {number} tries Failed attempts; a browser caches failures by address.
 */
function asked(url, tries) {
  if (tries === 0) return url;
  const address = new URL(url);
  address.searchParams.set("again", `${tries}`);
  return address.href;
}
