import { byId, typing } from "./dom.js";

/**
 * Help lies beside STOP and is no modal dialog: that would take STOP's clicks. While it
 * is open no input moves a robot (`data-hands-off`), as it covers what the operator would
 * have to see. Esc closes it, unless this page drives: then Esc is STOP.
 *
 * @param {import('./console.js').Drive} drive
 * @param {AbortSignal} signal
 */
export function listenToHelp(drive, signal) {
  const help = /** @type {HTMLDialogElement} */ (byId("help"));
  const turn = () => {
    if (help.open) help.close();
    else {
      drive.doubt();
      help.show();
      byId("help-open").setAttribute("aria-expanded", "true");
    }
  };
  const closed = () => {
    byId("help-open").setAttribute("aria-expanded", "false");
    byId("help-open").focus();
  };
  help.addEventListener("close", closed, { signal });
  byId("help-open").addEventListener("click", turn, { signal });
  byId("help-close").addEventListener("click", turn, { signal });
  const outside = (/** @type {PointerEvent} */ { target }) => {
    const map = target instanceof Element && target.closest("svg.webmap");
    if (help.open && map) turn();
  };
  document.addEventListener("pointerdown", outside, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "?" || typing(event)) return;
    event.preventDefault();
    turn();
  };
  document.addEventListener("keydown", key, { signal });
  return drive.on("stop", () => {
    if (help.open) turn();
  });
}
