/**
 * The page's identity, and its first socket.
 *
 * This module is small and comes before `page.js`: the display makes the first picture
 * while the browser still loads and compiles the others.
 */

import { pagePath, socketAddress } from "./addresses.js";
import { LONGEST_TEXTS } from "./constants.js";
import { protocols, takeIdentity, takeKey } from "./key.js";
import { containers } from "./sizes.js";

takeKey();

/** The path of this page, from the application's root. */
export const path = pagePath();

/** The name that identifies this page, also after a reload. */
export const id = takeIdentity(path);

/** Whether the viewer prefers dark colors. */
export const dark = matchMedia("(prefers-color-scheme: dark)");

/** @returns {URL} Of the socket, with the hello: a message would take a round trip. */
export function sceneAddress() {
  const hello = {
    op: "hello",
    page: id,
    url: (path + location.search).slice(0, LONGEST_TEXTS.url),
    width: innerWidth,
    height: innerHeight,
    dpr: devicePixelRatio,
    theme: dark.matches ? "dark" : "light",
    containers: containers(),
  };
  return socketAddress("scene", { page: path, id, hello: JSON.stringify(hello) });
}

/** A socket that stores what it receives until somebody takes it. */
class StoringSocket {
  /** @param {WebSocket} socket */
  constructor(socket) {
    socket.binaryType = "arraybuffer";
    this._socket = socket;
    /** @type {Array<{data: unknown, at: number}>} */
    this._received = [];
    this._store = (/** @type {MessageEvent} */ { data }) => {
      this._received.push({ data, at: performance.now() });
    };
    socket.addEventListener("message", this._store);
  }

  /**
   * @returns {{socket: WebSocket, received: Array<{data: unknown, at: number}>}} The
   *     socket, and the messages so far with the times of `performance.now()`.
   */
  take() {
    this._socket.removeEventListener("message", this._store);
    return { socket: this._socket, received: this._received };
  }
}

/** The first socket of the page, which begins to open now. */
export const firstSocket = new StoringSocket(new WebSocket(sceneAddress(), protocols()));
