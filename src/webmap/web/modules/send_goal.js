/** How often a goal is offered to the gate, and how long it waits in between, in ms. */
export const TRIES = 13;
export const RETRY = 250;

/**
 * Send a goal, and again for about three seconds while the gate has no link for it.
 *
 * The goal of an action uses up the link of all robots behind that bridge, and the gate
 * has a new one a moment later. What it refused for that it has not written, so this is
 * the one refusal after which a goal is offered again by itself.
 *
 * @param {() => Promise<void>} offer Offers it to the gate once.
 * @param {() => boolean} wanted Whether it is to be sent still; asked after every wait.
 * @returns {Promise<boolean>} Whether the gate has accepted it; false when it was called
 *     off in between, after which nothing is sent.
 * @throws {Error} When the gate refuses it for another reason, or for this one at last.
 */
export async function sendGoal(offer, wanted) {
  for (let tries = 1; ; tries++) {
    try {
      await offer();
      return true;
    } catch (error) {
      const linkless = error instanceof Error && error.message.startsWith("no link to");
      if (!linkless || tries === TRIES) throw error;
    }
    await new Promise((resolve) => setTimeout(resolve, RETRY));
    if (!wanted()) return false;
  }
}
