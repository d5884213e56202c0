import { svg } from "../../web/tools/elements.js";
import { overlayOf } from "../../web/tools/overlay.js";
import { Copier, embed, keepLength, withGenericFamily } from "./export_copy.js";

/**
 * The picture of the visible map: loaded when somebody saves one.
 */

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */

/** Panels that are part of the picture, in addition to the map's content. */
const PANELS = ".webmap-scale-bar, .webmap-attribution";

/** Greatest number of pixels of a PNG; browsers refuse much larger canvases. */
const MOST_PIXELS = 32e6;

/**
 * Draw the visible map as a self-contained document: no style sheet, no script, no
 * other file.
 *
 * @param {MapCanvas} map
 * @returns {Promise<{text: string, width: number, height: number, missing: string[]}>}
 *     The document, its size in pixels, and the pictures that could not be loaded.
 */
export async function viewAsSvg(map) {
  const frame = map.svg.getBoundingClientRect();
  const { width, height } = frame;
  const copier = new Copier(frame);
  const root = svg("svg", {
    viewBox: `0 0 ${width} ${height}`,
    width: `${width}`,
    height: `${height}`,
    role: "img",
  });
  const title = svg("title", {});
  title.textContent = `${document.title}, ${new Date().toISOString()}`;
  const ground = svg("rect", {
    width: `${width}`,
    height: `${height}`,
    fill: groundOf(map.svg),
  });
  root.append(title, ground);
  const clip = `clip-${Math.random().toString(36).slice(2)}`;
  const inner = svg("g", { "clip-path": `url(#${clip})` });
  const shape = svg("rect", { width: `${width}`, height: `${height}` });
  root.append(svg("clipPath", { id: clip }, shape), inner);
  const add = (/** @type {Element} */ element) => {
    const copy = copier.copy(element, {});
    if (copy) inner.append(copy);
  };
  const addPanel = (/** @type {HTMLElement} */ panel) => {
    const drawn = drawPanel(panel, frame, (drawing) => copier.copy(drawing, {}));
    if (drawn) inner.append(drawn);
  };
  for (const child of map.svg.children) add(child);
  const overlay = overlayOf(map);
  for (const child of overlay?.children ?? []) {
    if (child.classList.contains("webmap-frame")) continue;
    // Its children have their own display value, and would be drawn.
    if (getComputedStyle(child).display === "none") continue;
    if (child instanceof SVGSVGElement) {
      for (const part of child.children) add(part);
    } else if (child instanceof HTMLElement) addPanel(child);
  }
  for (const panel of overlay?.querySelectorAll(PANELS) ?? []) {
    if (panel instanceof HTMLElement) addPanel(panel);
  }
  addReferred(root, copier);
  // A document outside all pages loads nothing and checks no content policy.
  document.implementation.createDocument(root.namespaceURI, null).adoptNode(root);
  const missing = await embed(copier.pictures);
  const text = new XMLSerializer().serializeToString(root);
  return { text, width, height, missing };
}

/**
 * @param {{text: string, width: number, height: number}} view
 * @param {number} scale Pixels of the picture for one pixel of the screen.
 * @returns {Promise<Blob>} The view as a PNG.
 */
export async function asPng({ text, width, height }, scale) {
  const address = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" }));
  try {
    const image = new Image();
    image.src = address;
    await image.decode();
    const fits = Math.min(scale, Math.sqrt(MOST_PIXELS / (width * height)));
    const canvas = document.createElement("canvas");
    canvas.width = Math.round(width * fits);
    canvas.height = Math.round(height * fits);
    const context = canvas.getContext("2d");
    if (!context) throw new Error("this browser provides no canvas");
    context.drawImage(image, 0, 0, canvas.width, canvas.height);
    return await new Promise((resolve, reject) => {
      canvas.toBlob((blob) => {
        if (blob) resolve(blob);
        else reject(new Error("the picture is too large for this browser"));
      }, "image/png");
    });
  } finally {
    URL.revokeObjectURL(address);
  }
}

/**
 * @param {Element} element
 * @returns {string} The colour of its background.
 */
