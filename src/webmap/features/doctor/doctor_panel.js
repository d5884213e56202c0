/**
 * Copying a report as text, which only a page can do.
 *
 * A page that came without TLS over a network has no clipboard of its own. There the
 * text is shown and selected, and copied by the old command or, failing that, by hand.
 */

/** How long a button says that it has copied, in milliseconds. */
const SAYS = 2000;

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
    setTimeout(() => button.classList.remove("copied"), SAYS);
  };
  document.addEventListener("click", click, { signal: ending.signal });
  return {
    destroy() {
      ending.abort();
    },
  };
}
