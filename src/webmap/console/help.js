import { byId, typing } from "./dom.js";

/** @param {AbortSignal} signal */
export function listenToHelp(signal) {
  const help = /** @type {HTMLDialogElement} */ (byId("help"));
  byId("help-open").addEventListener("click", () => help.showModal(), { signal });
  byId("help-close").addEventListener("click", () => help.close(), { signal });
  const outside = (/** @type {MouseEvent} */ event) => {
    if (event.target === help) help.close();
  };
  help.addEventListener("click", outside, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "?" || typing(event)) return;
    event.preventDefault();
    if (help.open) help.close();
    else help.showModal();
  };
  document.addEventListener("keydown", key, { signal });
}
