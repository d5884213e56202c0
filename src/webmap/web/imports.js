/** Milliseconds to wait before a module that could not be had is asked for again. */
const AGAIN = [200, 1000];

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
  for (const [tries, wait] of AGAIN.entries()) {
    try {
      return await load(asked(url, tries));
    } catch (error) {
      // A module that came and is wrong would be wrong again.
      if (!(error instanceof TypeError)) throw error;
      await new Promise((done) => setTimeout(done, wait));
    }
  }
  return load(asked(url, AGAIN.length));
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
