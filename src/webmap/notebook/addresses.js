/**
 * The addresses of pictures in a notebook, where no server is: each frame comes with the
 * pictures that it names. In the widget's bundle this module replaces `web/access.js`.
 */

/** All pictures are data. */
export const BASE = new URL("data:");

/** Below it a server of WebMap would have its pictures. */
const FOLDER = "/_webmap/";

const EMPTY = "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg'/%3E";

/** @typedef {Map<string, string>} Pictures `data:` URLs by address. */

/** @type {Pictures} */
let known = new Map();

/** @param {Pictures} pictures Those of the frame that is drawn next. */
export function usePictures(pictures) {
  known = pictures;
}

/**
 * @param {string} address
 * @returns {string | null} null if it leads elsewhere.
 */
export function resolve(address) {
  // A picture that was withdrawn meanwhile is empty until the next one comes.
  return known.get(address) ?? (address.startsWith(FOLDER) ? EMPTY : null);
}
