// Behaviour of an object's page: the tracked surface turns, and frames go by.
"use strict";
const TURN_RAD = Math.PI / 18, ZOOM = 1.15, STEEPEST_RAD = 1.5, FRONT = { high: 0.75, near: 1.3 };
const LIGHT = [-0.4, 0.5, 0.77], SKIN = [168, 186, 204], IN = [0, 94, 168], STILL = [245, 245, 240], OUT = [213, 94, 0];

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

function colour(value, most) {
  const part = Math.max(-1, Math.min(1, value / most)), end = part < 0 ? IN : OUT;
  return STILL.map((still, k) => Math.round(still + (end[k] - still) * Math.abs(part)));
}

// Right, up and towards the viewer.
function axes({ round, high }) {
  const flat = [Math.sin(round), -Math.cos(round)];
  return [
    [Math.cos(round), Math.sin(round), 0],
    [-Math.sin(high) * flat[0], -Math.sin(high) * flat[1], Math.cos(high)],
    [Math.cos(high) * flat[0], Math.cos(high) * flat[1], Math.sin(high)],
  ];
}

function projected(places, eye) {
  const found = new Float32Array(places.length), rows = axes(eye);
  for (let at = 0; at < places.length; at += 3)
    for (let k = 0; k < 3; k++)
      found[at + k] = rows[k][0] * places[at] + rows[k][1] * places[at + 1] + rows[k][2] * places[at + 2];
  return found;
}

// What faces the viewer, the farthest first: triangles of the surface and samples on it.
function items(view, eye, motions) {
  const flat = projected(view.surfaces[view.at], eye), found = [], faces = view.faces;
  const light = Math.hypot(...LIGHT);
  for (let at = 0; at < faces.length; at += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => 3 * faces[at + k]);
    const u = [0, 1, 2].map((k) => flat[b + k] - flat[a + k]), v = [0, 1, 2].map((k) => flat[c + k] - flat[a + k]);
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    if (n[2] <= 0) continue;
    const shade = 0.45 + 0.55 * Math.max(0, n.reduce((sum, x, k) => sum + x * LIGHT[k], 0) / (light * Math.hypot(...n)));
    const fill = `rgb(${SKIN.map((x) => Math.round(x * shade)).join(",")})`;
    found.push({ far: (flat[a + 2] + flat[b + 2] + flat[c + 2]) / 3, corners: [a, b, c].map((p) => [flat[p], flat[p + 1]]), fill });
  }
  const samples = projected(view.samples, eye);
  motions.forEach((moved, k) => {
    if (moved === null) return;
    const fill = `rgb(${colour(moved, view.most_mm).join(",")})`;
    found.push({ far: samples[3 * k + 2] + view.size_mm / 50, dot: [samples[3 * k], samples[3 * k + 1]], fill });
  });
  return found.sort((one, other) => one.far - other.far);
}

function draw(canvas, view, motions) {
  const wide = canvas.clientWidth, tall = canvas.clientHeight, fine = window.devicePixelRatio || 1;
  canvas.width = wide * fine;
  canvas.height = tall * fine;
  const pen = canvas.getContext("2d"), scale = (0.85 * view.eye.near * Math.min(wide, tall)) / view.size_mm;
  const place = ([x, y]) => [wide / 2 + scale * x, tall / 2 - scale * y];
  pen.scale(fine, fine);
  for (const item of items(view, view.eye, motions)) {
    pen.fillStyle = pen.strokeStyle = item.fill;
    pen.beginPath();
    if (item.dot) {
      pen.arc(...place(item.dot), 3.2, 0, 2 * Math.PI);
      pen.strokeStyle = "rgba(0,0,0,.45)";
    } else {
      item.corners.forEach((corner, k) => (k ? pen.lineTo(...place(corner)) : pen.moveTo(...place(corner))));
      pen.closePath();
    }
    pen.fill();
    pen.lineWidth = 0.6;
    pen.stroke();
  }
}

function show(view) {
  draw(view.canvases[0], view, view.seen[view.at]);
  draw(view.canvases[1], view, view.computed[view.at]);
  view.told.textContent = view.frames[view.at];
  view.slider.value = view.at;
}

function turn(view, way) {
  const eye = view.eye;
  if (way === "back") Object.assign(eye, FRONT, { round: view.from_rad });
  if (way === "left") eye.round -= TURN_RAD;
  if (way === "right") eye.round += TURN_RAD;
  if (way === "up") eye.high += TURN_RAD;
  if (way === "down") eye.high -= TURN_RAD;
  if (way === "nearer") eye.near *= ZOOM;
  if (way === "farther") eye.near /= ZOOM;
  eye.high = Math.max(-STEEPEST_RAD, Math.min(STEEPEST_RAD, eye.high));
  show(view);
}

const KEYS = {
  ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down",
  "+": "nearer", "=": "nearer", "-": "farther", 0: "back",
};

function begin(box) {
  const view = JSON.parse(box.querySelector("script").textContent);
  const steps = new Int16Array(bytes(view.steps)), size = 3 * view.vertices;
  view.surfaces = view.frames.map((_, k) => Float32Array.from(steps.subarray(k * size, (k + 1) * size), (x) => x * view.step_mm));
  Object.assign(view, { faces: new Uint32Array(bytes(view.faces)), at: view.deepest, eye: { ...FRONT, round: view.from_rad } });
  view.canvases = [...box.querySelectorAll("canvas")];
  view.slider = box.querySelector("input");
  view.told = box.querySelector("output");
  view.slider.addEventListener("input", () => { view.at = Number(view.slider.value); show(view); });
  box.querySelectorAll("[data-turn]").forEach((button) =>
    button.addEventListener("click", () => turn(view, button.dataset.turn)));
  view.canvases.forEach((canvas) => {
    canvas.addEventListener("keydown", (event) => {
      if (!(event.key in KEYS)) return;
      event.preventDefault();
      turn(view, KEYS[event.key]);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!event.buttons) return;
      view.eye.round -= event.movementX / 120;
      view.eye.high = Math.max(-STEEPEST_RAD, Math.min(STEEPEST_RAD, view.eye.high + event.movementY / 120));
      show(view);
    });
  });
  new ResizeObserver(() => show(view)).observe(view.canvases[0]);
  show(view);
  box.view = view;
}

document.querySelectorAll(".turning").forEach(begin);
document.body.dataset.drawn = "yes";
