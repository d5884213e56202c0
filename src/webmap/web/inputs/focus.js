/**
 * Whether the operator is looking at this page and can drive with it, not typing in it or
 * working in another window.
 */

/** Input types without text, whose value arrow keys do not change. */
const BUTTON_LIKE = new Set([
  "button",
  "submit",
  "reset",
  "checkbox",
  "image",
  "file",
  "color",
]);

/** Elements without text that use keys. */
const KEY_CONTROLS =
  "input[type=radio], input[type=range], select, [role=slider], [role=listbox], [role=separator]";

/**
 * @param {EventTarget | null} target
 * @returns {boolean} Whether text is typed in this element.
 */
export function takesText(target) {
  if (!(target instanceof Element) || target.matches(KEY_CONTROLS)) return false;
  if (target instanceof HTMLInputElement) return !BUTTON_LIKE.has(target.type);
  if (target instanceof HTMLElement && target.isContentEditable) return true;
  return target.matches("textarea, [role=textbox]");
}

/**
 * @param {EventTarget | null} target
 * @returns {boolean} Whether keys belong to this element: text fields, lists, sliders.
 */
export function takesKeys(target) {
  if (!(target instanceof Element)) return false;
  return takesText(target) || target.matches(KEY_CONTROLS);
}

/**
 * Called with each tick, so it looks at dialogs alone: a search for `:modal` looks at all
 * elements of the page.
 *
 * @returns {boolean} Whether an element covers the page, or an open dialog forbids driving
 *     (`data-hands-off`).
 */
function isCovered() {
  const full = document.fullscreenElement;
  // The whole page in full screen covers nothing.
  if (full !== document.documentElement && full?.matches(":modal")) return true;
  return [...document.getElementsByTagName("dialog")].some(
    (dialog) => dialog.open && (dialog.matches(":modal") || "handsOff" in dialog.dataset),
  );
}

/** @returns {boolean} Whether inputs may move a robot now. */
export function attentive() {
  return (
    document.visibilityState === "visible" &&
    document.hasFocus() &&
    !takesKeys(document.activeElement) &&
    !isCovered()
  );
}

/**
 * Watch for all events after which the operator may not be driving any more.
 *
 * @param {(left: boolean) => void} onDistraction Called immediately; `left`: whether
 *     the page is hidden or going away, so that leases should be released too.
 * @param {() => void} onReturn Called when the page returns from a freeze or from the
 *     back-forward cache: its connections may be dead.
 * @returns {() => void} Stops watching.
 */
export function watchAttention(onDistraction, onReturn) {
  const ending = new AbortController();
  const { signal } = ending;
  const options = { signal, capture: true };
  const distract = () => onDistraction(false);
  const leave = () => onDistraction(true);
  const blur = (/** @type {Event} */ { target }) => target === window && distract();
  const drag = (/** @type {Event} */ event) => !event.defaultPrevented && distract();
  const focus = (/** @type {Event} */ { target }) => takesKeys(target) && distract();
  const back = (/** @type {PageTransitionEvent} */ event) => {
    if (event.persisted) onReturn();
  };
  const hide = () => document.visibilityState === "hidden" && leave();
  window.addEventListener("blur", blur, options);
  window.addEventListener("contextmenu", distract, options);
  // During a drag the page receives neither keys nor their releases.
  window.addEventListener("dragstart", drag, { signal });
  window.addEventListener("focusin", focus, options);
  window.addEventListener("pagehide", leave, options);
  window.addEventListener("pageshow", back, options);
  document.addEventListener("visibilitychange", hide, options);
  document.addEventListener("freeze", leave, options);
  document.addEventListener("resume", onReturn, options);
  return () => ending.abort();
}