function groundOf(element) {
  /** @type {Element | null} */
  let at = element;
  for (; at; at = at.parentElement) {
    const { backgroundColor } = getComputedStyle(at);
    if (backgroundColor && !/^rgba\(.*, 0\)$/.test(backgroundColor)) return backgroundColor;
  }
  return matchMedia("(prefers-color-scheme: dark)").matches &&
    getComputedStyle(document.documentElement).colorScheme.includes("dark")
    ? "#121212"
    : "#ffffff";
}

/**
 * @param {SVGSVGElement} root
 * @param {Copier} copier
 */
function addReferred(root, copier) {
  const defs = svg("defs", {});
  /** @type {Set<string>} */
  const done = new Set();
  // A referenced element may refer to more elements.
  for (const [address, target] of copier.referred) {
    if (done.has(address) || root.querySelector(CSS.escape(address).replace("\\#", "#"))) {
      continue;
    }
    done.add(address);
    const copy = copier.copy(target, {}, true);
    if (copy) defs.append(copy);
  }
  if (defs.childElementCount > 0) root.append(defs);
}

/**
 * Draw a panel of HTML with its background, its texts and its drawings.
 *
 * @param {HTMLElement} panel
 * @param {DOMRect} frame The visible area, in pixels of the window.
 * @param {(drawing: SVGSVGElement) => SVGElement | null} copy
 * @returns {SVGElement | null} null if nothing of the panel is visible.
 */
function drawPanel(panel, frame, copy) {
  const style = getComputedStyle(panel);
  const box = panel.getBoundingClientRect();
  if (style.display === "none" || style.visibility === "hidden") return null;
  const group = svg("g", {});
  if (box.width > 0 && style.backgroundColor !== "rgba(0, 0, 0, 0)") {
    group.append(
      svg("rect", {
        ...place(box, frame),
        width: `${box.width}`,
        height: `${box.height}`,
        rx: `${Number.parseFloat(style.borderTopLeftRadius) || 0}`,
        fill: style.backgroundColor,
      }),
    );
  }
  for (const child of panel.childNodes) {
    if (child instanceof Text) group.append(...lines(child, style, frame));
    else if (child instanceof SVGSVGElement) {
      const drawing = copy(child);
      if (drawing) {
        const { x, y } = place(child.getBoundingClientRect(), frame);
        group.append(svg("g", { transform: `translate(${x} ${y})` }, drawing));
      }
    } else if (child instanceof HTMLElement) {
      const inner = drawPanel(child, frame, copy);
      if (inner) group.append(inner);
    }
  }
  return group;
}

/**
 * @param {Text} text
 * @param {CSSStyleDeclaration} style
 * @param {DOMRect} frame
 * @returns {SVGTextElement[]} One element for each line of the layout.
 */
function lines(text, style, frame) {
  /** @type {{words: string, box: DOMRect, right: number}[]} */
  const found = [];
  const range = document.createRange();
  for (const { 0: word, index } of text.data.matchAll(/\S+\s*/g)) {
    range.setStart(text, index);
    range.setEnd(text, index + word.trimEnd().length);
    const box = range.getBoundingClientRect();
    const last = found.at(-1);
    if (last && Math.abs(last.box.top - box.top) < 2) {
      last.words += word;
      last.right = box.right;
    } else found.push({ words: word, box, right: box.right });
  }
  const size = Number.parseFloat(style.fontSize);
  return found.map(({ words, box, right }) => {
    const { x, y } = place(box, frame);
    const line = svg("text", {
      x,
      // The base line of most fonts, in the box of a line.
      y: `${Number(y) + box.height / 2 + 0.35 * size}`,
      fill: style.color,
      "font-family": withGenericFamily(style.fontFamily),
      "font-size": style.fontSize,
      "font-weight": style.fontWeight,
    });
    line.textContent = words.trimEnd();
    keepLength(line, right - box.left);
    return line;
  });
}

/**
 * @param {DOMRect} box
 * @param {DOMRect} frame
 */
function place(box, frame) {
  return { x: `${box.left - frame.left}`, y: `${box.top - frame.top}` };
}
