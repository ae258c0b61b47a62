const RESIDUALS = [["sigma", "standard deviations"], ["amplitude", "amplitude"], ["phase", "phase"]];
const shown = { panel: 0, levels: [], runs: true, residual: "sigma" };
const MARKS = { "1": "triangle-up", "0": "circle", "-1": "triangle-down" };
let responses = null;

function choices() {
  const { panels, levels, colours } = responses, select = byId("panel");
  for (const name of [...new Set(panels.map((panel) => panel.configuration))]) {
    const group = document.createElement("optgroup");
    group.label = name + " structure";
    panels.forEach((panel, number) => {
      if (panel.configuration !== name) return;
      const option = document.createElement("option");
      option.value = number;
      option.textContent = panel.label + (name === "free" ? " (free)" : "");
      group.append(option);
    });
    select.append(group);
  }
  select.value = shown.panel;
  select.onchange = () => { shown.panel = Number(select.value); drawResponse(); };
  levels.forEach((text, number) => {
    const mark = document.createElement("span"), box = document.createElement("input"), line = document.createElement("label");
    mark.className = "swatch"; mark.style.background = colours[number];
    box.type = "checkbox"; box.checked = shown.levels[number] = true;
    box.onchange = () => { shown.levels[number] = box.checked; drawResponse(); };
    line.append(box, mark, text);
    byId("levels").append(line);
  });
  byId("runs").onchange = () => { shown.runs = byId("runs").checked; drawResponse(); };
  for (const [kind, text] of RESIDUALS) {
    const button = document.createElement("button");
    button.textContent = text; button.dataset.kind = kind;
    button.onclick = () => { shown.residual = kind; drawResponse(); };
    byId("residuals").append(button);
  }
}

// A trace of points, for an axis.
const points = (group, y, colour, more) => ({ mode: "markers", x: group.frequency, y, showlegend: false,
  marker: { color: "white", size: 6.5, symbol: MARKS[group.sweep], line: { color: colour, width: 1.4 } }, ...more });
const bars = (array, colour) => ({ type: "data", array, color: colour, thickness: 1, width: 0 });

function residualTraces(group, colour, name, kind, panel) {
  const residual = group.residual, hover = (text, unit) => "%{x:.5g} Hz<br>" + text + " %{y:.3g} " + unit + "<extra>" + name + "</extra>";
  if (kind === "sigma") {
    const traces = [points(group, residual.real, colour, { yaxis: "y2", marker: { color: colour, size: 5.5, symbol: MARKS[group.sweep] }, hovertemplate: hover(panel.static ? "" : "real part", "standard deviations") })];
    if (!panel.static) traces.push(points(group, residual.imaginary, colour, { yaxis: "y2", hovertemplate: hover("imaginary part", "standard deviations") }));
    return traces;
  }
  const unit = kind === "phase" ? "°" : panel.static ? panel.unit : "%";
  return [points(group, residual[kind], colour, { yaxis: "y2", error_y: bars(residual[kind + "_deviation"], colour), hovertemplate: hover("", unit) })];
}

