import { standingAlone } from "./export_fonts.js";

/**
 * What style sheets say, written onto the elements themselves, so that a drawing looks
 * the same without them.
 */

/** What children take from their parents. */
const INHERITED = (
  "clip-rule color fill fill-opacity fill-rule font-family font-size font-style " +
  "font-variant font-weight image-rendering letter-spacing marker-end marker-mid " +
  "marker-start paint-order shape-rendering stroke stroke-dasharray stroke-dashoffset " +
  "stroke-linecap stroke-linejoin stroke-miterlimit stroke-opacity stroke-width " +
  "text-anchor text-rendering visibility"
).split(" ");

/** @type {[string, string][]} What each element has for itself, with its first value. */
const OWN = [
  ["clip-path", "none"],
  ["dominant-baseline", "auto"],
  ["filter", "none"],
  ["mask", "none"],
  ["opacity", "1"],
  ["vector-effect", "none"],
];

/** @type {[string, string][]} What stops of gradients have besides. */
const STOPS = [
  ["stop-color", "rgb(0, 0, 0)"],
  ["stop-opacity", "1"],
];

/** @type {Record<string, string[]>} What a style sheet may say of a shape. */
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
 * @param {Inherited} above What the copy's parent has.
 * @returns {Inherited} What the copy has.
 */
export function writeStyle(copy, style, above) {
  /** @type {Inherited} */
  const here = {};
  for (const name of INHERITED) {
    const value = style.getPropertyValue(name);
    here[name] = name === "font-family" ? standingAlone(value) : value;
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
 * @param {CSSStyleDeclaration} style Of the original, as it is drawn.
 * @param {SVGElement} original
 */
export function writeTransform(copy, style, original) {
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
