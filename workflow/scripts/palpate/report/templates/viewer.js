// The surface of an object in three dimensions: which indentation and frame is shown, its colours, and from where.
"use strict";
const VIEWS = JSON.parse(document.getElementById("views").textContent);
const scene = document.getElementById("scene"), slider = document.getElementById("frame");
// From farther away where the window is narrow: the colour bar takes a part of it.
const FAR = Math.max(1, 1.5 * scene.clientHeight / scene.clientWidth);
const TURN_RAD = Math.PI / 18, ZOOM = 1.15, STEEPEST_RAD = 1.5, NEAREST = 0.3, FARTHEST = 6, DIAGONAL = 1.75;
// The colours of the figures of tracked surfaces: light where nothing moves, so that shading shows.
const MOVED = [[0, "#D3DEE8"], [1 / 3, "#F2C48D"], [2 / 3, "#D55E00"], [1, "#7A1F0A"]];
const SKIN = [[0, "#A8BACC"], [1, "#A8BACC"]], BOTH_WAYS = [[0, "#005EA8"], [0.5, "#F5F5F0"], [1, "#D55E00"]];
const LIGHT = {
  lighting: { ambient: 0.75, diffuse: 0.6, specular: 0.05, roughness: 0.9 }, lightposition: { x: 0, y: -1e4, z: 2e4 },
};
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

// What the samples or, without samples, the surface is coloured by.
function colouredBy(view) {
  const chosen = document.querySelector("[name=colour]:checked");
  return view.samples && chosen ? chosen.value : "surface";
}

function valuesOf(view, frame, what) {
  const measured = view.measured[frame], computed = view.computed[frame];
  if (what !== "residual") return what === "measured" ? measured : computed;
  return measured.map((one, k) => (one === null || computed[k] === null ? null : one - computed[k]));
}

function front(view) {
  const round = view.from_rad - Math.PI / 2 + 0.39, level = 1.46 * FAR;
  const eye = { x: level * Math.cos(round), y: level * Math.sin(round), z: 0.85 * FAR };
  return { eye, center: { x: 0, y: 0, z: -0.05 }, up: { x: 0, y: 0, z: 1 } };
}

function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function axis(title, range, share) {
  const nticks = Math.max(2, Math.round(10 * share));
  return { title: { text: title }, range, nticks, showspikes: false, gridcolor: css("--line"), zeroline: false };
}

// Room for all frames, so that nothing jumps while frames go by, and so much more, as a part of the longest, that the
// box' sides lie clear of flat surfaces and marks on them are inside.
const ROOM = 0.04;
function extents(view) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  view.decoded.forEach((step, index) => {
    const k = index % 3;
    if (step < low[k]) low[k] = step;
    if (step > high[k]) high[k] = step;
  });
  const room = ROOM * Math.max(...high.map((end, k) => end - low[k]));
  return low.map((step, k) => [step - room, high[k] + room].map((end) => view.middle_mm[k] + view.step_mm * end));
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
    margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: css("--paper"), uirevision: view.title,
    font: { family: "DejaVu Sans, Verdana, sans-serif", size: 12, color: css("--ink") },
    scene: {
      xaxis: x, yaxis: y, zaxis: z, aspectmode: "manual", aspectratio: proportions(ends),
      dragmode: "turntable", camera: front(view),
    },
  };
}

function bar(text) {
  return { title: { text, side: "right" }, thickness: 16, len: 0.8 };
}

// A map of stiffness: its value or the half-width of its interval on the surface, and the points.
function mapped(view) {
  const { value, low, high, names, places } = view.map, [i, j, k] = view.corners, count = view.vertices;
  const half = document.querySelector("[name=mapped]:checked").value === "half";
  const field = half ? value.map((one, at) => (50 * (high[at] - low[at])) / one) : value;
  const text = value.map((one, at) =>
    `${at < count ? "" : `point ${names[at - count]}: `}${one.toFixed(1)} kPa (${low[at].toFixed(1)} to ${high[at].toFixed(1)})`);
  const [cmin, cmax] = half ? [0, field.slice(0, count).reduce((one, other) => Math.max(one, other))] : view.map.ends;
  const look = { hovertemplate: "%{text}<extra></extra>" }, scale = { colorscale: "Cividis", cmin, cmax };
  const [x, y, z] = [0, 1, 2].map((axis) => places.map((place) => place[axis]));
  // The points' own uncertainties are beside the map's: they are not coloured by them.
  const colour = half ? { color: "#1a1a1a" } : { color: value.slice(count), ...scale };
  return [
    { type: "mesh3d", ...frameOf(view, 0), i, j, k, ...LIGHT, ...look, ...scale, intensity: field.slice(0, count),
      text: text.slice(0, count), colorbar: bar(half ? "Half-width of the interval (%)" : "Effective E* (kPa)") },
    { type: "scatter3d", mode: "markers", x, y, z, text: text.slice(count), ...look,
      marker: { size: Math.max(4, scene.clientWidth / 130), line: { width: 2, color: "#fff" }, ...colour } },
  ];
}

