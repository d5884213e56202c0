// Maps like those of the scene, with the modules under test and a fake of the gate.

import { Drive } from "/_webmap/web/drive.js";
import { MapCanvas } from "/_webmap/web/map.js";

const SVG = "http://www.w3.org/2000/svg";
const query = new URLSearchParams(location.search);
const modules = (query.get("modules") ?? "drive/teleop,view/mouse_view_control").split(",");

// "each": an attribute of each robot's element decides; r1 is holonomic.
const each = query.get("holonomic") === "each";
const options = { holonomic: each ? null : query.has("holonomic") };

const releaseAfter = Number(query.get("release") ?? 30_000);
const drive = new Drive(new URL("/_webmap/", location.href), { id: "page1", releaseAfter });

/** The sent messages with their times, the times of the last mark, the timer delay. */
const log = { sent: [], from: 0, to: 0, late: 0 };
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (text) {
  log.sent.push({ at: performance.now(), ...JSON.parse(text) });
  send.call(this, text);
};
let then = performance.now();
setInterval(() => {
  const now = performance.now();
  if (log.to) log.late = Math.max(log.late, now - Math.max(then, log.to) - 10);
  then = now;
}, 10);
// An event that a step detects waits for the step, so timers of its period count, too.
let stepped = performance.now();
setInterval(() => {
  const now = performance.now();
  if (log.to) log.late = Math.max(log.late, now - Math.max(stepped, log.to) - 50);
  stepped = now;
}, 50);
for (const kind of ["keydown", "keyup"]) {
  addEventListener(kind, (event) => event.repeat || mark(), { capture: true });
}

function mark(happen = () => {}) {
  Object.assign(log, { from: performance.now(), to: 0, late: 0 });
  happen();
  log.to = performance.now();
}

/** The time from the last mark to a neutral command, and the delay of timers. */
function neutralDelay() {
  const first = log.sent.find(
    ({ op, at, x, turn }) => op === "drive" && at >= log.from && x === 0 && turn === 0,
  );
  return first ? [Math.max(0, first.at - log.to), log.late] : null;
}

/** The commands that move a robot and were sent since a time. */
function moves(since) {
  return log.sent.filter(
    ({ op, at, x, y, turn }) => op === "drive" && at >= since && (x || y || turn),
  );
}

let losses = 0;
drive.on("state", (state) => {
  if (state === "lost") losses += 1;
});

/** Wait for the next step of the page. */
function step() {
  return new Promise((resolve) => {
    const off = drive.on("step", () => {
      off();
      resolve();
    });
  });
}

function robot(id, x, y) {
  const g = document.createElementNS(SVG, "g");
  const circle = document.createElementNS(SVG, "circle");
  g.classList.add("robot");
  g.setAttribute("data-robot", id);
  g.setAttribute("transform", `translate(${x} ${y})`);
  circle.setAttribute("r", "0.3");
  g.append(circle);
  return g;
}

async function makeMap(number) {
  const svg = document.createElementNS(SVG, "svg");
  const world = document.createElementNS(SVG, "g");
  svg.classList.add("webmap");
  svg.id = `map${number}`;
  const robots = document.createElementNS(SVG, "g");
  robots.classList.add("robots");
  robots.append(robot("r1", 1, 1), robot("r2", -1, 1));
  if (each) robots.firstElementChild.setAttribute("data-holonomic", "");
  world.append(robots);
  svg.append(world);
  document.querySelector(".place").append(svg);
  const size = { width: 800, height: 300 };
  const surroundings = { send() {}, find: () => null, drive: () => drive };
  const map = new MapCanvas(number, svg, world, size, surroundings);
  map.setView({ a: 40, b: 0, c: 0, d: -40, e: 400, f: 150 });
  map.sent = [];
  map.clicks = 0;
  map.select = (id) => {
    for (const g of world.querySelectorAll(".robot")) {
      g.classList.toggle("selected", g.getAttribute("data-robot") === id);
    }
    map.settle(true);
  };
  svg.addEventListener("click", (event) => {
    map.clicks += 1;
    map.select(event.target.closest(".robot")?.getAttribute("data-robot") ?? null);
  });
  map.parts = [];
  const styles = [];
  for (const name of modules) {
    const { default: attach } = await import(`/_webmap/features/${name}.js`);
    const link = document.createElement("link");
    link.rel = "stylesheet";
    // The modules of the view share one style sheet.
    const sheet = name.startsWith("view/") ? "view/view" : name;
    link.href = `/_webmap/features/${sheet}.css`;
    styles.push(new Promise((resolve) => link.addEventListener("load", resolve)));
    document.head.append(link);
    map.parts.push(attach(map, options, (message) => map.sent.push(message)));
  }
  await Promise.all(styles);
  return map;
}

const maps = [await makeMap(1)];
if (query.has("two")) maps.push(await makeMap(2));
window.bench = { drive, maps, mark, neutralDelay, moves, losses: () => losses, step };
document.body.dataset.ready = "yes";
