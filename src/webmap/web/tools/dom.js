import { setText } from "./elements.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/** @param {string} id */
export function byId(id) {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`console.html has no element "${id}".`);
  return element;
}

/** @param {KeyboardEvent} event */
export function typing({ target }) {
  return target instanceof Element && target.matches("input, textarea, select");
}

/**
 * Open and close the sheet on a narrow screen.
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
 * Show the selected robots on the sheet's handle, for a closed sheet.
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
    setText(text, name ? `${name}: ${states.join(" \u00b7 ")}` : count);
  };
  show();
  const timer = setInterval(show, 500);
  const off = map.onSelect(show);
  return () => {
    clearInterval(timer);
    off();
  };
}

/** Close the sheet, if it covers the map. */
export function closeSheet() {
  byId("sheet").setAttribute("aria-expanded", "false");
}
