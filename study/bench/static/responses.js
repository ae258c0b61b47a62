"use strict";
// Measured families over predictions, residuals below, and the curve that moves with the sliders.
const MARKS = { 1: "triangle-up", 0: "circle", "-1": "triangle-down" };
const shown = { panel: 0, levels: [], frequency: null, level: null };
let responses = null, movedTraces = [], limits = null;

const familyColours = () => (isDark() ? responses.dark_colours : responses.colours);

function beginResponses(data) {
  const before = responses && responses.panels[shown.panel];
  responses = data;
  const same = before ? data.panels.findIndex((panel) => panel.label === before.label && panel.configuration === before.configuration) : -1;
  shown.panel = same >= 0 ? same : data.first;
  if (shown.levels.length !== data.levels.length) shown.levels = data.levels.map(() => true);
  fillPanels();
  fillLevels();
  drawResponse();
}

// What was asked for is shown: on the first response that has limits, if the one that is shown has none.
function beginLimits(data) {
  const note = byId("limit-note"), hasBand = (panel) => panel && panel.some((band) => band);
  limits = data;
  note.hidden = !data;
  if (data) {
    note.firstElementChild.textContent = "Shaded: limits of all friction histories. " + data.headline;
    note.lastElementChild.textContent = typeset(data.sentences.map((text) => text[0].toUpperCase() + text.slice(1).replace(/\.$/, "") + ".").join(" "));
    const first = data.panels.findIndex(hasBand);
    if (first >= 0 && !hasBand(data.panels[shown.panel])) byId("panel").value = shown.panel = first;
  }
  drawResponse();
}

// The band of a curve; none where no limits are known.
function limitTraces(number, ink) {
  const band = limits && limits.panels[shown.panel] && limits.panels[shown.panel][number];
  if (!band) return [];
  const line = { color: ink, width: 0.8, dash: "dot" }, shared = { mode: "lines", x: band.frequency, line, hoverinfo: "skip" };
  return [{ ...shared, y: band.lower }, { ...shared, y: band.upper, fill: "tonexty", fillcolor: ink + "2e" }];
}

function fillPanels() {
  const select = byId("panel");
  select.replaceChildren();
  for (const name of [...new Set(responses.panels.map((panel) => panel.configuration))]) {
    const group = make("optgroup", { label: name + " structure" });
    responses.panels.forEach((panel, number) => {
      if (panel.configuration === name) group.append(make("option", { value: number, text: panel.label + (name === "free" ? " (free)" : "") }));
    });
    select.append(group);
  }
  select.value = shown.panel;
}

function fillLevels() {
  const colours = familyColours(), boxes = responses.levels.map((text, number) => {
    const box = make("input", { type: "checkbox", checked: shown.levels[number] }), mark = make("span", { className: "swatch" });
    mark.style.background = colours[number];
    box.onchange = () => { shown.levels[number] = box.checked; drawResponse(); };
    return make("label", {}, box, mark, text);
  });
  byId("levels").replaceChildren(byId("levels").firstElementChild, ...boxes);
}

const points = (group, y, ink, more) => ({ mode: "markers", x: group.frequency, y, marker: { color: colour("paper"), size: 6.5, symbol: MARKS[group.sweep], line: { color: ink, width: 1.4 } }, ...more });
const bars = (array, ink) => ({ type: "data", array, color: ink, thickness: 1, width: 0 });

function residualTraces(group, ink, name, kind, panel) {
  const residual = group.residual, hover = (unit) => "%{x:.5g} Hz<br>%{y:.3g} " + unit + "<extra>" + name + "</extra>";
  if (kind !== "sigma") {
    const unit = kind === "phase" ? "°" : panel.static ? panel.unit : "%";
    return [points(group, residual[kind], ink, { yaxis: "y2", error_y: bars(residual[kind + "_deviation"], ink), hovertemplate: hover(unit) })];
  }
  const real = points(group, residual.real, ink, { yaxis: "y2", marker: { color: ink, size: 5.5, symbol: MARKS[group.sweep] }, hovertemplate: hover("standard deviations") });
  return panel.static ? [real] : [real, points(group, residual.imaginary, ink, { yaxis: "y2", hovertemplate: hover("standard deviations") })];
}

function chooseResidual(panel) {
  const kind = byId("residual").value;
  return kind === "phase" && (!panel.phase || panel.static) ? "sigma" : kind;
}

