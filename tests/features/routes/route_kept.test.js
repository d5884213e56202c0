import assert from "node:assert/strict";
import { test } from "node:test";

import {
  KEPT_FOR,
  storeRoute,
  takeStoredRoute,
} from "../../../src/webmap/features/routes/route_run.js";

const ROUTE = { points: [{ x: 1, y: 2, yaw: 0 }], loop: true, open: true, runs: new Map() };

test("a route is kept once for the next tool on the same map", () => {
  storeRoute(7, ROUTE, 1000);
  assert.equal(takeStoredRoute(8, 1100), null);
  assert.equal(takeStoredRoute(7, 1100), ROUTE);
  assert.equal(takeStoredRoute(7, 1100), null);
});

test("a kept route expires", () => {
  storeRoute(7, ROUTE, 1000);
  assert.equal(takeStoredRoute(7, 1000 + KEPT_FOR), null);
});
