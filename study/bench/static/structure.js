"use strict";
// The structure in space with its sensors, contact lines and moving shapes; a list of rows where there is no geometry.
let structure = null, phase = 0, turning = 0;
const KINDS = { sensor: ["circle", "blue"], "contact line": ["diamond", "accent"], load: ["cross", "good"] };
const STATES = ["stuck", "slipping", "separated"];
const EVERY = 60, TURN = 0.16, SLENDER = 0.4;

function beginStructure(data) {
  const before = byId("mode").value;
  structure = data;
  const groups = [["Modes", data.modes.map((mode, number) => ["mode " + (number + 1) + ", " + digits(mode.frequency, 5) + " Hz", "modes." + number])], ["In operation, at resonance", data.operations.map((operation, number) => [operation.label, "operations." + number])]];
  byId("mode").replaceChildren(make("option", { value: "", text: "at rest" }), ...groups.filter(([, listed]) => listed.length).map(([label, listed]) => make("optgroup", { label }, ...listed.map(([text, value]) => make("option", { value, text })))));
  const isThere = data.bodies.length > 0;
  byId("structure").hidden = !isThere;
  byId("rows").replaceChildren(...(isThere ? [] : [make("p", { className: "sub", text: "The case has no geometry: its sensors and contact lines." }), make("table", {}, ...data.rows.map((row) => make("tr", {}, make("td", { className: "word", text: row.name }), make("td", { text: row.kind }))))]));
  byId("mode").parentElement.parentElement.hidden = !isThere;
  const first = data.modes.length && !matchMedia("(prefers-reduced-motion: reduce)").matches ? "modes.0" : "";
  byId("mode").value = before && shapeOf(before) ? before : first;
  drawStructure();
}

function shapeOf(value) {
  const [kind, number] = value.split(".");
  return value ? structure[kind][number] : undefined;
}

const chosenShape = () => shapeOf(byId("mode").value);

// What moves, in the order of the shapes: bodies, then marks.
const moving = () => [...structure.bodies, ...structure.marks];

// Coordinates of a body or of marks at a phase of the shape [mm].
function placesOf(body, shape, angle) {
  if (!shape) return body.points.map((values) => values.map((value) => 1e3 * value));
  const [real, imaginary] = shape.shape[moving().indexOf(body)], c = Math.cos(angle), s = Math.sin(angle);
  return body.points.map((values, k) => values.map((value, n) => 1e3 * (value + c * real[k][n] - (imaginary ? s * imaginary[k][n] : 0))));
}

// A slender structure has some room around it, in which its shapes move [mm].
function rangeOf(k) {
  const ends = [0, 1, 2].map((each) => structure.bodies.reduce(([low, high], body) => body.points[each].reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [low, high]), [Infinity, -Infinity]).map((value) => 1e3 * value));
  const size = Math.max(...ends.map(([low, high]) => high - low)) || 1, [low, high] = ends[k], half = Math.max((high - low) / 2 + 0.05 * size, 0.16 * size);
  return [(low + high) / 2 - half, (low + high) / 2 + half];
}

// Marks that are so near to each other that their names would lie on each other share one name.
function nameMarks() {
  const names = [], near = 0.06 * Math.max(...[0, 1, 2].map((k) => rangeOf(k)[1] - rangeOf(k)[0])) / 1e3;
  structure.marks.forEach((mark, number) => {
    const first = structure.marks.slice(0, number).findIndex((other, at) => names[at] && Math.hypot(...[0, 1, 2].map((k) => other.points[k][0] - mark.points[k][0])) < near);
    names[number] = first < 0 ? mark.name : "";
    if (first >= 0) names[first] += ", " + mark.name;
  });
  return names;
}

function drawBody(body) {
  const [x, y, z] = placesOf(body, null, 0), common = { x, y, z, name: body.name, hovertemplate: body.name + "<extra></extra>" };
  if (body.triangles[0].length) {
    const [i, j, k] = body.triangles;
    return { type: "mesh3d", i, j, k, ...common, color: colour("pale"), flatshading: true, opacity: structure.marks.length ? 0.65 : 1, lighting: { ambient: 0.55, diffuse: 0.7, specular: 0.1 } };
  }
  return { type: "scatter3d", mode: body.is_chain ? "lines+markers" : "markers", ...common, line: { color: colour("pale"), width: 6 }, marker: { size: body.is_chain ? 2 : 3, color: colour("pale") } };
}