function drawResponse() {
  if (!responses) return;
  const panel = responses.panels[shown.panel], colours = familyColours(), kind = chooseResidual(panel), traces = [];
  const there = panel.groups.filter((group) => shown.levels[group.level]);
  const seen = there.flatMap((group) => [group, ...(byId("runs").checked ? group.runs : [])]).map((curve) => curve.amplitude);
  const scale = panel.static ? null : logScale(seen, there.map((group) => group.line.amplitude));
  movedTraces = [];
  panel.groups.forEach((group, number) => {
    if (!shown.levels[group.level]) return;
    const ink = colours[group.level], name = responses.levels[group.level] + ({ 1: ", up", "-1": ", down" }[group.sweep] || "");
    const faded = shown.level !== null && shown.level !== group.level ? 0.45 : 1;
    traces.push(...limitTraces(number, ink));
    if (byId("runs").checked) {
      for (const run of group.runs) traces.push({ mode: "lines", x: run.frequency, y: run.amplitude, line: { color: ink, width: 0.7 }, opacity: 0.5 * faded, hovertemplate: "%{x:.5g} Hz<br>%{y:.4g} " + panel.unit + "<extra>" + name + ", " + run.name + "</extra>" });
    }
    traces.push({ mode: "lines", x: group.line_frequency, y: within(scale, group.line.amplitude), line: { color: ink, width: 2 }, opacity: faded, hoverinfo: "skip" });
    movedTraces.push({ index: traces.length, number });
    traces.push({ mode: "lines", x: [], y: [], line: { color: ink, width: 2.4, dash: "dash" }, hoverinfo: "skip" });
    traces.push(points(group, group.amplitude, ink, { opacity: faded, error_y: bars(group.deviation, ink), hovertemplate: "%{x:.5g} Hz<br>%{y:.4g} " + panel.unit + "<extra>" + name + ", mean</extra>" }));
    traces.push(...residualTraces(group, ink, name, kind, panel).map((trace) => ({ ...trace, opacity: faded })));
  });
  Plotly.react("response", traces, layoutOf(panel, scale, kind), CONFIG);
  drawMoved();
}

function layoutOf(panel, scale, kind) {
  const words = { sigma: "residual [std. dev.]", amplitude: panel.static ? "residual [" + panel.unit + "]" : "residual [%]", phase: "residual [deg]" }[kind];
  const shapes = kind === "sigma" ? [{ type: "rect", xref: "paper", x0: 0, x1: 1, yref: "y2", y0: -2, y1: 2, layer: "below", line: { width: 0 }, fillcolor: colour("ground") }] : [];
  if (shown.frequency !== null) shapes.push({ type: "line", xref: "x", yref: "paper", x0: shown.frequency, x1: shown.frequency, y0: 0, y1: 1, line: { color: colour("accent"), width: 1.4, dash: "dot" } });
  return layout({
    height: 520, margin: { l: 70, r: 14, t: 8, b: 44 }, shapes,
    xaxis: axis({ title: "frequency [Hz]", anchor: "y2" }),
    yaxis: axis({ title: (panel.static ? "static part [" : "amplitude [") + panel.unit + "]", domain: [0.36, 1], ...(scale ? { type: "log", range: scale.range, ...logTicks(scale.range, digits) } : { type: "linear" }) }),
    yaxis2: axis({ title: words, domain: [0, 0.29], zeroline: true, zerolinecolor: colour("line"), nticks: 6 }),
  });
}

// Line of a group with parameters moved by so much: motions by their inverse, which is nearly linear in the parameters
// where a resonance shifts; all else to first order.
function moveLine(group, panel, steps) {
  const [re, im] = group.value, amplitude = new Array(re.length);
  const inverse = panel.feature === "F / X";
  for (let k = 0; k < re.length; k++) {
    if (re[k] === null) { amplitude[k] = null; continue; }
    let a = 0, b = 0;
    for (const [number, step] of steps) { a += group.slopes[number][0][k] * step; b += group.slopes[number][1][k] * step; }
    const size = re[k] * re[k] + im[k] * im[k];
    if (inverse && size > 0) {
      const c = 1 - (a * re[k] + b * im[k]) / size, d = -(b * re[k] - a * im[k]) / size;
      amplitude[k] = Math.sqrt(size / (c * c + d * d));
    } else amplitude[k] = panel.static ? re[k] + a : Math.hypot(re[k] + a, im[k] + b);
  }
  return amplitude;
}

// The dashed curves: by sensitivities while a slider is dragged, exact once the worker has them.
function drawMoved() {
  if (!responses || !movedTraces.length || !byId("response").data) return;
  const panel = responses.panels[shown.panel], steps = movedSteps(), exact = exactLines();
  const indices = movedTraces.map((trace) => trace.index), empty = !steps.length;
  const x = movedTraces.map(({ number }) => (empty ? [] : panel.groups[number].line_frequency));
  const y = movedTraces.map(({ number }) => {
    if (empty) return [];
    if (!exact) return moveLine(panel.groups[number], panel, steps);
    const [re, im] = exact[shown.panel][number];
    return re.map((value, k) => (value === null || panel.static ? value : Math.hypot(value, im[k])));
  });
  Plotly.restyle("response", { x, y }, indices);
}
