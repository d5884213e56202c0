/** @param {string} id */
export function byId(id) {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`console.html has no element "${id}".`);
  return element;
}

/**
 * Change a text, and nothing when it is the same: what is live would be read again.
 *
 * @param {Element} element
 * @param {string} text
 */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** @param {KeyboardEvent} event */
export function typing({ target }) {
  return target instanceof Element && target.matches("input, textarea, select");
}
