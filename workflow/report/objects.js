// Behaviour of objects.html: how estimates are sorted, which capture and frame is shown, and from where.
"use strict";
const DATA = JSON.parse(document.getElementById("data").textContent);
const scene = document.getElementById("scene");
const slider = document.getElementById("frame");
// From farther away where the window is narrow: the colour bar takes a part of it.
const FAR = Math.max(1, 1.5 * scene.clientHeight / scene.clientWidth);
const FRONT = {
  eye: { x: 0.55 * FAR, y: -1.35 * FAR, z: 0.85 * FAR }, center: { x: 0, y: 0, z: -0.05 }, up: { x: 0, y: 0, z: 1 },
};
const TURN_RAD = Math.PI / 18, ZOOM = 1.15, STEEPEST_RAD = 1.5, NEAREST = 0.3, FARTHEST = 6, DIAGONAL = 1.75;
// The colours of the figures of tracked surfaces: light where nothing moves, so that shading shows.
const MOVED = [[0, "#D3DEE8"], [1 / 3, "#F2C48D"], [2 / 3, "#D55E00"], [1, "#7A1F0A"]];
let shown = null;

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

// Coordinates of one frame in mm, and how far each vertex has moved since the first frame.
function frameOf(view, frame) {
  const count = view.vertices, axes = [0, 1, 2].map(() => new Float32Array(count));
  const moved = new Float32Array(count), start = 3 * count * frame;
  for (let vertex = 0; vertex < count; vertex++) {
    let square = 0;
    for (let axis = 0; axis < 3; axis++) {
      const now = view.decoded[start + 3 * vertex + axis];
      axes[axis][vertex] = view.middle_mm[axis] + view.step_mm * now;
      square += (now - view.decoded[3 * vertex + axis]) ** 2;
    }
    moved[vertex] = view.step_mm * Math.sqrt(square);
  }
  return { x: axes[0], y: axes[1], z: axes[2], intensity: moved };
}

function decode(view) {
  if (view.decoded) return;
  view.decoded = new Int16Array(bytes(view.steps));
  const corners = new Uint32Array(bytes(view.faces));
  view.corners = [0, 1, 2].map((k) => corners.filter((_, index) => index % 3 === k));
}

function axis(title, range, share) {
  const nticks = Math.max(2, Math.round(10 * share));
  return { title: { text: title }, range, nticks, showspikes: false, gridcolor: "#ddd", zeroline: false };
}

// Room for all frames, so that nothing jumps while frames go by.
function extents(view) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  view.decoded.forEach((step, index) => {
    const k = index % 3;
    if (step < low[k]) low[k] = step;
    if (step > high[k]) high[k] = step;
  });
  return low.map((step, k) => [step, high[k]].map((end) => view.middle_mm[k] + view.step_mm * end));
}

// True to scale, and each object as large as the window shows.
function proportions(ends) {
  const spans = ends.map(([low, high]) => high - low), longest = Math.hypot(...spans);
  const [x, y, z] = spans.map((span) => (DIAGONAL * span) / longest);
  return { x, y, z };
}

function look(view) {
  const ends = extents(view), names = ["x (mm)", "y (mm)", "z (mm)"];
  const shares = Object.values(proportions(ends)).map((length) => length / DIAGONAL);
  const [x, y, z] = names.map((name, k) => axis(name, ends[k], shares[k]));
  return {
    margin: { l: 0, r: 0, t: 0, b: 0 },
    font: { family: "DejaVu Sans, Verdana, sans-serif", size: 12, color: "#1a1a1a" },
    scene: {
      xaxis: x, yaxis: y, zaxis: z, aspectmode: "manual", aspectratio: proportions(ends),
      dragmode: "turntable", camera: FRONT,
    },
  };
}

function mesh(view, frame) {
  const [i, j, k] = view.corners;
  return {
    type: "mesh3d", ...frameOf(view, frame), i, j, k,
    colorscale: MOVED, cmin: 0, cmax: view.largest_mm,
    colorbar: { title: { text: "Displacement (mm)", side: "right" }, thickness: 16, len: 0.8 },
    lighting: { ambient: 0.75, diffuse: 0.6, specular: 0.05, roughness: 0.9 },
    lightposition: { x: 0, y: -1e4, z: 2e4 },
    hovertemplate: "%{intensity:.2f} mm<extra></extra>",
  };
}

function tell(view, frame) {
  slider.value = frame;
  const text = `${frame + 1} of ${view.frames.length}: ${view.frames[frame]}`;
  document.getElementById("told").textContent =
    frame === view.deepest_frame ? `${text}, deepest` : text;
}

