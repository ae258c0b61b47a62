"use strict";
// The structure in space with its sensors, contact lines and moving mode shapes; a list of rows where there is no geometry.
let structure = null, phase = 0, timer = null;
const KINDS = { sensor: ["circle", "blue"], "contact line": ["diamond", "accent"], load: ["cross", "good"] };
const EVERY = 60, TURN = 0.16;

function beginStructure(data) {
  structure = data;
  byId("mode").replaceChildren(make("option", { value: "", text: "at rest" }), ...data.modes.map((mode, number) => make("option", { value: number, text: "mode " + (number + 1) + ", " + digits(mode.frequency, 5) + " Hz" })));
  byId("structure").hidden = !data.nodes.length;
  byId("rows").replaceChildren(...(data.nodes.length ? [] : [make("p", { className: "sub", text: "The case has no geometry: its sensors and contact lines." }), make("table", {}, ...data.rows.map((row) => make("tr", {}, make("td", { className: "word", text: row.name }), make("td", { text: row.kind }))))]));
  byId("mode").parentElement.parentElement.hidden = !data.nodes.length;
  if (data.modes.length && !matchMedia("(prefers-reduced-motion: reduce)").matches) byId("mode").value = 0;
  drawStructure();
}

const bodies = () => structure.bodies.map((body) => body.name);

const isChain = (name) => structure.bodies.find((body) => body.name === name).is_chain;

function placesOf(body, factor) {
  const mode = structure.modes[byId("mode").value], nodes = structure.nodes.filter((node) => node.body === body);
  const at = (node, k) => node.point[k] + (mode ? factor * mode.shape[node.order][k] : 0);
  return [0, 1, 2].map((k) => nodes.map((node) => 1e3 * at(node, k)));
}

// A slender structure has some room around it, in which its shapes move [mm].
function rangeOf(k) {
  const values = structure.nodes.map((node) => 1e3 * node.point[k]), all = [0, 1, 2].map((each) => structure.nodes.map((node) => 1e3 * node.point[each]));
  const size = Math.max(...all.map((each) => Math.max(...each) - Math.min(...each))), low = Math.min(...values), high = Math.max(...values), half = Math.max((high - low) / 2 + 0.05 * size, 0.16 * size);
  return [(low + high) / 2 - half, (low + high) / 2 + half];
}

// Marks that are so near to each other that their names would lie on each other share one name.
function nameMarks() {
  const names = [], near = 0.06 * Math.max(...[0, 1, 2].map((k) => rangeOf(k)[1] - rangeOf(k)[0])) / 1e3;
  structure.marks.forEach((mark, number) => {
    const first = structure.marks.slice(0, number).findIndex((other, at) => names[at] && Math.hypot(...[0, 1, 2].map((k) => other.points[0][k] - mark.points[0][k])) < near);
    names[number] = first < 0 ? mark.name : "";
    if (first >= 0) names[first] += ", " + mark.name;
  });
  return names;
}

function drawStructure() {
  clearInterval(timer);
  if (!structure || !structure.nodes.length) return;
  const lines = bodies().map((body) => { const [x, y, z] = placesOf(body, 0); return { type: "scatter3d", mode: isChain(body) ? "lines+markers" : "markers", x, y, z, name: body, line: { color: colour("pale"), width: 6 }, marker: { size: isChain(body) ? 2 : 3, color: colour("pale") }, hovertemplate: body + "<extra></extra>" }; });
  const names = nameMarks(), marks = structure.marks.map((mark, number) => {
    const [symbol, ink] = KINDS[mark.kind], [x, y, z] = [0, 1, 2].map((k) => mark.points.map((point) => 1e3 * point[k]));
    const name = { text: mark.points.map((_, place) => (place ? "" : names[number])), textposition: number % 2 ? "bottom center" : "top center", textfont: { size: 11, color: colour("ink") } };
    return { type: "scatter3d", mode: "markers+text", x, y, z, ...name, marker: { size: 5, symbol, color: colour(ink) }, hovertemplate: mark.kind + " " + mark.name + "<extra></extra>" };
  });
  const side = (text, k) => ({ title: { text: text + " [mm]", font: { size: 11 } }, range: rangeOf(k), gridcolor: colour("grid"), showbackground: false, tickfont: { size: 10 }, nticks: k ? 3 : 5 });
  const sizes = [0, 1, 2].map((k) => rangeOf(k)[1] - rangeOf(k)[0]), ratio = sizes.map((size) => (1.7 * size) / Math.max(...sizes));
  Plotly.react("structure", [...lines, ...marks], layout({
    height: 270, margin: { l: 0, r: 0, t: 0, b: 0 }, uirevision: "view",
    scene: { aspectmode: "manual", aspectratio: { x: ratio[0], y: ratio[1], z: ratio[2] }, dragmode: "turntable", xaxis: side("x", 0), yaxis: side("y", 1), zaxis: side("z", 2), camera: { eye: { x: 0.5, y: -1.5, z: 0.6 } } },
  }), CONFIG);
  move();
}

function move() {
  clearInterval(timer);
  if (byId("mode").value === "" || byId("still").getAttribute("aria-pressed") === "true") return;
  timer = setInterval(() => {
    if (document.hidden) return;
    phase += TURN;
    const places = bodies().map((body) => placesOf(body, Math.sin(phase)));
    Plotly.restyle("structure", { x: places.map((p) => p[0]), y: places.map((p) => p[1]), z: places.map((p) => p[2]) }, places.map((_, number) => number));
  }, EVERY);
}
