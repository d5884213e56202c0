/**
 * Where a map lies on the common one: metres, metres, and degrees counter-clockwise, as
 * fleet files have it.
 *
 * @typedef {{x: number, y: number, angle: number}} Alignment
 */

/** @typedef {import('../view.js').Matrix} Matrix */
/** @typedef {import('../view.js').Point} Point */

/**
 * @param {Alignment} alignment
 * @returns {Matrix} What takes points of the map to the common one.
 */
export function matrixOf({ x, y, angle }) {
  const yaw = (angle * Math.PI) / 180;
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return { a: cos, b: sin, c: -sin, d: cos, e: x, f: y };
}

/**
 * @param {Alignment} before
 * @param {Alignment} now
 * @returns {Matrix} What takes everything from where it is to where it will be.
 */
export function between(before, now) {
  const turn = matrixOf({ x: 0, y: 0, angle: now.angle - before.angle });
  const { a, b, c, d } = turn;
  return {
    ...turn,
    e: now.x - a * before.x - c * before.y,
    f: now.y - b * before.x - d * before.y,
  };
}

/**
 * @param {Alignment} alignment
 * @param {number} dx Metres along the common map's x.
 * @param {number} dy
 * @returns {Alignment}
 */
export function moved(alignment, dx, dy) {
  return { ...alignment, x: alignment.x + dx, y: alignment.y + dy };
}

/**
 * Turn about a point that stays where it is.
 *
 * @param {Alignment} alignment
 * @param {number} degrees Counter-clockwise.
 * @param {Point} about On the common map.
 * @returns {Alignment}
 */
export function turned(alignment, degrees, about) {
  const { a, b, c, d } = matrixOf({ x: 0, y: 0, angle: degrees });
  const [dx, dy] = [alignment.x - about.x, alignment.y - about.y];
  return {
    x: about.x + a * dx + c * dy,
    y: about.y + b * dx + d * dy,
    angle: normal(alignment.angle + degrees),
  };
}

/**
 * @param {number} degrees
 * @returns {number} The same direction, above -180 and up to 180.
 */
export function normal(degrees) {
  const rest = ((degrees % 360) + 360) % 360;
  return rest > 180 ? rest - 360 : rest;
}

/**
 * @param {Alignment} alignment
 * @returns {Alignment} To the millimetre and the hundredth of a degree, as it is saved.
 */
export function rounded({ x, y, angle }) {
  return {
    x: Math.round(x * 1000) / 1000 + 0,
    y: Math.round(y * 1000) / 1000 + 0,
    angle: Math.round(normal(angle) * 100) / 100 + 0,
  };
}
