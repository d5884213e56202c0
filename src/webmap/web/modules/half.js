/**
 * What a module's browser half may rely on.
 *
 * @typedef {import('./gestures.js').Matrix} Matrix
 *
 * @typedef {object} MapCanvas
 * @property {SVGSVGElement} svg The map's root.
 * @property {SVGGElement} world What is drawn in metres.
 * @property {HTMLElement} overlay Lies over the map, for buttons and readouts.
 * @property {Matrix} view Takes metres to pixels from the map's top left.
 * @property {number} width In pixels.
 * @property {number} height In pixels.
 * @property {import('../drive.js').Drive} drive
 * @property {string | null} selected The gate's id of the selected robot.
 * @property {(view: any, options?: {user?: boolean}) => void} setView
 * @property {(fn: () => void) => () => void} onView
 * @property {(fn: () => void) => () => void} onSelect
 * @property {(x: number, y: number) => readonly number[]} toWorld Pixels to metres.
 * @property {(x: number, y: number) => readonly number[]} toScreen Metres to pixels.
 * @property {() => void} suppressNextClick
 *
 * @typedef {(message: Record<string, unknown>) => void} Send
 *
 * @typedef {{receive?: (message: any) => void, destroy: () => void}} Half
 */

export {};
