import { SVG_TAGS } from "../../web/opcodes.js";
import { svg } from "../../web/tools/elements.js";

/** Elements that a drawing may contain: no scripts, and no other markup. */
const TAGS = new Set(SVG_TAGS);

/** Elements that are drawn only where another element refers to them. */
const REFERRED = new Set(
  "clipPath defs linearGradient marker mask pattern radialGradient stop symbol".split(" "),
);

/** Attributes of an element's own; its appearance comes from its style. */
const ATTRIBUTES = new Set(
  (
    "clipPathUnits cx cy d dx dy fx fy gradientTransform gradientUnits height id " +
    "lengthAdjust markerHeight markerUnits markerWidth maskContentUnits maskUnits offset " +
    "orient pathLength patternContentUnits patternTransform patternUnits " +
    "preserveAspectRatio r refX refY rotate rx ry spreadMethod startOffset textLength " +
    "transform viewBox width x x1 x2 y y1 y2 data-name"
  ).split(" "),
);

/** @param {DOMPoint} point Its numbers are 32-bit floats, which have eight digits. */
const pairOf = ({ x, y }) => [x, y].map((n) => Number(n.toPrecision(8))).join();

/** Copies the visible map into a self-contained document. */
export class Copier {
  /** @param {DOMRect} frame The visible area, in pixels of the window. */
  constructor(frame) {
    this._frame = frame;
    /**
     * @type {{copy: SVGElement, address: string}[]} Pictures that are not loaded yet.
     */
    this.pictures = [];
    /** @type {Map<string, Element>} Elements that are referred to and are elsewhere. */
    this.referred = new Map();
  }

  /**
   * @param {Element} original
   * @param {Inherited} above
   * @param {boolean} [unseen] Whether it is only referred to.
   * @returns {SVGElement | null} null if nothing is visible.
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
    // The attribute has only six digits of the points of a line.
    const { points } = /** @type {SVGPolylineElement} */ (original);
    if (points) copy.setAttribute("points", Array.from(points, pairOf).join(" "));
    const here = writeStyle(copy, style, above);
    // An element that is only referred to has no position, and so no transform in
    // pixels.
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
   * @returns {boolean} Whether to keep the copy.
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
 * Embed pictures into a drawing as data.
 *
 * @param {{copy: SVGElement, address: string}[]} pictures
 * @returns {Promise<string[]>} The addresses of pictures that could not be loaded.
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

/**
 * Styles of style sheets, written onto the elements, so that a drawing looks the same
 * without style sheets.
 */

/** Properties that children inherit from their parents. */
const INHERITED = (
  "clip-rule color fill fill-opacity fill-rule font-family font-size font-style " +
  "font-variant font-weight image-rendering letter-spacing marker-end marker-mid " +
  "marker-start paint-order shape-rendering stroke stroke-dasharray stroke-dashoffset " +
  "stroke-linecap stroke-linejoin stroke-miterlimit stroke-opacity stroke-width " +
  "text-anchor text-rendering visibility"
).split(" ");

/**
 * @type {[string, string][]} Properties that each element has for itself, with their
 *     initial values.
 */
const OWN = [
  ["clip-path", "none"],
  ["dominant-baseline", "auto"],
  ["filter", "none"],
  ["mask", "none"],
  ["opacity", "1"],
  ["vector-effect", "none"],
];

/** @type {[string, string][]} Additional properties of gradient stops. */
const STOPS = [
  ["stop-color", "rgb(0, 0, 0)"],
  ["stop-opacity", "1"],
];

/** @type {Record<string, string[]>} Geometry of shapes that a style sheet may set. */
const GEOMETRY = {
  circle: ["cx", "cy", "r"],
  ellipse: ["cx", "cy", "rx", "ry"],
  image: ["x", "y", "width", "height"],
  rect: ["x", "y", "width", "height", "rx", "ry"],
};

/** @typedef {Record<string, string>} Inherited */

/**
 * @param {SVGElement} copy
 * @param {CSSStyleDeclaration} style Of the original.
 * @param {Inherited} above The styles of the copy's parent.
 * @returns {Inherited} The styles of the copy.
 */
function writeStyle(copy, style, above) {
  /** @type {Inherited} */
  const here = {};
  for (const name of INHERITED) {
    const value = style.getPropertyValue(name);
    here[name] = name === "font-family" ? withGenericFamily(value) : value;
    if (here[name] === above[name]) copy.removeAttribute(name);
    else copy.setAttribute(name, here[name]);
  }
  const own = copy.localName === "stop" ? [...OWN, ...STOPS] : OWN;
  for (const [name, first] of own) {
    const value = style.getPropertyValue(name);
    if (value === first || value === "") copy.removeAttribute(name);
    else copy.setAttribute(name, value);
  }
  for (const name of GEOMETRY[copy.localName] ?? []) {
    const value = style.getPropertyValue(name);
    if (value && value !== "auto" && value !== "normal") copy.setAttribute(name, value);
  }
  const blend = style.getPropertyValue("mix-blend-mode");
  if (blend && blend !== "normal") copy.style.setProperty("mix-blend-mode", blend);
  return here;
}

/**
 * @param {SVGElement} copy
 * @param {CSSStyleDeclaration} style Of the original, as drawn.
 * @param {SVGElement} original
 */
function writeTransform(copy, style, original) {
  const text = style.transform;
  if (text === "none" || text === "") {
    copy.removeAttribute("transform");
    return;
  }
  let m = new DOMMatrix(text);
  let [x, y] = style.transformOrigin.split(" ").map(Number.parseFloat);
  const box = style.getPropertyValue("transform-box");
  if (box === "fill-box" && original instanceof SVGGraphicsElement) {
    const around = original.getBBox();
    x += around.x;
    y += around.y;
  }
  if (x || y) m = new DOMMatrix().translate(x, y).multiply(m).translate(-x, -y);
  const numbers = [m.a, m.b, m.c, m.d, m.e, m.f].map((n) => Number(n.toPrecision(9)));
  copy.setAttribute("transform", `matrix(${numbers.join(" ")})`);
}

/** Texts that keep their size where this machine's fonts are missing. */

/** Generic font families that every program knows, not only browsers. */
const KINDS = new Set(["serif", "sans-serif", "monospace", "cursive", "fantasy"]);

/**
 * @param {string} families As in a style sheet, such as `system-ui`.
 * @returns {string} The same list with a generic family at its end. The existing order
 *     stays, so that this machine draws as before.
 */
export function withGenericFamily(families) {
  const named = families.split(",").map((each) => each.trim().toLowerCase());
  if (named.some((each) => KINDS.has(each))) return families;
  const kind = named.includes("ui-monospace") ? "monospace" : "sans-serif";
  return named[0] === "" ? kind : `${families}, ${kind}`;
}

/**
 * Keep the drawn length of a text with any font.
 *
 * @param {SVGElement} copy
 * @param {number} length In the units of the text; 0 has no effect.
 */
export function keepLength(copy, length) {
  if (!(length > 0) || copy.hasAttribute("textLength")) return;
  copy.setAttribute("textLength", String(Number(length.toPrecision(6))));
  copy.setAttribute("lengthAdjust", "spacingAndGlyphs");
}
