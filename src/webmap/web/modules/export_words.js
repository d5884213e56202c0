import { svg } from "./elements.js";
import { keepLength, standingAlone } from "./export_fonts.js";

/**
 * Draw a panel of HTML with what is in it: its ground, its texts and its drawings.
 *
 * @param {HTMLElement} panel
 * @param {DOMRect} frame What is seen, in pixels of the window.
 * @param {(drawing: SVGSVGElement) => SVGElement | null} copy
 * @returns {SVGElement | null} null if nothing of it is seen.
 */
export function drawPanel(panel, frame, copy) {
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
 * @returns {SVGTextElement[]} One for each line in which it was laid out.
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
      // Where most fonts have their base line, in the box of a line.
      y: `${Number(y) + box.height / 2 + 0.35 * size}`,
      fill: style.color,
      "font-family": standingAlone(style.fontFamily),
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
