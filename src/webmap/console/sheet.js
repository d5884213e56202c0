import { byId, say } from "./dom.js";

/** @typedef {import('./console.js').MapCanvas} MapCanvas */

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
    const row = document.querySelector(`#robots [data-robot="${map.selected}"]`);
    const name = row?.querySelector(".name")?.textContent;
    const who = row?.hasAttribute("data-mine") ? ".you" : ".holder";
    const state = row?.querySelector(row.querySelector(".age.stale") ? ".state .old" : who);
    const count = byId("robots-count").textContent ?? "";
    say(text, name ? `${name}: ${state?.textContent ?? ""}` : count);
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
