/** @typedef {import('../map.js').MapCanvas} MapCanvas */

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

/**
 * The sheet on a narrow screen.
 *
 * @param {AbortSignal} signal
 */
export function listenToSheet(signal) {
  const handle = byId("sheet");
  const turn = () => {
    const open = handle.getAttribute("aria-expanded") === "true";
    handle.setAttribute("aria-expanded", `${!open}`);
  };
  handle.addEventListener("click", turn, { signal });
}

/**
 * Say on the sheet's handle what is selected, for when it is closed.
 *
 * @param {MapCanvas} map
 */
export function nameSheet(map) {
  const text = byId("sheet-text");
  const show = () => {
    const row = `#robots [data-robot="${map.selected}"]`;
    const name = document.querySelector(`${row} .name`)?.textContent;
    const states = [...document.querySelectorAll(`${row} .state > *`)]
      .filter((one) => getComputedStyle(one).display !== "none")
      .map((one) => one.textContent);
    const count = byId("robots-count").textContent ?? "";
    say(text, name ? `${name}: ${states.join(" \u00b7 ")}` : count);
  };
  show();
  const timer = setInterval(show, 500);
  const off = map.onSelect(show);
  return () => {
    clearInterval(timer);
    off();
  };
}

/** Show the map again, if the sheet covers it. */
export function closeSheet() {
  byId("sheet").setAttribute("aria-expanded", "false");
}
