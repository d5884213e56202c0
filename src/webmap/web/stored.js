/** What a browser stores for an operator: choices that a page starts with again. */

/**
 * @param {string} key
 * @returns {any} The stored value; null if there is none, if it is no JSON, or if the
 *     browser has no storage.
 */
export function readStored(key) {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "null");
  } catch {
    return null;
  }
}

/**
 * Store a value, if the browser has storage and room: else it lasts as long as the page.
 *
 * @param {string} key
 * @param {unknown} value
 */
export function store(key, value) {
  try {
    localStorage.setItem(key, JSON.stringify(value));
  } catch {
    // There is no storage, or no room.
  }
}
