/** A fake element with the parts that buttons and drawings need. */
export class FakeElement extends EventTarget {
  constructor() {
    super();
    this.attributes = new Map();
    this.children = [];
    this.classList = { toggle() {} };
    this.className = "";
    this.dataset = {};
    this.disabled = this.hidden = this.isConnected = false;
    this.style = {};
    this.textContent = "";
  }

  setAttribute(name, value) {
    this.attributes.set(name, value);
  }

  append(...children) {
    this.textContent += children.filter((child) => typeof child === "string").join("");
  }

  after() {}

  before() {}

  insertBefore(child) {
    child.isConnected = true;
    child.remove = () => {
      this.children = this.children.filter((other) => other !== child);
    };
    this.children.push(child);
  }

  querySelector() {
    return null;
  }

  /** Dispatch an event of some kind. */
  fire(kind, fields = {}) {
    this.dispatchEvent(Object.assign(new Event(kind), fields));
  }
}

globalThis.document = {
  querySelector: () => null,
  createElement: () => new FakeElement(),
  createElementNS: () => new FakeElement(),
};
