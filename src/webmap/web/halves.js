import { BASE, resolve } from "./addresses.js";

/** @typedef {import('./map.js').MapCanvas} MapCanvas */

/**
 * The browser's half of a module, as its default export gives it.
 *
 * @typedef {object} Half
 * @property {(message: any) => void} [receive] Takes what the other half sends.
 * @property {() => void} destroy Undoes everything that the half did.
 */

/**
 * @typedef {object} Attached
 * @property {MapCanvas} canvas
 * @property {Half | null} half null until the module has come.
 * @property {unknown[]} waiting Messages that came before the module.
 */

/**
 * @typedef {object} HalvesPage
 * @property {(message: object) => void} send Tells the server.
 * @property {(text: string) => void} notice Tells the viewer and the server.
 * @property {() => Promise<unknown>} ready What must be there before any module.
 * @property {() => void} onStyles Called when a style sheet has come.
 */

/** The browser's halves of modules: loaded, attached, and taken away again. */
export class Halves {
  /** @param {HalvesPage} page */
  constructor(page) {
    this._page = page;
    /** @type {Map<number, Attached>} */
    this._attached = new Map();
    /** @type {Set<string>} */
    this._styles = new Set();
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
    const attached = { canvas, half: null, waiting: [] };
    this._attached.set(instance, attached);
    if (css) this._addStyle(css);
    this._load(attached, instance, module, options).catch((error) => {
      // What a module imports is not asked for again by every browser.
      const hint = error instanceof TypeError ? " Reload the page to try again." : "";
      this._page.notice(`Module ${module} failed: ${error}.${hint}`);
    });
  }

  /**
   * @param {Attached} attached
   * @param {number} instance
   * @param {string} module
   * @param {unknown} options
   */
  async _load(attached, instance, module, options) {
    const url = resolve(module, BASE);
    if (url === null) throw new Error("it is on another server");
    const [code] = await Promise.all([importOf(url), this._page.ready()]);
    // It may have been taken away while it was on its way.
    if (this._attached.get(instance) !== attached) return;
    const { send } = this._page;
    /** @param {object} data */
    const sendData = (data) => send({ op: "module", instance, data });
    attached.half = code.default(attached.canvas, options, sendData) ?? null;
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
    if (!attached.half) attached.waiting.push(message);
    else this._try(() => attached.half?.receive?.(message));
  }

  /** @param {number} instance */
  detach(instance) {
    const attached = this._attached.get(instance);
    this._attached.delete(instance);
    if (attached) this._try(() => attached.half?.destroy());
  }

  /** @param {MapCanvas} canvas All modules of this map go. */
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

  /** @param {string} css */
  _addStyle(css) {
    const url = resolve(css, BASE);
    if (url === null || this._styles.has(url)) return;
    this._styles.add(url);
    const link = document.createElement("link");
    link.rel = "stylesheet";
    link.href = url;
    link.addEventListener("load", () => this._page.onStyles());
    document.head.append(link);
  }
}

/** Milliseconds to wait before a module that could not be had is asked for again. */
const AGAIN = [200, 1000];

/**
 * By what address each module was had, as by another it would be another module.
 * @type {Map<string, string>}
 */
const had = new Map();

/**
 * Import a module, and ask for it again if it cannot be had: over a bad link a page would
 * otherwise be without its STOP button until it is loaded anew.
 *
 * @param {string} url
 * @param {(url: string) => Promise<any>} [load]
 * @returns {Promise<any>}
 * @throws {TypeError} If it cannot be had; whatever else it raises itself.
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
      // A module that came and is wrong would be wrong again; of a TypeError it cannot
      // be told whose it is.
      if (!(error instanceof TypeError) || tries >= AGAIN.length) throw error;
      await new Promise((done) => setTimeout(done, AGAIN[tries]));
    }
  }
}

/**
 * @param {string} url
 * @param {number} tries How often it could not be had; a browser keeps that by address.
 */
function asked(url, tries) {
  if (tries === 0) return url;
  const address = new URL(url);
  address.searchParams.set("again", `${tries}`);
  return address.href;
}
