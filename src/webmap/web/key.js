import { BASE } from "./addresses.js";
import { CODE, KEY, PAGE_ID, PROTOCOL } from "./constants.js";

/**
 * The storage belongs to one origin, so a server on another port of the same host,
 * which receives WebMap's cookie, cannot read the key. WebMap may have several prefixes
 * there.
 */
const NAME = `webmap key ${BASE.pathname}`;

/** The key of this page; a browser may block its storage. */
let given = "";

/** Store the key that the server sent to this page, and clean the address bar. */
export function takeKey() {
  const element = document.querySelector(`meta[name="${KEY}"]`);
  if (element instanceof HTMLMetaElement) {
    given = element.content;
    element.remove();
    try {
      localStorage.setItem(NAME, given);
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
    return localStorage.getItem(NAME) ?? given;
  } catch {
    return given;
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
    const headers = key() ? { [KEY]: key() } : undefined;
    const answer = await fetch(new URL("key", BASE), { method: "POST", headers });
    if (![401, 403, 421].includes(answer.status)) return "";
    return (await answer.text()).split("\n\n")[1]?.trim() ?? "";
  } catch {
    return ""; // There is no server.
  }
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