function drawResponse() {
  const { panels, levels, colours } = responses, panel = panels[shown.panel], traces = [];
  const kind = panel.static && shown.residual === "phase" ? "sigma" : panel.phase || shown.residual !== "phase" ? shown.residual : "sigma";
  const there = panel.groups.filter((group) => shown.levels[group.level]);
  const seen = there.flatMap((group) => [group, ...(shown.runs ? group.runs : [])]).map((curve) => curve.amplitude);
  const scale = panel.static ? null : logAxis(seen, there.map((group) => group.line.amplitude));
  for (const group of there) {
    const colour = colours[group.level], name = levels[group.level] + ({ "1": ", up", "-1": ", down" }[group.sweep] || "");
    const thin = { mode: "lines", line: { color: colour, width: 0.7 }, opacity: 0.55, showlegend: false };
    if (shown.runs) {
      for (const run of group.runs) {
        traces.push({ ...thin, x: run.frequency, y: run.amplitude, yaxis: "y", hovertemplate: "%{x:.5g} Hz<br>%{y:.4g} " + panel.unit + "<extra>" + name + ", " + run.name + "</extra>" });
        if (panel.phase) traces.push({ ...thin, x: run.frequency, y: run.phase, yaxis: "y3", hoverinfo: "skip" });
      }
    }
    const thick = { mode: "lines", x: group.line_frequency, line: { color: colour, width: 2.2 }, showlegend: false, hoverinfo: "skip" };
    traces.push({ ...thick, y: within(scale, group.line.amplitude), yaxis: "y" });
    if (panel.phase) traces.push({ ...thick, y: group.line.phase, yaxis: "y3" });
    traces.push(points(group, group.amplitude, colour, { yaxis: "y", error_y: bars(group.deviation, colour), hovertemplate: "%{x:.5g} Hz<br>%{y:.4g} " + panel.unit + "<extra>" + name + ", mean</extra>" }));
    if (panel.phase) traces.push(points(group, group.phase, colour, { yaxis: "y3", hovertemplate: "%{x:.5g} Hz<br>%{y:.4g}°<extra>" + name + "</extra>" }));
    traces.push(...residualTraces(group, colour, name, kind, panel));
  }
  const bottom = panel.phase ? "y3" : "y2", top = panel.phase ? [0.52, 1] : [0.42, 1], middle = panel.phase ? [0.25, 0.46] : [0, 0.36];
  const words = { sigma: "residual<br>[std. dev.]", amplitude: panel.static ? "residual<br>[" + panel.unit + "]" : "residual of<br>amplitude [%]", phase: "residual of<br>phase [deg]" }[kind];
  const layout = {
    font: FONT, height: panel.phase ? 760 : 600, margin: { l: 84, r: 20, t: 12, b: 50 }, paper_bgcolor: "white", plot_bgcolor: "white", hovermode: "closest",
    xaxis: axis({ title: { text: "frequency [Hz]" }, anchor: bottom }),
    yaxis: axis({ title: { text: (panel.static ? "static part [" : "amplitude [") + panel.unit + "]" }, domain: top, ...(scale ? scale.axis : {}) }),
    yaxis2: axis({ title: { text: words }, domain: middle, zeroline: true, zerolinecolor: "#9aa5b1", nticks: 6 }),
    shapes: kind === "sigma" ? [{ type: "rect", xref: "paper", x0: 0, x1: 1, yref: "y2", y0: -2, y1: 2, layer: "below", line: { width: 0 }, fillcolor: "#e8edf2" }] : [],
    annotations: kind === "sigma" && !panel.static ? [{ xref: "paper", x: 1, yref: "paper", y: middle[1], xanchor: "right", yanchor: "bottom", showarrow: false, font: { size: 12, color: PALE }, text: "filled: real part of " + panel.feature + ", hollow: imaginary part; the band is noise" }] : [],
  };
  if (panel.phase) layout.yaxis3 = axis({ title: { text: "phase [deg]" }, domain: [0, 0.19], nticks: 6, ...(panel.harmonic !== 1 ? { range: [-190, 190], tickvals: [-180, -90, 0, 90, 180] } : {}) });
  const split = splitBands(traces, layout);
  Plotly.react("response", split.traces, split.layout, CONFIG);
  [...byId("residuals").children].forEach((button) => {
    button.classList.toggle("on", button.dataset.kind === kind);
    button.disabled = button.dataset.kind === "phase" && !panel.phase;
  });
}

function drawMap(data, number) {
  const map = data.maps[number], n = data.steps.length, rows = map.labels.length, columns = map.frequency.length;
  const scale = data.colours.flatMap((colour, step) => [[step / n, colour], [(step + 1) / n, colour]]);
  const every = Math.max(1, Math.ceil(columns / 14)), ticks = map.frequency.map((_, column) => column).filter((column) => column % every === 0);
  Plotly.react("map", [{
    type: "heatmap", z: map.image, y: map.labels.map((_, row) => row), x: map.frequency.map((_, column) => column), zmin: -0.5, zmax: n - 0.5, colorscale: scale,
    xgap: 1, ygap: 1, hoverongaps: false, customdata: map.values, text: map.labels.map((text) => map.frequency.map((f) => text + ", " + f + " Hz")),
    hovertemplate: "%{text}<br>%{customdata:.3g} standard deviations<extra></extra>",
    colorbar: mapBar(data.steps, rows),
  }], {
    font: FONT, height: mapHeight(rows), margin: { l: 110, r: 20, ...MAP_MARGIN }, paper_bgcolor: "white", plot_bgcolor: "white",
    xaxis: axis({ tickvals: ticks, ticktext: ticks.map((column) => map.frequency[column]), showgrid: false, title: { text: "frequency [Hz]" }, tickangle: 0 }),
    yaxis: axis(mapRows(map)),
  }, CONFIG);
  byId("whole").textContent = "all points together: " + label(map.whole) + " standard deviations";
  [...byId("configurations").children].forEach((button, at) => button.classList.toggle("on", at === number));
}

function beginMap(data) {
  data.maps.forEach((map, number) => {
    const button = document.createElement("button");
    button.textContent = map.configuration + " structure";
    button.onclick = () => drawMap(data, number);
    byId("configurations").append(button);
  });
  const worst = data.maps.reduce((best, map, number, all) => (map.whole > all[best].whole ? number : best), 0);
  drawMap(data, worst);
}

function beginResponses(data) {
  responses = data;
  shown.panel = data.first;
  choices();
  drawResponse();
}

const BEGIN = { responses: beginResponses, map: beginMap };
DATA.sections.forEach((section, number) => {
  if (section.element && section.data && Object.keys(section.data).length) BEGIN[section.element](section.data);
  section.plots.forEach((plot, at) => drawPlot("plot" + number + "-" + at, plot));
});
