import { PLACE } from "../../src/webmap/web/opcodes.js";
import { readFrame } from "../../src/webmap/web/wire.js";

/** Builds what a page shows as plain objects: a page without a browser. */
export class Tree {
  constructor() {
    this.mounts = new Map();
    this.targets = [];
    this.said = [];
  }

  /** @param {ArrayBuffer} buffer */
  apply(buffer) {
    return readFrame(buffer, ({ reset }) => {
      if (reset) this.mounts.clear();
      return this;
    });
  }

  /** What is shown, as JSON can say it. */
  picture() {
    const pictures = [...this.mounts.values()].map(({ root, within, under, order, ...rest }) => ({
      ...rest,
      within,
      under,
      order,
      root: root && plain(root),
    }));
    return pictures.map(({ nodes: _, ...rest }) => rest);
  }

  delta(fragment) {
    this.targets = [...this.mounts.values()].filter((mount) => mount.fragment === fragment);
  }

  snapshot(mount) {
    this.targets = [this.mounts.get(mount)];
  }

  mount(id, fragment, within, under, order) {
    this.mounts.set(id, {
      id,
      fragment,
      within,
      under,
      order,
      nodes: new Map(),
      root: null,
      classes: [],
      listening: {},
    });
  }

  unmount(id) {
    this.mounts.delete(id);
  }

  mountClass(id, on, name) {
    const mount = this.mounts.get(id);
    mount.classes = mount.classes.filter((other) => other !== name);
    if (on) mount.classes.push(name);
  }

  listen(id, element, kind, flags) {
    this.mounts.get(id).listening[`${element} ${kind}`] = flags;
  }

  unlisten(id, element, kind) {
    delete this.mounts.get(id).listening[`${element} ${kind}`];
  }

  create(id, parent, place, tag, svg) {
    this._put(parent, place, () => ({ id, tag, svg, children: [] }));
  }

  text(id, parent, place, data) {
    this._put(parent, place, () => ({ id, tag: "#text", data, children: [] }));
  }

  document(id) {
    this._put(0, PLACE.LAST, () => ({ id, tag: "#document", children: [] }));
  }

  bind(id, htmlId) {
    const parent = this.targets[0].root.id;
    this._put(parent, PLACE.LAST, () => ({ id, tag: "#bound", htmlId, children: [] }));
  }

  _put(parent, place, make) {
    for (const mount of this.targets) {
      const node = make();
      if (mount.nodes.has(node.id)) throw new Error(`${node.id} is there already`);
      mount.nodes.set(node.id, node);
      if (parent === 0) mount.root = node;
      else this._insert(mount.nodes.get(parent).children, place, node);
      node.parent = mount.nodes.get(parent);
    }
  }

  _insert(siblings, place, node) {
    if (place === PLACE.LAST) siblings.push(node);
    else if (place === PLACE.FIRST) siblings.unshift(node);
    else {
      const index = siblings.findIndex(({ id }) => id === place - PLACE.AFTER);
      if (index < 0) throw new Error(`no sibling ${place - PLACE.AFTER}`);
      siblings.splice(index + 1, 0, node);
    }
  }

  remove(id) {
    for (const mount of this.targets) {
      const node = mount.nodes.get(id);
      if (!node) continue;
      node.parent.children.splice(node.parent.children.indexOf(node), 1);
      forget(mount.nodes, node);
    }
  }

  _set(id, values) {
    for (const mount of this.targets) Object.assign(mount.nodes.get(id), values);
  }

  _setIn(id, group, name, value) {
    for (const mount of this.targets) {
      const node = mount.nodes.get(id);
      node[group] = { ...node[group], [name]: value };
      if (value === null || value === "") delete node[group][name];
      if (Object.keys(node[group]).length === 0) delete node[group];
    }
  }

  attribute(id, name, value) {
    if (name === "transform") this._set(id, { transform: value ?? undefined });
    else this._setIn(id, "attributes", name, value === "" ? "(empty)" : value);
    if (name === "points") this._set(id, { line: undefined });
  }

  classes(id, classes) {
    this._set(id, { class: classes || undefined });
  }

  style(id, name, value) {
    this._setIn(id, "styles", name, value);
  }

  pose(id, x, y, yaw) {
    this._set(id, { transform: [x, y, yaw] });
  }

  matrix(id, { a, b, c, d, e, f }) {
    this._set(id, { transform: [a, b, c, d, e, f] });
  }

  dots(id, unit, points) {
    this._set(id, { dots: { unit, points: Array.from(points) } });
  }

  line(id, total, points) {
    this._setIn(id, "attributes", "points", null);
    for (const { nodes } of this.targets) {
      const node = nodes.get(id);
      const line = [...(node.line ?? []), ...points];
      if (line.length < 2 * total) throw new Error(`${id} lacks points`);
      node.line = line.slice(line.length - 2 * total);
    }
  }

  age(id, measured) {
    this._set(id, { measured });
  }

  ageLimit(id, limit, shown) {
    this._set(id, { limit, shown });
  }

  data(id, data) {
    this._set(id, { data });
  }

  events(id, listening) {
    this._set(id, { events: listening.size ? Object.fromEntries(listening) : undefined });
  }

  empty(id) {
    this._set(id, { emptied: true });
  }

  map(id, world, width, height) {
    this._set(id, { map: [world, width, height] });
  }

  viewState(svg, state) {
    this.said.push({ viewState: svg, ...state });
  }

  view(svg, number, operation, args) {
    this.said.push({ view: svg, number, operation, args });
  }

  attach(svg, instance, module, css, options) {
    this.said.push({ attach: svg, instance, module, css, options });
  }

  detach(instance) {
    this.said.push({ detach: instance });
  }

  message(instance, message) {
    this.said.push({ message: instance, data: message });
  }

  error(text) {
    this.said.push({ error: text });
  }

  problem(number, text) {
    this.said.push({ problem: number, text });
  }
}

function forget(nodes, node) {
  for (const child of node.children) forget(nodes, child);
  nodes.delete(node.id);
}

function plain({ parent: _, children, ...rest }) {
  return { ...rest, children: children.map(plain) };
}

/**
 * @param {Uint8Array} bytes
 * @returns {ArrayBuffer}
 */
export function bufferOf(bytes) {
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
}
