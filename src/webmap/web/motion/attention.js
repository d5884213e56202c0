/**
 * Whether somebody looks at this page and drives with it, rather than typing in it or
 * working in another window.
 */

/** Input types that one does not type into and that arrow keys do not change. */
const BUTTON_LIKE = new Set([
  "button",
  "submit",
  "reset",
  "checkbox",
  "image",
  "file",
  "color",
]);

/**
 * @param {EventTarget | null} target
 * @returns {boolean} Whether keys belong to this element: text fields, lists, sliders.
 */
export function takesKeys(target) {
  if (!(target instanceof Element)) return false;
  if (target instanceof HTMLInputElement) return !BUTTON_LIKE.has(target.type);
  if (target instanceof HTMLElement && target.isContentEditable) return true;
  return target.matches(
    "textarea, select, [role=textbox], [role=slider], [role=listbox]",
  );
}

/** What covers the page, or says (`data-hands-off`) that nobody drives while it is open. */
const COVERS = ":modal, dialog[open][data-hands-off]";

/** @returns {boolean} Whether an input held now may move a robot. */
export function attentive() {
  return (
    document.visibilityState === "visible" &&
    document.hasFocus() &&
    !takesKeys(document.activeElement) &&
    document.querySelector(COVERS) === null
  );
}

/**
 * Watch for everything that makes it doubtful that the operator is still driving.
 *
 * @param {(left: boolean) => void} onDistraction Called at once; `left` says that the page
 *     is hidden or going away, so that leases should be given back as well.
 * @param {() => void} onReturn Called when the page comes back from a freeze or from
 *     the back-forward cache, where its connections have died unnoticed.
 * @returns {() => void} Stops watching.
 */
export function watchAttention(onDistraction, onReturn) {
  const ending = new AbortController();
  const options = { signal: ending.signal, capture: true };
  const doubt = () => onDistraction(false);
  const leave = () => onDistraction(true);
  window.addEventListener(
    "blur",
    (event) => {
      if (event.target === window) doubt();
    },
    options,
  );
  window.addEventListener("contextmenu", doubt, options);
  // While something is dragged out of its place no key is heard, nor its release.
  window.addEventListener(
    "dragstart",
    (event) => {
      if (!event.defaultPrevented) doubt();
    },
    { signal: ending.signal },
  );
  window.addEventListener(
    "focusin",
    (event) => {
      if (takesKeys(event.target)) doubt();
    },
    options,
  );
  window.addEventListener("pagehide", leave, options);
  window.addEventListener(
    "pageshow",
    (event) => {
      if (event.persisted) onReturn();
    },
    options,
  );
  document.addEventListener(
    "visibilitychange",
    () => {
      if (document.visibilityState === "hidden") leave();
    },
    options,
  );
  document.addEventListener("freeze", leave, options);
  document.addEventListener("resume", onReturn, options);
  return () => ending.abort();
}
