/**
 * Read what a page draws: one line for each element of its body, indented by its depth.
 *
 * A line has the element's tag, id and classes, its attributes, the paint of a shape of
 * SVG, the box in the window, "unseen" if nothing of it is drawn, and a quotation mark if
 * there is text in it. The texts are left out: while the boxes are read, every text is
 * the same letter, so that a different text does not change the layout.
 *
 * @param {object} options
 * @param {string} options.hidden A selector of elements; inside these, the content of
 *     hidden elements is read, too.
 * @param {string[]} options.closed Selectors of elements whose content is only counted.
 * @param {string[]} options.absent Selectors of elements that are left out.
 * @param {string[]} options.unordered Selectors of elements whose children come in any
 *     order; they are sorted here.
 * @param {string[]} options.level Selectors of elements in which neighbours with the same
 *     tag and classes come in any order.
 * @param {[string, string][]} options.unstable Selectors, each with an attribute that is
 *     left out.
 */
async ({ hidden, closed, absent, unordered, level, unstable }) => {
  const TEXTS = new Set([
    "alt", "aria-description", "aria-label", "aria-roledescription", "aria-valuetext",
    "placeholder", "title",
  ]);
  // Ages count up, and a pose has the number of its message.
  const UNSTABLE = new Set(["data-age", "data-since", "data-pose"]);
  const NUMBERED =
    /^(for|form|list|popovertarget|aria-(controls|labelledby|describedby)|data-(robot|layer-of|bridge|camera-id))$/;
  const SHAPES = "path, polyline, polygon, line, circle, ellipse, rect, text, use";
  const NUMBER = /(?<!#\w*)-?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?/g;
  // Attributes with more numbers are summed up.
  const LONG = 40;

  // Numbers of a process are replaced at the end, in the order of the lines.
  const numbered = (id) => (/\d/.test(id) ? `~{${id}}` : id);
  const short = (number, digits = 3) => {
    const text = number.toFixed(digits);
    const plain = text.includes(".") ? text.replace(/\.?0+$/, "") : text;
    return plain === "-0" ? "0" : plain;
  };

  /** Summarize points: minimum, maximum, mean, and the mean weighted by order. */
  const points = (pairs) =>
    [0, 1]
      .map((axis) => {
        const own = pairs.map((pair) => pair[axis]);
        const mean = own.reduce((sum, n) => sum + n, 0) / own.length;
        const late = own.reduce((sum, n, i) => sum + (n * i) / own.length, 0) / own.length;
        const least = own.reduce((a, b) => Math.min(a, b), Infinity);
        const most = own.reduce((a, b) => Math.max(a, b), -Infinity);
        return [least, most, mean, late].map((n) => short(n)).join(" ");
      })
      .join(" | ");

  /** Round numbers; of many numbers, return the count and a summary of the points. */
  const digest = (text) => {
    const all = text.match(NUMBER) ?? [];
    if (all.length <= LONG) return text.replace(NUMBER, (n) => short(Number(n)));
    const letters = text.replace(NUMBER, "").replace(/[\s,.]+/g, "");
    const kinds = [...new Set(letters)].map((c) => `${c}${letters.split(c).length - 1}`);
    const starts = letters ? "[ML]" : "";
    const pair = new RegExp(`${starts}\\s*(${NUMBER.source})[\\s,]+(${NUMBER.source})`, "g");
    const pairs = [...text.matchAll(pair)].map((found) => found.slice(1).map(Number));
    const size = all.reduce((sum, n) => sum + Math.abs(Number(n)), 0) / all.length;
    return `${[...kinds, `${all.length}n`].join(" ")} <${points(pairs)} | ${short(size)}>`;
  };

  const matrix = (element) => {
    let m = new DOMMatrix();
    // Not consolidate(), which would replace the objects that the client keeps.
    for (const each of element.transform.baseVal) m = m.multiply(DOMMatrix.fromMatrix(each.matrix));
    return [m.a, m.b, m.c, m.d, m.e, m.f].map((n) => short(n)).join(" ");
  };

  /** The size of a picture, and the mean colour of each of its four quarters. */
  const pixels = (source, width, height) => {
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width, height });
    const pen = canvas.getContext("2d", { willReadFrequently: true });
    pen.drawImage(source, 0, 0);
    const [w, h] = [Math.max(1, width >> 1), Math.max(1, height >> 1)];
    const corners = [[0, 0], [width - w, 0], [0, height - h], [width - w, height - h]];
    const means = corners.map(([x, y]) => {
      const { data } = pen.getImageData(x, y, w, h);
      const sums = [0, 0, 0, 0];
      for (let i = 0; i < data.length; i += 1) sums[i % 4] += data[i];
      return sums.map((sum) => Math.round((4 * sum) / data.length)).join(" ");
    });
    return `${width}x${height} {${means.join(" | ")}}`;
  };

  // The pixels of an <image> cannot be read, so its file is loaded once more.
  const pictures = (window.picturesRead ??= new Map());
  for (const { href } of document.querySelectorAll("image")) {
    const address = href.baseVal;
    if (!address || pictures.has(address)) continue;
    const image = new Image();
    image.src = address;
    const loaded = await image.decode().then(() => true, () => false);
    if (loaded) pictures.set(address, pixels(image, image.naturalWidth, image.naturalHeight));
  }
  const shown = (element) => {
    if (element instanceof HTMLCanvasElement) return pixels(element, element.width, element.height);
    if (element instanceof HTMLImageElement && element.naturalWidth) {
      return pixels(element, element.naturalWidth, element.naturalHeight);
    }
    return pictures.get(element.href?.baseVal) ?? "~";
  };

  const attributes = (element) => {
    const found = [];
    for (const { name, value } of [...element.attributes].sort((a, b) =>
      a.name < b.name ? -1 : 1,
    )) {
      if (unstable.some(([selector, own]) => own === name && element.matches(selector))) continue;
      if (name === "id" || name === "class" || TEXTS.has(name) || UNSTABLE.has(name)) continue;
      if (name === "transform" && element.transform) found.push(`transform=[${matrix(element)}]`);
      else if (name === "style") {
        const { style } = element;
        for (const key of [...style].sort()) {
          const css = style.getPropertyValue(key).trim();
          // Pixels are in the box.
          found.push(`style.${key}=${/^-?[\d.]+px$/.test(css) ? "px" : digest(css)}`);
        }
      } else if (name === "href" || name === "src") {
        const own = value.startsWith("#") ? `#${numbered(value.slice(1))}` : "";
        found.push(`${name}=${own || shown(element)}`);
      } else if (name === "points" && value) {
        // As in a text of Python; the browser writes a list of points without commas.
        found.push(`points=${digest(Array.from(element.points, ({ x, y }) => `${x},${y}`).join(" "))}`);
      } else if (NUMBERED.test(name)) {
        found.push(`${name}=${value.split(" ").map(numbered).join(" ")}`);
      } else {
        const named = value.replace(/url\("?#([^)"]*)"?\)/g, (_, id) => `url(#${numbered(id)})`);
        const plain = name.startsWith("data-") && !/^-?[\d.]+$/.test(value);
        found.push(named === "" ? name : `${name}=${plain ? named : digest(named)}`);
      }
    }
    if (element instanceof HTMLCanvasElement) found.push(`pixels=${shown(element)}`);
    return found;
  };

  const paint = (element) => {
    const style = getComputedStyle(element);
    const colour = (text) =>
      text.replace(/^rgb\((\d+), (\d+), (\d+)\)$/, (_, ...c) =>
        `#${c.slice(0, 3).map((n) => Number(n).toString(16).padStart(2, "0")).join("")}`,
      ).replaceAll(", ", ",");
    const parts = [`fill ${colour(style.fill)}`];
    if (style.fillOpacity !== "1") parts.push(`at ${short(Number(style.fillOpacity))}`);
    if (style.stroke !== "none") {
      parts.push(`stroke ${colour(style.stroke)} ${digest(style.strokeWidth)}`);
      if (style.strokeOpacity !== "1") parts.push(`at ${short(Number(style.strokeOpacity))}`);
      if (style.strokeDasharray !== "none") parts.push(`dashes ${digest(style.strokeDasharray)}`);
    }
    if (style.opacity !== "1") parts.push(`opacity ${short(Number(style.opacity))}`);
    return `(${parts.join(" ")})`;
  };

  const headOf = (lines) => lines[0].trim().split(" ")[0];
  /** Sort each run of children that have the same group, whatever their numbers and boxes. */
  const sorted = (children, group) => {
    const key = (lines) => lines.join("\n").replace(/ @[-\d,]+ \d+x\d+|~\{.*?\}/g, "");
    for (let begin = 0, end = 0; begin < children.length; begin = end) {
      while (end < children.length && group(children[end]) === group(children[begin])) end += 1;
      const run = children.slice(begin, end).sort((a, b) => (key(a) < key(b) ? -1 : 1));
      children.splice(begin, run.length, ...run);
    }
  };

  /** @returns {string[]} The lines of an element and of what is inside. */
  const read = (element, depth) => {
    if (/^(script|style|link|noscript|template|title)$/.test(element.localName)) return [];
    if (absent.some((selector) => element.matches(selector))) return [];
    const head = [element.localName];
    if (element.id) head.push(`#${numbered(element.id)}`);
    for (const name of [...element.classList].sort()) head.push(`.${name}`);
    const parts = [head.join(""), ...attributes(element)];
    const laid = element.getClientRects().length > 0;
    const open = laid && element.checkVisibility({ opacityProperty: true });
    if (open && element.checkVisibility({ visibilityProperty: true })) {
      const box = element.getBoundingClientRect();
      if (element.matches(SHAPES)) parts.push(paint(element));
      const [x, y, w, h] = [box.x, box.y, box.width, box.height].map((n) => short(n, 0));
      parts.push(`@${x},${y} ${w}x${h}`);
    } else parts.push("unseen");
    const own = [...element.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
    if (own) parts.push('"');
    const inside = element.querySelectorAll("*").length;
    const counted = closed.some((selector) => element.matches(selector));
    const shut = counted || !(open || element.closest(hidden));
    if (shut && inside) parts.push(`(${inside} inside)`);
    const children = shut ? [] : [...element.children].map((child) => read(child, depth + 1));
    if (unordered.some((selector) => element.matches(selector))) sorted(children, () => "");
    if (level.some((selector) => element.matches(selector))) sorted(children, headOf);
    return [`${" ".repeat(depth)}${parts.join(" ")}`, ...children.flat()];
  };

  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const texts = [];
  while (walker.nextNode()) {
    const node = walker.currentNode;
    if (node.data.trim() && !node.parentNode.matches("script, style, noscript")) {
      texts.push([node, node.data]);
    }
  }
  // All texts are restored before the browser draws or runs a script of the page.
  for (const [node] of texts) node.data = "x";
  let lines;
  try {
    lines = read(document.body, 0);
  } finally {
    for (const [node, text] of texts) node.data = text;
  }
  const ids = new Map();
  return lines.map((line) =>
    line.replace(/~\{(.*?)\}/g, (_, id) => {
      if (!ids.has(id)) ids.set(id, `~${ids.size + 1}`);
      return ids.get(id);
    }),
  );
};
