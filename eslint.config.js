import js from "@eslint/js";
import globals from "globals";

// What a robot or a person sends is only ever text on a page, so every way of turning
// a string into markup or into code is refused here, whoever the object belongs to.
const markup = [
  "innerHTML",
  "outerHTML",
  "insertAdjacentHTML",
  "srcdoc",
  "setHTMLUnsafe",
  "parseHTMLUnsafe",
  "createContextualFragment",
  "parseFromString",
].map((property) => ({
  property,
  message: "Make elements with createElementNS and text with textContent.",
}));

const noCodeFromText = {
  "no-eval": "error",
  "no-implied-eval": "error",
  "no-new-func": "error",
  "no-script-url": "error",
  "no-restricted-globals": [
    "error",
    { name: "DOMParser", message: "Markup from outside is shown as an image." },
  ],
  "no-restricted-properties": [
    "error",
    ...markup,
    { object: "document", property: "write", message: "Make elements." },
    { object: "document", property: "writeln", message: "Make elements." },
  ],
  "no-restricted-syntax": [
    "error",
    {
      selector: "CallExpression[callee.property.name='setAttribute'] > Literal[value=/^on/i]",
      message: "Listen with addEventListener.",
    },
    {
      selector: "Property[key.name=/^(innerHTML|outerHTML|srcdoc)$/]",
      message: "Make elements with createElementNS and text with textContent.",
    },
  ],
};

const care = {
  eqeqeq: ["error", "always", { null: "ignore" }],
  "no-shadow": "error",
  "no-unused-vars": ["error", { argsIgnorePattern: "^_" }],
  "no-var": "error",
  "prefer-const": "error",
};

export default [
  { ignores: ["**/_build/", ".venv/", ".venv-peers/", "node_modules/", "dist/", "build/", "test-results/"] },
  js.configs.recommended,
  { rules: { ...care, ...noCodeFromText } },
  {
    files: ["src/**/*.js", "examples/**/*.js", "benchmarks/**/*.js", "docs/**/*.js"],
    languageOptions: { ecmaVersion: 2022, globals: globals.browser },
  },
  {
    files: ["tests/**/*.js", "tests/**/*.mjs", "*.config.js"],
    // Some run in Node, some in a browser, and some stand in for its document.
    languageOptions: {
      ecmaVersion: 2022,
      globals: { ...globals.browser, ...globals.nodeBuiltin, document: "writable" },
    },
  },
];
