/**
 * Marks the pictures of a map that are far away: several of their pixels share one of
 * the screen's. The style sheet draws those smoothly and all others crisp, since without
 * smoothing a wall that is one pixel thick is left out when it is seen from far away.
 *
 * A picture says in `data-cell` how wide its pixels are, in metres.
 */
export class FarPictures {
  /** @param {SVGGElement} world */
  constructor(world) {
    this._world = world;
    /** Pixels of the screen in a metre. */
    this._scale = 0;
    const mark = () => this._mark();
    this._said = new MutationObserver(mark);
    this._said.observe(world, { subtree: true, attributeFilter: ["data-cell"] });
    this._added = new MutationObserver(mark);
    this._added.observe(world, { childList: true });
  }

  /** @param {import('./view.js').Matrix} view */
  show({ a, b }) {
    const scale = Math.hypot(a, b) * devicePixelRatio;
    if (scale === this._scale) return;
    this._scale = scale;
    this._mark();
  }

  _mark() {
    for (const image of this._world.querySelectorAll("image[data-cell]")) {
      const cell = Number(image.getAttribute("data-cell"));
      image.toggleAttribute("data-far", cell * this._scale < 1);
    }
  }

  end() {
    this._said.disconnect();
    this._added.disconnect();
  }
}
