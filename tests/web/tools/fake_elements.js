/** As much of an element as buttons and drawings need; its document makes these alone. */
export class FakeElement extends EventTarget {
  constructor() {
    super();
    this.attributes = new Map();
    this.children = [];
    this.classList = { toggle() {} };
    this.className = "";
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

  /** Have something happen to it. */
  fire(kind, fields = {}) {
    this.dispatchEvent(Object.assign(new Event(kind), fields));
  }
}

globalThis.document = {
  createElement: () => new FakeElement(),
  createElementNS: () => new FakeElement(),
};
