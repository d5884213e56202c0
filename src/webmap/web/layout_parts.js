/** @typedef {import('./layout.js').Layout} Layout */

/**
 * What one module of a page adds to a layout.
 *
 * @template T
 * @typedef {object} Part
 * @property {() => T} read
 * @property {(value: T) => void} write Takes what was read from a file, and checked.
 * @property {() => void} reset Makes it as it was found.
 */

/** @typedef {Exclude<keyof Layout, 'view'>} Name */

/** The parts of a map's layout, each from the module that has it, if that is there. */
export class LayoutParts {
  constructor() {
    /** @type {Map<Name, Part<any>>} */
    this._parts = new Map();
  }

  /**
   * @template {Name} K
   * @param {K} name
   * @param {Part<Required<Layout>[K]>} part
   * @returns {() => void} Takes it away.
   */
  add(name, part) {
    this._parts.set(name, part);
    return () => {
      if (this._parts.get(name) === part) this._parts.delete(name);
    };
  }

  /** @returns {Layout} How everything is. */
  read() {
    return Object.fromEntries([...this._parts].map(([name, part]) => [name, part.read()]));
  }

  /** @param {Layout} layout What of it this page has is taken. */
  write(layout) {
    for (const [name, part] of this._parts) {
      if (layout[name] !== undefined) part.write(layout[name]);
    }
  }

  /** Make everything as it was found. */
  reset() {
    for (const part of this._parts.values()) part.reset();
  }
}
