import { svg } from "./elements.js";
import { keepLength } from "./export_fonts.js";
import { writeStyle, writeTransform } from "./export_styles.js";

/** @typedef {import('./export_styles.js').Inherited} Inherited */

/** What a drawing may hold: nothing that runs, and no markup of another kind. */
const TAGS = new Set(
  (
    "circle clipPath defs desc ellipse g image line linearGradient marker mask path " +
    "pattern polygon polyline radialGradient rect stop svg symbol text textPath title " +
    "tspan use"
  ).split(" "),
);

/** What is drawn only where something refers to it. */
const REFERRED = new Set(
  "clipPath defs linearGradient marker mask pattern radialGradient stop symbol".split(" "),
);

/** What an element says of itself; how it looks comes from its style. */
const ATTRIBUTES = new Set(
  (
    "clipPathUnits cx cy d dx dy fx fy gradientTransform gradientUnits height id " +
    "lengthAdjust markerHeight markerUnits markerWidth maskContentUnits maskUnits offset " +
    "orient pathLength patternContentUnits patternTransform patternUnits points " +
    "preserveAspectRatio r refX refY rotate rx ry spreadMethod startOffset textLength " +
    "transform viewBox width x x1 x2 y y1 y2 data-name"
  ).split(" "),
);

/** Copies what is drawn into a document that needs nothing else. */
export class Copier {
  /** @param {DOMRect} frame What is seen, in pixels of the window. */
  constructor(frame) {
    this._frame = frame;
    /** @type {{copy: SVGElement, address: string}[]} Pictures that are still to come. */
    this.pictures = [];
    /** @type {Map<string, Element>} What is referred to and lies elsewhere. */
    this.referred = new Map();
  }

  /**
   * @param {Element} original
   * @param {Inherited} above
   * @param {boolean} [unseen] Whether it is only referred to.
   * @returns {SVGElement | null} null if there is nothing to see.
   */
  copy(original, above, unseen = false) {
    const tag = original.localName;
    if (!(original instanceof SVGElement) || !TAGS.has(tag)) return null;
    const style = getComputedStyle(original);
    const hidden = unseen || REFERRED.has(tag);
    if (!hidden && tag !== "title" && tag !== "desc" && style.display === "none") return null;
    const copy = svg(/** @type {'g'} */ (tag), {});
    for (const { name, value } of original.attributes) {
      if (ATTRIBUTES.has(name)) copy.setAttribute(name, value);
    }
    const here = writeStyle(copy, style, above);
    // What is referred to has no place, and so no transform of its own in pixels.
    if (!hidden) writeTransform(copy, style, original);
    if (!this._reference(original, copy, hidden)) return null;
    for (const child of original.childNodes) {
      if (child instanceof Text) copy.append(child.data);
      else if (child instanceof Element) {
        const inner = this.copy(child, here, hidden);
        if (inner) copy.append(inner);
      }
    }
    if (original instanceof SVGTextElement && !hidden && original.childElementCount === 0) {
      keepLength(copy, original.getComputedTextLength());
    }
    return copy;
  }

  /**
   * @param {Element} original
   * @param {SVGElement} copy
   * @param {boolean} hidden
   * @returns {boolean} Whether it is worth to be kept.
   */
  _reference(original, copy, hidden) {
    const address = original.getAttribute("href") ?? original.getAttribute("xlink:href");
    if (original.localName === "image") {
      if (!address || (!hidden && !this._isSeen(original))) return false;
      this.pictures.push({ copy, address });
    } else if (address?.startsWith("#")) {
      copy.setAttribute("href", address);
      const target = document.getElementById(address.slice(1));
      if (target) this.referred.set(address, target);
    }
    return true;
  }

  /** @param {Element} element */
  _isSeen(element) {
    const box = element.getBoundingClientRect();
    const { left, right, top, bottom } = this._frame;
    return box.right > left && box.left < right && box.bottom > top && box.top < bottom;
  }
}

/**
 * Put pictures into a drawing as data.
 *
 * @param {{copy: SVGElement, address: string}[]} pictures
 * @returns {Promise<string[]>} The addresses of those that could not be had.
 */
export async function embed(pictures) {
  /** @type {Map<string, Promise<string>>} */
  const known = new Map();
  /** @type {string[]} */
  const missing = [];
  const put = async (/** @type {SVGElement} */ copy, /** @type {string} */ address) => {
    const data = known.get(address) ?? dataOf(address);
    known.set(address, data);
    try {
      copy.setAttribute("href", await data);
    } catch {
      missing.push(address);
      copy.remove();
    }
  };
  await Promise.all(pictures.map(({ copy, address }) => put(copy, address)));
  return missing;
}

/**
 * @param {string} address Of a picture on this server.
 * @returns {Promise<string>}
 */
async function dataOf(address) {
  if (address.startsWith("data:image/")) return address;
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${address}: ${answer.status}`);
  const blob = await answer.blob();
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(String(reader.result));
    reader.onerror = () => reject(reader.error);
    reader.readAsDataURL(blob);
  });
}