function traces(view, frame) {
  if (view.map) return mapped(view);
  const [i, j, k] = view.corners, what = colouredBy(view), surface = what === "surface";
  const drawn = [{
    type: "mesh3d", ...frameOf(view, frame), i, j, k,
    colorscale: surface ? MOVED : SKIN, cmin: 0, cmax: view.largest_mm, showscale: surface,
    colorbar: bar("Displacement (mm)"), hoverinfo: surface ? "text" : "skip",
    ...LIGHT, hovertemplate: "%{intensity:.2f} mm<extra></extra>",
  }];
  if (surface) return drawn;
  const values = valuesOf(view, frame, what), there = values.flatMap((one, at) => (one === null ? [] : [at]));
  const [x, y, z] = [0, 1, 2].map((axis) => there.map((at) => view.samples[3 * at + axis]));
  const marker = {
    size: 4, color: there.map((at) => values[at]), colorscale: BOTH_WAYS, cmin: -view.most_mm, cmax: view.most_mm,
    line: { width: 0.5, color: "#555" }, colorbar: bar("Along the normal, outward (mm)"),
  };
  drawn.push({ type: "scatter3d", mode: "markers", x, y, z, marker, hovertemplate: "%{marker.color:.2f} mm<extra></extra>" });
  return drawn;
}

function draw(frame) {
  shown.at = frame;
  slider.value = frame;
  const text = shown.frames[frame], deepest = frame === shown.deepest_frame && !shown.map;
  document.getElementById("told").textContent = deepest ? `${text}, maximum depth` : text;
  return Plotly.react(scene, traces(shown, frame), look(shown), {
    responsive: true, displaylogo: false, displayModeBar: false, scrollZoom: true,
  });
}

function showCapture(number) {
  shown = VIEWS[number];
  decode(shown);
  slider.max = shown.frames.length - 1;
  for (const one of document.querySelectorAll(".viewer [data-of]")) {
    one.hidden = !{ map: shown.map, samples: shown.samples, frames: !shown.map }[one.dataset.of];
  }
  document.querySelectorAll(".of").forEach((one, at) => { one.hidden = at !== number; });
  return draw(shown.at ?? shown.deepest_frame);
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
  const start = front(shown), now = scene._fullLayout.scene.camera;
  const camera = way === "back" ? start : { ...start, eye: turned(now.eye, way) };
  return Plotly.relayout(scene, { "scene.camera": camera });
}

const KEYS = {
  ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down",
  "+": "nearer", "=": "nearer", "-": "farther", 0: "back",
};

document.querySelectorAll("[name=capture]").forEach((input, number) =>
  input.addEventListener("change", () => showCapture(number)));
document.querySelectorAll("[name=colour], [name=mapped]").forEach((input) =>
  input.addEventListener("change", () => draw(shown.at)));
slider.addEventListener("input", () => draw(Number(slider.value)));
scene.addEventListener("keydown", (event) => {
  if (!(event.key in KEYS)) return;
  event.preventDefault();
  turn(KEYS[event.key]);
});
document.querySelectorAll("[data-turn]").forEach((button) =>
  button.addEventListener("click", () => turn(button.dataset.turn)));
document.querySelectorAll("[data-frame]").forEach((button) =>
  button.addEventListener("click", () => draw(button.dataset.frame === "first" ? 0 : shown.deepest_frame)));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => draw(shown.at));
showCapture(0).then(() => document.body.setAttribute("data-drawn", "yes"));
