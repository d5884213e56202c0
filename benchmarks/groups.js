// One group for each robot, moved only by its transform attribute. There is no network:
// this script creates the numbers.
"use strict";

const SVG_GROUPS = "http://www.w3.org/2000/svg";

function groups(robots) {
  const svg = document.createElementNS(SVG_GROUPS, "svg");
  svg.setAttribute("width", "1200");
  svg.setAttribute("height", "900");
  svg.style.display = "block";
  document.body.style.margin = "0";
  document.body.append(svg);
  const side = Math.ceil(Math.sqrt(robots));
  const zoom = 900 / (side * 4 + 2);
  const world = document.createElementNS(SVG_GROUPS, "g");
  world.setAttribute("transform", `matrix(${zoom} 0 0 ${-zoom} ${3 * zoom} ${900 - 3 * zoom})`);
  svg.append(world);

  const fleet = [];
  for (let number = 0; number < robots; number++) {
    const group = document.createElementNS(SVG_GROUPS, "g");
    const model = document.createElementNS(SVG_GROUPS, "circle");
    model.setAttribute("r", "0.3");
    model.setAttribute("fill", "steelblue");
    group.append(model);
    world.append(group);
    fleet.push({ group, x: (number % side) * 4, y: Math.floor(number / side) * 4, phase: number * 0.7 });
  }

  const steps = 40;
  let number = 0;
  let waiting = false;
  globalThis.framesDrawn = 0;
  const draw = () => {
    waiting = false;
    number++;
    for (const robot of fleet) {
      const turn = robot.phase + ((number % steps) * 2 * Math.PI) / steps;
      const x = robot.x + Math.cos(turn);
      const y = robot.y + Math.sin(turn);
      const degrees = (turn * 180) / Math.PI + 90;
      robot.group.setAttribute("transform", `translate(${x} ${y}) rotate(${degrees})`);
    }
    globalThis.framesDrawn++;
  };
  setInterval(() => {
    if (!waiting) {
      waiting = true;
      requestAnimationFrame(draw);
    }
  }, 50);
}

globalThis.groups = groups;
