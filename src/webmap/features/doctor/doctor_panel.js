/**
 * Copies a report as text, which only the browser can do.
 *
 * A page without TLS over a network has no clipboard API. There the text is shown and
 * selected, and copied by the old command or, if that fails, by the user.
 */

/** Milliseconds for which a button confirms that it has copied. */
const SHOWN = 2000;

/** @param {Element} text */
function select(text) {
  text.classList.add("shown");
  const range = document.createRange();
  range.selectNodeContents(text);
  const selection = getSelection();
  selection?.removeAllRanges();
  selection?.addRange(range);
}

/**
 * @param {Element} text
 * @returns {Promise<boolean>}
 */
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text.textContent ?? "");
    return true;
  } catch {
    select(text);
    return document.execCommand("copy");
  }
}

export default function attach() {
  const ending = new AbortController();
  const click = async (/** @type {MouseEvent} */ event) => {
    if (!(event.target instanceof Element)) return;
    const button = event.target.closest("[data-copy=doctor]");
    const text = button?.closest(".doctor")?.querySelector("pre");
    if (!button || !text || !(await copy(text))) return;
    button.classList.add("copied");
    setTimeout(() => button.classList.remove("copied"), SHOWN);
  };
  document.addEventListener("click", click, { signal: ending.signal });
  return { destroy: () => ending.abort() };
}
