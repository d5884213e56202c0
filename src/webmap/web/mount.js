import { BodyItem, BoundItem, Item, createElement } from "./item.js";
import { PLACE } from "./opcodes.js";

/** A fragment at one position of the page. */
export class Mount {
  /**
   * @param {number} id
   * @param {number} fragment
   * @param {Mount | null} within
   * @param {number} under The element of `within` that contains the root.
   * @param {number} order Below 0 the root is behind that element's own children.
   */
  constructor(id, fragment, within, under, order) {
    this.id = id;
    this.fragment = fragment;
    this.within = within;
    this.under = under;
    this.order = order;
    /** @type {Item | null} */
    this.root = null;
    /** @type {Map<number, Item>} */
    this.items = new Map();
    /** @type {Map<number, {text: Text, host: Item}>} */
    this._texts = new Map();
    /** @type {Map<number, Mount[]>} The mounts under each element, in order. */
    this._guests = new Map();
    within?._welcome(this);
  }

  // Mounts ---------------------------------------------------------------------

  /** @param {Mount} guest */
  _welcome(guest) {
    const guests = [...this._guestsOf(guest.under), guest];
    guests.sort((one, other) => one.order - other.order || one.id - other.id);
    this._guests.set(guest.under, guests);
  }

  /**
   * @param {number} id
   * @returns {Mount[]} The mounts under that element, in order.
   */
  _guestsOf(id) {
    return this._guests.get(id) ?? [];
  }

  /** Remove this mount from its parent mount. */
  leave() {
    const others = this.within?._guestsOf(this.under).filter((guest) => guest !== this);
    if (others?.length) this.within?._guests.set(this.under, others);
    else this.within?._guests.delete(this.under);
  }

  /** Insert the root at its position, if the parent element exists already. */
  _place() {
    const host = this.within?.items.get(this.under);
    if (host && this.root) {
      host.element.insertBefore(this.root.element, this._nextNode(host));
    }
  }

  /**
   * @param {Item} host
   * @returns {ChildNode | null} The node after the root.
   */
  _nextNode(host) {
    const behind = this.order < 0;
    const guests = this.within?._guestsOf(this.under) ?? [];
    const next = guests
      .slice(guests.indexOf(this) + 1)
      .find((guest) => guest.order < 0 === behind && guest._isIn(host));
    if (next) return next.root?.element ?? null;
    return behind ? firstNode(host, guests.slice(0, guests.indexOf(this))) : host.tail;
  }

  /** @param {Item} host */
  _isIn(host) {
    return this.root?.element.parentNode === host.element;
  }

  // Elements -----------------------------------------------------------------------

  /**
   * @param {number} id
   * @param {number} parent 0 for the root.
   * @param {number} place
   * @param {string} tag
   * @param {boolean} svg
   * @returns {Item | null} null if its parent is gone.
   */
  create(id, parent, place, tag, svg) {
    const host = this.items.get(parent) ?? null;
    if (!host && parent > 0) return null;
    const item = this._add(new Item(id, createElement(tag, svg), host));
    if (host) this._insert(host, id, item, place);
    else this._place();
    return item;
  }

  /**
   * @param {number} id
   * @param {HTMLElement} body
   * @returns {Item} The document, as the root.
   */
  createDocument(id, body) {
    return this._add(new BodyItem(id, body, null));
  }

  /**
   * @param {number} id
   * @param {HTMLElement} element An element of the user's own page.
   * @returns {Item}
   */
  bind(id, element) {
    const item = new BoundItem(id, element, this.root);
    this.root?.children.set(id, item);
    return this._add(item);
  }

  /**
   * @param {Item} item
   * @returns {Item}
   */
  _add(item) {
    this.items.set(item.id, item);
    if (!item.parent) this.root = item;
    for (const guest of this._guestsOf(item.id)) guest._place();
    return item;
  }

  /**
   * @param {number} id
   * @param {number} parent
   * @param {number} place
   * @param {string} data
   */
  createText(id, parent, place, data) {
    const host = this.items.get(parent);
    if (!host) return;
    const text = document.createTextNode(data);
    this._texts.set(id, { text, host });
    this._insert(host, id, text, place);
  }

  /**
   * @param {number} id
   * @param {string} data
   */
  setText(id, data) {
    const known = this._texts.get(id);
    if (known) known.text.data = data;
  }

  /**
   * @param {Item} host
   * @param {number} id
   * @param {Item | Text} child
   * @param {number} place
   */
  _insert(host, id, child, place) {
    const before = host.children.get(place - PLACE.AFTER);
    const guests = this._guestsOf(host.id);
    let next = endNode(host, guests);
    if (place === PLACE.FIRST) next = firstNode(host, guests);
    else if (before) next = nodeOf(before).nextSibling;
    host.children.set(id, child);
    host.element.insertBefore(nodeOf(child), next);
  }

  /**
   * Remove an element or a text from the page.
   *
   * @param {number} id
   * @param {(item: Item) => void} onGone Called for each removed element.
   */
  remove(id, onGone) {
    const known = this._texts.get(id);
    const item = this.items.get(id);
    if (known) this._removeText(id, known);
    else if (item) this._removeItem(item, onGone);
  }

  /** @param {(item: Item) => void} onGone Called for each removed element. */
  removeRoot(onGone) {
    if (this.root) this._removeItem(this.root, onGone);
  }

  /**
   * @param {number} id
   * @param {{text: Text, host: Item}} known
   */
  _removeText(id, { text, host }) {
    text.remove();
    host.children.delete(id);
    this._texts.delete(id);
  }

  /**
   * @param {Item} item
   * @param {(item: Item) => void} onGone
   */
  _removeItem(item, onGone) {
    for (const id of [...item.children.keys()].reverse()) this.remove(id, onGone);
    // Mounts under this element stay for a later element with the same id.
    for (const guest of this._guestsOf(item.id)) guest.root?.element.remove();
    onGone(item);
    item.parent?.children.delete(item.id);
    this.items.delete(item.id);
    item.release();
  }
}

/**
 * @param {Item | Text} child
 * @returns {ChildNode}
 */
function nodeOf(child) {
  return child instanceof Item ? child.element : child;
}

/**
 * @param {Item} host
 * @param {Mount[]} guests The mounts under it, in order.
 * @returns {ChildNode | null} The first of the server's own children.
 */
function firstNode(host, guests) {
  let before = host.anchor;
  for (const guest of guests) {
    if (guest.order < 0 && guest._isIn(host)) before = guest.root?.element ?? before;
  }
  return before ? before.nextSibling : host.element.firstChild;
}

/**
 * @param {Item} host
 * @param {Mount[]} guests The mounts under it, in order.
 * @returns {ChildNode | null} The node after the last of the server's own children.
 */
function endNode(host, guests) {
  const next = guests.find((guest) => guest.order >= 0 && guest._isIn(host));
  return next?.root?.element ?? host.tail;
}
