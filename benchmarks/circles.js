// One circle for each dot, moved by attributes, as the library of 2012 drew scans. There
// is no network: this script creates the numbers before the measurement starts.
"use strict";

const SVG = "http://www.w3.org/2000/svg";

function circles(robots, beams) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("width", "1200");
  svg.setAttribute("height", "900");
  svg.style.display = "block";
  document.body.style.margin = "0";
  document.body.append(svg);
  const side = Math.ceil(Math.sqrt(robots));
  const zoom = 900 / (side * 4 + 2);
  const world = document.createElementNS(SVG, "g");
  world.setAttribute("transform", `matrix(${zoom} 0 0 ${-zoom} ${3 * zoom} ${900 - 3 * zoom})`);
  svg.append(world);

  const fleet = [];
  for (let number = 0; number < robots; number++) {
    const group = document.createElementNS(SVG, "g");
    const model = document.createElementNS(SVG, "circle");
    model.setAttribute("r", "0.3");
    model.setAttribute("fill", "steelblue");
    group.append(model);
    const dots = [];
    for (let beam = 0; beam < beams; beam++) {
      const dot = document.createElementNS(SVG, "circle");
      dot.setAttribute("r", "0.03");
      dot.setAttribute("fill", "crimson");
      group.append(dot);
      dots.push(dot);
    }
    world.append(group);
    const x = (number % side) * 4;
    const y = Math.floor(number / side) * 4;
    fleet.push({ group, dots, x, y, phase: number * 0.7 });
  }

  const steps = 40;
  const scans = [];
  for (let step = 0; step < steps / 2; step++) {
    const points = [];
    for (let beam = 0; beam < beams; beam++) {
      const range = 0.5 + 1.4 * Math.random();
      const bearing = (beam / beams) * 2 * Math.PI;
      points.push([range * Math.cos(bearing), range * Math.sin(bearing)]);
    }
    scans.push(points);
  }

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
      if (number % 2 === 0) {
        const points = scans[(number % steps) / 2];
        robot.dots.forEach((dot, beam) => {
          dot.setAttribute("cx", points[beam][0].toFixed(3));
          dot.setAttribute("cy", points[beam][1].toFixed(3));
        });
      }
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

globalThis.circles = circles;
