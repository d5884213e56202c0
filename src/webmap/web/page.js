/**
 * The page: its socket to the display, the scene, the maps and the parts of modules.
 *
 * This folder is the browser engine. Open this file first, then `scene.js` and `map.js`.
 * `motion/` sends commands to the gate, `inputs/` reads keys, gamepads and the stick,
 * and `tools/` has what tools share. What an operator can name is in `../features`.
 */

import { BASE, whyRefused } from "./access.js";
import { LONGEST_TEXTS } from "./constants.js";
import { Reports } from "./events.js";
import { BrowserParts, importOf } from "./browser_parts.js";
import { Frames } from "./frames.js";
import { Link } from "./link.js";
import { Notices } from "./notices.js";
import { dark, id, path, sceneAddress, takeFirstSocket } from "./opening.js";
import { Scene } from "./scene.js";

/** @typedef {import('./drive.js').Drive} Drive */

/** Milliseconds without a message until the page shows it, and until it reconnects. */
const SILENT = 3000;
const DEAD = 10_000;
/** Milliseconds between two checks; the server sends at least every second. */
const LOOK_PERIOD = 500;
/** Milliseconds for which pictures may wait until driving is loaded. */
const STOP_FIRST = 2000;

/** One open page: its connection to the display, its scene, its notices. */
export class Page {
  constructor() {
    this.path = path;
    this.id = id;
    this.notices = new Notices();
    this.parts = new BrowserParts({
      send: (message) => this.send(message),
      notice: (text) => this.trouble(text),
      ready: () => this._loadDrive(),
      onStyles: () => {
        this._restyling ||= requestAnimationFrame(() => this._restyle());
      },
    });
    this.scene = new Scene({
      send: (message) => this.send(message),
      notice: (text) => this.trouble(text),
      error: (text) => this.notices.error(text),
      problem: (number, text) => this.notices.problem(number, text),
      recheckProblems: () => this.notices.recheckProblems(),
      onEvent: (mount, item, kind, event) => this._reports.report(mount, item, kind, event),
      drive: () => this.drive,
      parts: this.parts,
      root: document,
      body: document.body,
    });
    this._frames = new Frames(
      (data, received) => this.scene.apply(data, received),
      (message) => void this._answer(message),
      (error, forGood) => this._misunderstood(error, forGood),
    );
    this._reports = new Reports(
      (message) => this.send(message),
      (node) => this.scene.mapOf(node),
    );
    /** @type {Drive | null} */
    this._drive = null;
    /** @type {typeof import('./drive.js') | null} */
    this._driving = null;
    /** @type {Promise<unknown> | null} Resolves when driving is loaded, or cannot be. */
    this._loading = null;
    this._restyling = 0;
    /** Whether nothing came yet over this connection. */
    this._isNew = false;
    this._listening = performance.now();
    /**
     * Removes the STOP of a page without a picture; null once there was a picture.
     * @type {(() => void) | null}
     */
    this._hideBareStop = () => {};
    this._offersStop = false;
    /** Why the server ended the last connection, if it did. */
    this._why = "";
    /** Whether the page was hidden when it last received something. */
    this._returned = false;
    dark.addEventListener("change", () => this.scene.restyle());
    /** @type {import('./link.js').LinkEvents} */
    const events = {
      opened: () => {
        this._listening = performance.now();
        this._frames.clear();
        this._isNew = true;
      },
      received: (data, at) => this._received(data, at),
      closed: (reason, forGood) => this._closed(reason, forGood),
      refused: () => void this._askWhy(),
    };
    this._link = new Link(sceneAddress, events, takeFirstSocket());
    // Whatever the frozen page did not read is old, and its connection may be dead.
    document.addEventListener("resume", () => this._link.renew());
    setInterval(() => this._look(), LOOK_PERIOD);
  }

  /**
   * The page's connection to the gate, made at its first use by a module.
   *
   * @returns {Drive}
   */
  get drive() {
    if (this._drive) return this._drive;
    if (!this._driving) throw new Error("drive.js has not been loaded");
    this._drive = new this._driving.Drive(BASE, { id: this.id });
    this._drive.on("gamepad", ({ kind, text, settings }) => {
      const key = `gamepad ${kind}`;
      const act = settings ? { name: "Gamepad settings", act: settings } : null;
      if (!text) this.notices.hide(key);
      else this.notices.show(key, text, kind === "refused" ? "alert" : "status", act);
    });
    return this._drive;
  }

