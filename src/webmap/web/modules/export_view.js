import { svg } from "./elements.js";
import { Copier, embed } from "./export_copy.js";
import { drawPanel } from "./export_words.js";
import { overlayOf } from "./overlay.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/** Panels that belong to the picture, beside what lies on the map itself. */
const PANELS = ".webmap-scale-bar, .webmap-attribution";

/** Pixels of a PNG, at the most; browsers refuse canvases that are much larger. */
const MOST_PIXELS = 32e6;

/**
 * Draw what is seen of a map as a document that needs nothing else: no style sheet, no
 * script, no other file.
 *
 * @param {MapCanvas} map
 * @returns {Promise<{text: string, width: number, height: number, missing: string[]}>}
 *     The document, its size in pixels, and the pictures that could not be had.
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
  for (const child of map.svg.children) add(child);
  const overlay = overlayOf(map);
  for (const child of overlay?.children ?? []) {
    if (child.classList.contains("webmap-frame")) continue;
    // Its children have a display of their own, and would be drawn.
    if (getComputedStyle(child).display === "none") continue;
    if (child instanceof SVGSVGElement) {
      for (const part of child.children) add(part);
    } else if (child instanceof HTMLElement) {
      const drawn = drawPanel(child, frame, (drawing) => copier.copy(drawing, {}));
      if (drawn) inner.append(drawn);
    }
  }
  for (const panel of overlay?.querySelectorAll(PANELS) ?? []) {
    if (!(panel instanceof HTMLElement)) continue;
    const drawn = drawPanel(panel, frame, (drawing) => copier.copy(drawing, {}));
    if (drawn) inner.append(drawn);
  }
  addReferred(root, copier);
  // In a document that is on no page nothing is loaded, and no policy of it asked.
  document.implementation.createDocument(root.namespaceURI, null).adoptNode(root);
  const missing = await embed(copier.pictures);
  const text = new XMLSerializer().serializeToString(root);
  return { text, width, height, missing };
}

/**
 * @param {{text: string, width: number, height: number}} view
 * @param {number} scale Pixels of the picture for one of the screen.
 * @returns {Promise<Blob>} The same as a PNG.
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
    if (!context) throw new Error("this browser gives no canvas");
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
 * @param {Date} now
 * @param {string} ending
 * @returns {string} A name that sorts by time and that every system takes.
 */
export function fileName(now, ending) {
  const two = (/** @type {number} */ n) => String(n).padStart(2, "0");
  const day = [now.getFullYear(), two(now.getMonth() + 1), two(now.getDate())].join("-");
  const time = [now.getHours(), now.getMinutes(), now.getSeconds()].map(two).join("");
  return `webmap-${day}-${time}.${ending}`;
}

/**
 * @param {Element} element
 * @returns {string} The colour that lies behind it.
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
  // What is referred to may refer to more.
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
