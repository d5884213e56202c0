import assert from "node:assert/strict";
import test from "node:test";

import { DragEnd } from "../../src/webmap/web/map.js";

test("only the first click after a drag is discarded", () => {
  const drag = new DragEnd();
  assert.equal(drag.swallows(1, 0), false, "before any drag");
  drag.note(1000);
  assert.equal(drag.swallows(1, 1010), true);
  assert.equal(drag.swallows(1, 1020), false);
});

test("a late click, a click by a key and a click after a new press are kept", () => {
  const drag = new DragEnd();
  drag.note(1000);
  assert.equal(drag.swallows(1, 1501), false);
  drag.note(2000);
  assert.equal(drag.swallows(0, 2010), false);
  drag.note(3000);
  drag.forget();
  assert.equal(drag.swallows(1, 3010), false);
});