function drawStructure() {
  turning += 1;
  if (!structure || !structure.bodies.length) return;
  const names = nameMarks(), marks = structure.marks.map((mark, number) => {
    const [symbol, ink] = KINDS[mark.kind], [x, y, z] = placesOf(mark, null, 0);
    const name = { text: x.map((_, place) => (place ? "" : names[number])), textposition: number % 2 ? "bottom center" : "top center", textfont: { size: 11, color: colour("ink") } };
    return { type: "scatter3d", mode: "markers+text", x, y, z, ...name, marker: { size: 5, symbol, color: x.map(() => colour(ink)) }, hovertemplate: mark.kind + " " + mark.name + "<extra></extra>" };
  });
  const sizes = [0, 1, 2].map((k) => rangeOf(k)[1] - rangeOf(k)[0]);
  // The short sides of a slender structure have no room for numbers.
  const side = (text, k) => ({ title: { text: sizes[k] < SLENDER * Math.max(...sizes) ? "" : text + " [mm]", font: { size: 11 } }, range: rangeOf(k), gridcolor: colour("grid"), zerolinecolor: colour("line"), linecolor: colour("line"), showbackground: false, showticklabels: sizes[k] >= SLENDER * Math.max(...sizes), tickfont: { size: 10 }, nticks: 5 });
  // The drawing is wider than high.
  const scale = Math.min(1.5 / Math.max(sizes[0], sizes[1]), 0.95 / sizes[2]), ratio = sizes.map((size) => scale * size);
  Plotly.react("structure", [...structure.bodies.map(drawBody), ...marks], layout({
    height: 300, margin: { l: 0, r: 0, t: 0, b: 0 }, uirevision: "view",
    scene: { aspectmode: "manual", aspectratio: { x: ratio[0], y: ratio[1], z: ratio[2] }, dragmode: "turntable", xaxis: side("x", 0), yaxis: side("y", 1), zaxis: side("z", 2), camera: { eye: { x: 0.45, y: -1.35, z: 0.5 } } },
  }), CONFIG);
  tellShape();
  drawInstant();
  move();
}

// What the shape is, and what its contact lines do: their colours change with the motion.
function tellShape() {
  byId("still").disabled = !chosenShape();
  const shape = chosenShape(), lines = shape && shape.states ? Object.entries(shape.states) : [];
  const swatches = STATES.map((name, state) => { const mark = make("span", { className: "swatch" }); mark.style.background = structure.state_colours[state]; return make("span", { className: "state" }, mark, " " + name); });
  const shares = lines.map(([name, rows]) => {
    const all = rows.flat(), share = STATES.map((_, state) => all.filter((value) => value === state).length / all.length);
    return name + " " + STATES.map((word, state) => (share[state] ? Math.round(100 * share[state]) + " % " + word : "")).filter(Boolean).join(", ");
  });
  byId("shape-note").replaceChildren(...(shape ? ["Drawn " + digits(shape.enlarged) + " times as large. "] : []), ...(lines.length ? [...swatches, make("br"), "Over the period: " + shares.join("; ") + "."] : []));
}

function drawInstant() {
  const shape = chosenShape(), places = moving().map((body) => placesOf(body, shape, phase));
  Plotly.restyle("structure", { x: places.map((p) => p[0]), y: places.map((p) => p[1]), z: places.map((p) => p[2]) }, places.map((_, number) => number));
  const lines = structure.marks.flatMap((mark, number) => (mark.kind === "contact line" ? [{ name: mark.name, number: structure.bodies.length + number, count: mark.points[0].length }] : []));
  if (!lines.length) return;
  const colours = lines.map(({ name, count }) => {
    const rows = shape && shape.states ? shape.states[name] : undefined;
    if (!rows) return new Array(count).fill(colour("accent"));
    const turn = ((phase / (2 * Math.PI)) % 1 + 1) % 1;
    return rows.map((row) => structure.state_colours[row[Math.floor(turn * row.length)]]);
  });
  Plotly.restyle("structure", { "marker.color": colours }, lines.map(({ number }) => number));
}

// A picture takes at most half of the time: without a graphics card the rest is for the computations.
function move() {
  const turn = ++turning;
  if (byId("mode").value === "" || byId("still").getAttribute("aria-pressed") === "true") return;
  const next = () => {
    if (turn !== turning) return;
    const start = performance.now();
    if (!document.hidden) {
      phase += TURN;
      drawInstant();
    }
    requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(next, Math.max(EVERY, performance.now() - start))));
  };
  setTimeout(next, EVERY);
}
