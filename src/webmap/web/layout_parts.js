/** @typedef {import('./layout.js').Layout} Layout */

/**
 * The part of a layout that belongs to one module of a page.
 *
 * @template T
 * @typedef {object} Part
 * @property {() => T} read
 * @property {(value: T) => void} write Applies a value from a file, already checked.
 * @property {() => void} reset Restores the initial state.
 */

/** @typedef {Exclude<keyof Layout, 'view'>} Name */

/** The parts of a map's layout, each from the module that owns it, if present. */
export class LayoutParts {
  constructor() {
    /** @type {Map<Name, Part<any>>} */
    this._parts = new Map();
  }

  /**
   * @template {Name} K
   * @param {K} name
   * @param {Part<Required<Layout>[K]>} part
   * @returns {() => void} Removes the part.
   */
  add(name, part) {
    this._parts.set(name, part);
    return () => {
      if (this._parts.get(name) === part) this._parts.delete(name);
    };
  }

  /** @returns {Layout} The current layout. */
  read() {
    return Object.fromEntries([...this._parts].map(([name, part]) => [name, part.read()]));
  }

  /** @param {Layout} layout Only the parts that this page has are applied. */
  write(layout) {
    for (const [name, part] of this._parts) {
      if (layout[name] !== undefined) part.write(layout[name]);
    }
  }

  /** Restore the initial state. */
  reset() {
    for (const part of this._parts.values()) part.reset();
  }
}
