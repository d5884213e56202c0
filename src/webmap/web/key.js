import { BASE } from "./addresses.js";
import { CODE, KEY, PAGE_ID, PROTOCOL } from "./constants.js";

/**
 * The storage belongs to one origin, so a server on another port of the same host, which
 * receives our cookie, cannot read the key. WebMap may lie under several prefixes there.
 */
const NAME = `webmap key ${BASE.pathname}`;

/** The key as this page was given it; a browser may keep its storage closed. */
let given = "";

/** Keep the key that the server handed to this page, and clean the address bar. */
export function takeKey() {
  const element = document.querySelector(`meta[name="${KEY}"]`);
  if (element instanceof HTMLMetaElement) {
    given = element.content;
    element.remove();
    try {
      localStorage.setItem(NAME, given);
    } catch {
      // This page works until it is left.
    }
  }
  const url = new URL(location.href);
  if (!url.searchParams.has(CODE)) return;
  url.searchParams.delete(CODE);
  history.replaceState(history.state, "", url);
}

/** @returns {string} The newest key, which another tab may have been given. */
function key() {
  try {
    return localStorage.getItem(NAME) ?? given;
  } catch {
    return given;
  }
}

/** @param {() => void} fn Called when another tab is given a new key. */
export function onSignIn(fn) {
  addEventListener("storage", (event) => {
    if (event.key === NAME) fn();
  });
}

/** @returns {string[]} What a socket offers: a page can set no header of it but this. */
export function protocols() {
  return key() ? [PROTOCOL, key()] : [PROTOCOL];
}

/**
 * Ask why a socket was refused, which a browser does not tell a page.
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
 * Take the name by which this page's maps are found again after a reload.
 *
 * It lies in the session's storage only while the page is being left: a tab that is
 * duplicated would else take the name along, and two pages cannot have one.
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
    // A browser may keep its storage closed; a reload then starts anew.
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
