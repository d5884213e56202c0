import assert from "node:assert/strict";
import test from "node:test";

import { DragEnd } from "../../src/webmap/web/map.js";

test("the click that ends a drag is swallowed, and the one after it is not", () => {
  const drag = new DragEnd();
  assert.equal(drag.swallows(1, 0), false, "before any drag");
  drag.note(1000);
  assert.equal(drag.swallows(1, 1010), true);
  assert.equal(drag.swallows(1, 1020), false);
});

test("a click that comes late, from a key or after a new press is meant", () => {
  const drag = new DragEnd();
  drag.note(1000);
  assert.equal(drag.swallows(1, 1501), false);
  drag.note(2000);
  assert.equal(drag.swallows(0, 2010), false);
  drag.note(3000);
  drag.forget();
  assert.equal(drag.swallows(1, 3010), false);
});
