/** The addresses of the server that this page belongs to, and the page's key to it. */

import { CODE, FOLDER, KEY, PAGE_ID, PROTOCOL } from "./constants.js";

/** The URL below which WebMap serves its own files of this version. */
export const OWN_FILES = new URL("..", import.meta.url);

/** The URL below which WebMap serves files and sockets; its own files, of any version. */
export const BASE = new URL(/\/v-\w+\/$/.test(OWN_FILES.pathname) ? ".." : ".", OWN_FILES);

const { document: page, top = globalThis } = globalThis;

/** Whether this page is in a frame: as the server states it, or the browser. */
export const FRAMED = hasMark("webmap-frame") || top !== globalThis;

/** Milliseconds between two questions whether the person is still signed in at a proxy. */
const ASK_EVERY = 60_000;

if (hasMark("webmap-ask")) setInterval(() => void whyRefused(), ASK_EVERY);

/** @param {string} name Of an empty element in the head of the page. */
function hasMark(name) {
  return Boolean(page?.querySelector(`meta[name="${name}"]`));
}

/**
 * Resolve an address from the server to a file of the page.
 *
 * @param {string} address Those that begin with "/_webmap/" are below every prefix.
 * @param {string | URL} base The base of other addresses.
 * @returns {string | null} null if it is on another origin.
 */
export function resolve(address, base) {
  const ours = address.startsWith(FOLDER);
  try {
    const url = ours ? new URL(address.slice(FOLDER.length), BASE) : new URL(address, base);
    const web = url.protocol === "http:" || url.protocol === "https:";
    return web && url.origin === BASE.origin ? url.href : null;
  } catch {
    return null;
  }
}

/**
 * @param {string} path Below {@link BASE}.
 * @param {Record<string, string>} query
 * @returns {URL} The address of a socket.
 */
export function socketAddress(path, query) {
  const url = new URL(path, BASE);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  url.search = new URLSearchParams(FRAMED ? { ...query, frame: "" } : query).toString();
  return url;
}

/** @returns {string} The path of this page, from the application's root. */
export function pagePath() {
  const root = new URL("..", BASE).pathname;
  const path = decodeURI(location.pathname);
  return path.startsWith(root) ? `/${path.slice(root.length)}` : path;
}

/**
 * The storage belongs to one origin, so a server on another port of the same host,
 * which receives WebMap's cookie, cannot read the key. WebMap may have several prefixes
 * there, and a page in a frame has a key of its own.
 */
const TAB = `webmap key ${BASE.pathname}`;
const NAME = FRAMED ? `webmap frame key ${BASE.pathname}` : TAB;

/** The key of this page; a browser may block its storage. */
let received = "";

/** Store the key that the server sent to this page, and clean the address bar. */
export function takeKey() {
  const element = document.querySelector(`meta[name="${KEY}"]`);
  if (element instanceof HTMLMetaElement) {
    received = element.content;
    element.remove();
    try {
      localStorage.setItem(NAME, received);
    } catch {
      // The key works until the page is left.
    }
  }
  const url = new URL(location.href);
  if (!url.searchParams.has(CODE)) return;
  url.searchParams.delete(CODE);
  history.replaceState(history.state, "", url);
}

/** @returns {string} The newest key, which another tab may have received. */
function key() {
  try {
    // A frame on the same site may have the key of a tab; it states that it is a frame.
    return localStorage.getItem(NAME) ?? (received || localStorage.getItem(TAB)) ?? "";
  } catch {
    return received;
  }
}

/** @param {() => void} fn Called when another tab receives a new key. */
export function onSignIn(fn) {
  addEventListener("storage", (event) => {
    if (event.key === NAME) fn();
  });
}

/** @returns {string[]} Subprotocols: the only header that a page can set. */
export function protocols() {
  return key() ? [PROTOCOL, key()] : [PROTOCOL];
}

/**
 * Ask the server why a socket was refused: a browser does not report the reason.
 *
 * @returns {Promise<string>} A sentence; empty if the server gives no reason.
 */
export async function whyRefused() {
  try {
    const answer = await post("key");
    if (![401, 403, 421].includes(answer.status)) return "";
    return (await answer.text()).split("\n\n")[1]?.trim() ?? "";
  } catch {
    return ""; // There is no server.
  }
}

/**
 * End this browser's session, on all its pages; robots that they drive stop. Then the
 * page is loaded again, or that where a person signs out at a proxy.
 *
 * @returns {Promise<string>} Why that failed; empty if it did not.
 */
export async function signOut() {
  try {
    const answer = await post("sign-out");
    const next = answer.ok ? (await answer.text()).trim() : "";
    if (next) location.assign(next);
    else if (answer.ok) location.reload();
    return answer.ok ? "" : `You are still signed in: the server answered ${answer.status}.`;
  } catch {
    return "You are still signed in: the server does not answer.";
  }
}

/**
 * Ask the server with the key of this page.
 *
 * @param {string} path Below {@link BASE}.
 * @param {Record<string, string>} [query]
 * @returns {Promise<Response>}
 */
export function post(path, query = {}) {
  const headers = key() ? { [KEY]: key() } : undefined;
  const url = new URL(path, BASE);
  url.search = new URLSearchParams(query).toString();
  return fetch(url, { method: "POST", headers });
}

/**
 * Take the name that identifies this page's maps after a reload.
 *
 * It is in the session storage only while the page is being left: a duplicated tab
 * would else copy the name, and two pages cannot have the same name.
 *
 * @param {string} path
 * @returns {string}
 */
export function takeIdentity(path) {
  const entry = `webmap ${path}`;
  const name = take(entry) ?? newIdentity();
  addEventListener("pagehide", () => put(entry, name));
  addEventListener("pageshow", () => take(entry));
  return name;
}

function newIdentity() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/**
 * @param {string} entry
 * @returns {string | null}
 */
function take(entry) {
  try {
    const name = sessionStorage.getItem(entry);
    sessionStorage.removeItem(entry);
    return name && new RegExp(PAGE_ID).test(name) ? name : null;
  } catch {
    // A browser may block its storage; a reload then has a new name.
    return null;
  }
}

/**
 * @param {string} entry
 * @param {string} name
 */
function put(entry, name) {
  try {
    sessionStorage.setItem(entry, name);
  } catch {
    // As above.
  }
}
