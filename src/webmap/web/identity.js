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
  const key = `webmap ${path}`;
  const name = take(key) ?? newIdentity();
  addEventListener("pagehide", () => put(key, name));
  addEventListener("pageshow", () => take(key));
  return name;
}

function newIdentity() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/**
 * @param {string} key
 * @returns {string | null}
 */
function take(key) {
  try {
    const name = sessionStorage.getItem(key);
    sessionStorage.removeItem(key);
    return name && /^[\w-]{8,64}$/.test(name) ? name : null;
  } catch {
    // A browser may keep its storage closed; a reload then starts anew.
    return null;
  }
}

/**
 * @param {string} key
 * @param {string} name
 */
function put(key, name) {
  try {
    sessionStorage.setItem(key, name);
  } catch {
    // As above.
  }
}
