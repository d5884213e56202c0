import { FOLDER } from "./constants.js";

/** The URL below which WebMap serves its own files of this version. */
export const OWN_FILES = new URL("..", import.meta.url);

/** The URL below which WebMap serves files and sockets; its own files, of any version. */
export const BASE = new URL(/\/v-\w+\/$/.test(OWN_FILES.pathname) ? ".." : ".", OWN_FILES);

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
  url.search = new URLSearchParams(query).toString();
  return url;
}

/** @returns {string} The path of this page, from the application's root. */
export function pagePath() {
  const root = new URL("..", BASE).pathname;
  const path = decodeURI(location.pathname);
  return path.startsWith(root) ? `/${path.slice(root.length)}` : path;
}