  /** @returns {Promise<typeof import('./drive.js')>} */
  async _loadDrive() {
    const { href } = new URL("drive.js", import.meta.url);
    const load = importOf(href);
    const limit = new Promise((done) => setTimeout(done, STOP_FIRST));
    this._loading ??= Promise.race([load.catch(() => {}), limit]);
    return (this._driving ??= await load);
  }

  /**
   * Answer frames. On a slow link, more of them would delay driving and STOP.
   *
   * @param {object} message
   */
  async _answer(message) {
    await this._loading;
    this.send(message);
  }

  /**
   * Send to the server; dropped without a connection.
   *
   * @param {object} message
   */
  send(message) {
    this._link.send(message);
  }

  /**
   * Report a failure to the viewer and to the server.
   *
   * @param {string} text
   */
  trouble(text) {
    this.notices.error(text);
    this.send({ op: "trouble", text: text.slice(0, LONGEST_TEXTS.trouble) });
  }

  // The connection -------------------------------------------------------------

  /**
   * @param {ArrayBuffer} data
   * @param {number} at When it came, by `performance.now()`.
   */
  _received(data, at) {
    this._listening = performance.now();
    this._returned = document.hidden;
    this._frames.add(data, at);
    this._connected();
    const first = this._isNew;
    this._isNew = false;
    // Before the first picture there is none, or an old one: do not wait to draw it.
    if (first && !document.hidden) this._frames.draw();
    else this._frames.drawSoon();
  }

  _connected() {
    this._link.settle();
    this._hideBareStop?.();
    this._hideBareStop = null;
    const { classList } = document.documentElement;
    if (!classList.contains("disconnected")) return;
    classList.remove("disconnected");
    if (this._why) {
      this.notices.show("link", `Connected again. Before: ${this._why}.`);
      this.notices.leave("link");
    } else this.notices.hide("link");
    this._why = "";
  }

  /**
   * @param {string} reason
   * @param {boolean} forGood
   */
  _closed(reason, forGood) {
    this._frames.clear();
    this._why = reason;
    const what = reason ? `No connection to WebMap: ${reason}.` : "No connection to WebMap.";
    this._disconnected(`${what} ${forGood ? "Reload the page." : "Reconnecting…"}`);
    void this._offerStop();
  }

  /** Show STOP, if the page never got a picture: modules would bring their own. */
  async _offerStop() {
    if (this._offersStop || !this._hideBareStop) return;
    this._offersStop = true;
    try {
      const { showBareStop } = await this._loadDrive();
      if (this._hideBareStop) this._hideBareStop = showBareStop(this.drive);
    } catch {
      this._offersStop = false; // without a network; the next attempt may succeed
    }
  }

  /** Ask why the server refuses a socket to this page, and show what to do. */
  async _askWhy() {
    const why = await whyRefused();
    if (why && !this._link.isOpen) this._disconnected(why);
  }

  /** @param {string} text */
  _disconnected(text) {
    const { classList } = document.documentElement;
    // The operator drives by the picture: end all inputs when it stops updating.
    if (!classList.contains("disconnected")) this._drive?.goNeutral();
    classList.add("disconnected");
    this.notices.show("link", text);
  }

  /** Detect an open connection that receives nothing. */
  _look() {
    this._link.look();
    // A hidden page draws nothing, so the server stops sending to it.
    if (document.hidden || this._frames.wait) this._listening = performance.now();
    const silent = performance.now() - this._listening;
    if (silent < SILENT || !this._link.isOpen) return;
    this._disconnected("No data from WebMap. The page shows stale data.");
    // A connection that was lost while the page was hidden needs no longer wait.
    if (silent > (this._returned ? SILENT : DEAD)) this._link.renew();
  }

  /** Sheets that load together are read once, because each reading computes styles. */
  _restyle() {
    this._restyling = 0;
    this.scene.restyle();
  }

  /**
   * @param {unknown} error
   * @param {boolean} forGood
   */
  _misunderstood(error, forGood) {
    this.trouble(`This page cannot read a message from WebMap: ${error}`);
    if (forGood) this._link.end();
  }
}

/** This page. */
export const page = new Page();