function showFrame(frame) {
  const { x, y, z, intensity } = frameOf(shown, frame);
  tell(shown, frame);
  return Plotly.restyle(scene, { x: [x], y: [y], z: [z], intensity: [intensity] });
}

function cell(kind, text) {
  const made = document.createElement(kind);
  made.textContent = text;
  if (kind === "th") made.scope = "row";
  return made;
}

function showModuli(view) {
  document.getElementById("of").textContent = `${view.title} (${view.provenance})`;
  const rows = view.moduli.map((row) => {
    const line = document.createElement("tr");
    line.append(cell("th", row.method), cell("td", row.E), cell("td", row.nu));
    line.append(cell("td", row.reduced), cell("td", row.verdict));
    return line;
  });
  document.getElementById("moduli").replaceChildren(...rows);
}

function showCapture(view) {
  shown = view;
  decode(view);
  slider.max = view.frames.length - 1;
  tell(view, view.deepest_frame);
  showModuli(view);
  return Plotly.react(scene, [mesh(view, view.deepest_frame)], look(view), {
    responsive: true, displaylogo: false, displayModeBar: false, scrollZoom: true,
  });
}

// The eye goes round the object about the vertical.
function turned(eye, way) {
  let far = Math.hypot(eye.x, eye.y, eye.z);
  let round = Math.atan2(eye.y, eye.x), high = Math.asin(eye.z / far);
  if (way === "left") round -= TURN_RAD;
  if (way === "right") round += TURN_RAD;
  if (way === "up") high += TURN_RAD;
  if (way === "down") high -= TURN_RAD;
  if (way === "nearer") far = Math.max(far / ZOOM, NEAREST);
  if (way === "farther") far = Math.min(far * ZOOM, FARTHEST);
  high = Math.max(-STEEPEST_RAD, Math.min(STEEPEST_RAD, high));
  const level = far * Math.cos(high);
  return { x: level * Math.cos(round), y: level * Math.sin(round), z: far * Math.sin(high) };
}

function turn(way) {
  const now = scene._fullLayout.scene.camera;
  const camera = way === "back" ? FRONT : { ...FRONT, eye: turned(now.eye, way) };
  return Plotly.relayout(scene, { "scene.camera": camera });
}

const KEYS = {
  ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down",
  "+": "nearer", "=": "nearer", "-": "farther", 0: "back",
};

// Numbers by size, words by the alphabet; what has no value stays at the end.
function compared(one, other, way) {
  if (one === undefined || other === undefined) return (one === undefined) - (other === undefined);
  return way * (Number(one) - Number(other) || one.localeCompare(other, undefined, { numeric: true }));
}

// Up first, then down; what is equal keeps its order.
function sortBy(head) {
  const way = head.ariaSort === "ascending" ? -1 : 1, body = head.closest("table").tBodies[0];
  for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
  const value = (line) => line.cells[head.cellIndex].dataset.value;
  body.append(...[...body.rows].sort((one, other) => compared(value(one), value(other), way)));
}

document.querySelectorAll("#estimates th button").forEach((button) =>
  button.addEventListener("click", () => sortBy(button.closest("th"))));
DATA.views.forEach((view, number) => {
  const label = document.createElement("label"), input = document.createElement("input");
  Object.assign(input, { type: "radio", name: "capture", value: number, checked: number === 0 });
  input.addEventListener("change", () => showCapture(view));
  label.append(input, ` ${view.title}`);
  document.getElementById("captures").append(label);
});
slider.addEventListener("input", () => showFrame(Number(slider.value)));
scene.addEventListener("keydown", (event) => {
  if (!(event.key in KEYS)) return;
  event.preventDefault();
  turn(KEYS[event.key]);
});
document.querySelectorAll("[data-turn]").forEach((button) =>
  button.addEventListener("click", () => turn(button.dataset.turn)));
document.querySelectorAll("[data-frame]").forEach((button) =>
  button.addEventListener("click", () =>
    showFrame(button.dataset.frame === "first" ? 0 : shown.deepest_frame)));

const simulated = DATA.views.filter((view) => view.provenance === "simulated").length;
const told = document.getElementById("provenance");
told.textContent = simulated
  ? `Simulated captures: ${simulated} of ${DATA.views.length} come from the virtual lab, not from recordings.`
  : "Recorded captures.";
told.classList.toggle("simulated", simulated > 0);
document.getElementById("source").textContent =
  `Surfaces of the tracker "${DATA.tracker}", true to scale, in the object's frame, z up from the support. ` +
  "Depths are as recorded: an object's own page has them as its estimate corrects them. The colour bar " +
  "ends at the greatest displacement of the deepest frame.";
showCapture(DATA.views[0]).then(() => document.body.setAttribute("data-drawn", "yes"));
