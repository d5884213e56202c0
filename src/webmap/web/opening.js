/**
 * The page's identity, and its first socket.
 *
 * This module is small and comes before `page.js`: the display makes the first picture
 * while the browser still loads and compiles the others. The console and generated pages
 * have it in their HTML, where it runs before the style sheets are there.
 */

import { pagePath, protocols, socketAddress, takeIdentity, takeKey } from "./access.js";
import { LONGEST_TEXTS } from "./constants.js";
import { unpacked } from "./packed.js";
import { containers } from "./sizes.js";

/** The relation of links to the bundles that a page loads next. */
const NEXT = "webmap-next";

takeKey();

/** The path of this page, from the application's root. */
export const path = pagePath();

/** The name that identifies this page, also after a reload. */
export const id = takeIdentity(path);

/**
 * Whether the socket opens before the style sheets are there: the page knows no sizes
 * yet, and the display takes the window's until the page reports its view.
 */
let early = document.body === null;

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
    gzip: "DecompressionStream" in globalThis,
    containers: early ? {} : containers(),
  };
  return socketAddress("scene", { page: path, id, hello: JSON.stringify(hello) });
}

// It begins to open now. When the page opens another socket, it knows its sizes.
const socket = new WebSocket(sceneAddress(), protocols());
early = false;
socket.binaryType = "arraybuffer";
/** @type {import('./link.js').FirstSocket["received"]} */
const received = [];

/** Load what comes after the data of the first picture: on a slow link it delays them. */
function loadNext() {
  for (const link of document.querySelectorAll(`link[rel="${NEXT}"]`)) {
    link.setAttribute("rel", "modulepreload");
  }
}

/** @param {MessageEvent} message */
function store({ data }) {
  if (!(data instanceof ArrayBuffer)) return;
  received.push({ data: unpacked(data), at: performance.now() });
  loadNext();
}
socket.addEventListener("message", store);

/**
 * Return the first socket, and store no more of its messages.
 *
 * @returns {import('./link.js').FirstSocket}
 */
export function takeFirstSocket() {
  socket.removeEventListener("message", store);
  loadNext();
  return { socket, received };
}
