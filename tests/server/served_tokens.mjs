// Reads pairs of texts, and prints the first pair whose tokens differ, or "same".
import { readFileSync } from "node:fs";
import * as espree from "espree";

const OPTIONS = { ecmaVersion: "latest", sourceType: "module", loc: true };

/** @param {string} text */
const tokens = (text) =>
  espree.tokenize(text, OPTIONS).map(({ value, loc }) => `${loc.start.line} ${value}`);

const { pairs, modules } = JSON.parse(readFileSync(0, "utf-8"));
const different = Object.keys(pairs).filter((name) => {
  const [one, other] = pairs[name].map(tokens);
  return one.join("\n") !== other.join("\n");
});
/** @type {Record<string, string[]>} */
const exported = {};
for (const [name, text] of Object.entries(modules)) {
  const { body } = espree.parse(text, OPTIONS);
  exported[name] = body.flatMap((node) => {
    if (node.type === "ExportDefaultDeclaration") return ["default"];
    if (node.type !== "ExportNamedDeclaration") return [];
    const names = node.specifiers.map((one) => one.exported.name);
    for (const one of node.declaration?.declarations ?? []) {
      const { id } = one;
      if (id.type === "ObjectPattern") names.push(...id.properties.map((p) => p.value.name));
      else names.push(id.name);
    }
    if (node.declaration?.id) names.push(node.declaration.id.name);
    return names;
  });
}
console.log(JSON.stringify({ different, exported }));
