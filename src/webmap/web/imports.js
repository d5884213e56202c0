/** Milliseconds to wait before a module that could not be had is asked for again. */
const AGAIN = [200, 1000];

/**
 * By what address each module was had, as by another it would be another module.
 * @type {Map<string, string>}
 */
const had = new Map();

/**
 * Import a module, and ask for it again if it cannot be had: over a bad link a page would
 * otherwise be without its STOP button until it is loaded anew.
 *
 * @param {string} url
 * @param {(url: string) => Promise<any>} [load]
 * @returns {Promise<any>}
 * @throws {TypeError} If it cannot be had; whatever else it raises itself.
 */
export async function importOf(url, load = (address) => import(address)) {
  const known = had.get(url);
  if (known !== undefined) return load(known);
  for (let tries = 0; ; tries++) {
    const address = asked(url, tries);
    try {
      const module = await load(address);
      had.set(url, address);
      return module;
    } catch (error) {
      // A module that came and is wrong would be wrong again; of a TypeError it cannot
      // be told whose it is.
      if (!(error instanceof TypeError) || tries >= AGAIN.length) throw error;
      await new Promise((done) => setTimeout(done, AGAIN[tries]));
    }
  }
}

/**
 * @param {string} url
 * @param {number} tries How often it could not be had; a browser keeps that by address.
 */
function asked(url, tries) {
  if (tries === 0) return url;
  const address = new URL(url);
  address.searchParams.set("again", `${tries}`);
  return address.href;
}
