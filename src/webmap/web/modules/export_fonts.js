/**
 * Texts that take the same room where the fonts of this machine are not there.
 */

/** The names for a kind of font that every program knows, not only a browser. */
const KINDS = new Set(["serif", "sans-serif", "monospace", "cursive", "fantasy"]);

/**
 * @param {string} families As a style sheet says it, `system-ui`.
 * @returns {string} The same, and at its end a kind of font that every program has. What
 *     stands there already stays in its order, so that this machine draws as before.
 */
export function standingAlone(families) {
  const named = families.split(",").map((each) => each.trim().toLowerCase());
  if (named.some((each) => KINDS.has(each))) return families;
  const kind = named.includes("ui-monospace") ? "monospace" : "sans-serif";
  return named[0] === "" ? kind : `${families}, ${kind}`;
}

/**
 * Keep a text as long as it is drawn here, whatever the font.
 *
 * @param {SVGElement} copy
 * @param {number} length In the units of the text; nothing is kept of 0.
 */
export function keepLength(copy, length) {
  if (!(length > 0) || copy.hasAttribute("textLength")) return;
  copy.setAttribute("textLength", String(Number(length.toPrecision(6))));
  copy.setAttribute("lengthAdjust", "spacingAndGlyphs");
}
