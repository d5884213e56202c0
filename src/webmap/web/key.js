import { BASE } from "./addresses.js";

/** The subprotocol of both sockets. */
const PROTOCOL = "webmap";
const CODE = "webmap_code";

/**
 * The storage belongs to one origin, so a server on another port of the same host, which
 * receives our cookie, cannot read the key. WebMap may lie under several prefixes there.
 */
const NAME = `webmap key ${BASE.pathname}`;

/** The key as this page was given it; a browser may keep its storage closed. */
let given = "";

/** Keep the key that the server handed to this page, and clean the address bar. */
export function takeKey() {
  const element = document.querySelector('meta[name="webmap-key"]');
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
    const headers = key() ? { "webmap-key": key() } : undefined;
    const answer = await fetch(new URL("key", BASE), { method: "POST", headers });
    if (![401, 403, 421].includes(answer.status)) return "";
    return (await answer.text()).split("\n\n")[1]?.trim() ?? "";
  } catch {
    return ""; // There is no server.
  }
}
