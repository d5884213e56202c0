/** Prints the page that hands over a shift. */

document.getElementById("print")?.addEventListener("click", () => print());
