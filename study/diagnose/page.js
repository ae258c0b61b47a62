const TRAINING = "#9fb3c8", HELD = "#1f4e79";
// Middle of each of two bars from the middle of their group, with the gap between groups that is set below.
const GAP = 0.34, BAR = (1 - GAP) / 4;
const DASHES = ["dot", "dash", "solid"], WIDTHS = [1.2, 1.4, 2.0];

function folded(text, most = 18) {
  const lines = [""];
  for (const word of text.split(" ")) {
    if ((lines[lines.length - 1] + " " + word).trim().length > most) lines.push(word);
    else lines[lines.length - 1] = (lines[lines.length - 1] + " " + word).trim();
  }
  return lines.filter((line) => line).join("<br>");
}

// In a narrow window the two charts stand below each other: side by side their numbers would lie on each other.
const NARROW = 640;

function drawWaterfall() {
  const steps = DATA.waterfall, x = steps.map((_, number) => number);
  const width = byId("waterfall").clientWidth, narrow = width < NARROW, across = (narrow ? width : 0.45 * width) - 118;
  // A letter takes up some 7 pixels.
  const fold = (text) => folded(text, Math.max(8, Math.min(18, Math.floor(across / steps.length / 7))));
  const lines = Math.max(...steps.map((step) => fold(step.name).split("<br>").length));
  const bars = (key, scale, name, colour, xaxis, yaxis, show) => ({
    type: "bar", x, y: steps.map((step) => (step[key] === null ? null : scale * step[key])), name, xaxis, yaxis, showlegend: show, legendgroup: name,
    marker: { color: steps.map((step) => (step.proposed ? "white" : colour)), line: { color: colour, width: 1.5 },
      pattern: { shape: steps.map((step) => (step.proposed ? "/" : "")), fillmode: "overlay", fgcolor: colour, size: 7, solidity: 0.3 } },
    hovertemplate: "%{y:.4g}<extra>" + name + "</extra>",
  });
  const ticks = { tickvals: x, ticktext: steps.map((step) => fold(step.name)), ticks: "", showgrid: false };
  const all = steps.flatMap((step) => [step.training_chi2, step.held_out_chi2]).filter((value) => value > 0);
  const highest = 100 * Math.max(...steps.flatMap((step) => [step.training, step.held_out]).filter((value) => value >= 0));
  const most = Math.log10(Math.max(2, ...all)), least = Math.log10(Math.min(0.5, ...all) / 1.3);
  // Numbers stand over their bars, and none on the line of the noise.
  const foot = (value) => (value < 1 && Math.log10(value) > -0.08 * (most - least) ? 1 : value);
  const numbers = (key, scale, side, xaxis, yaxis, at) => ({
    type: "scatter", mode: "text", x: x.map((each) => each + side * BAR), y: steps.map((step) => at(scale * step[key])), xaxis, yaxis,
    text: steps.map((step) => (step[key] === null ? "unknown" : label(scale * step[key]))), textposition: "top center", textfont: { size: narrow ? 10.5 : 12, color: INK }, cliponaxis: false, showlegend: false, hoverinfo: "skip",
  });
  const same = (value) => value;
  const footRoom = 14 + 17 * lines, height = 336 + footRoom, between = (footRoom + 24) / (2 * height);
  const places = narrow ? { x: [0, 1], x2: [0, 1], y: [0.5 + between / 2, 1], y2: [0, 0.5 - between / 2] } : { x: [0, 0.47], x2: [0.555, 1], y: [0, 1], y2: [0, 1] };
  Plotly.react("waterfall", [
    bars("training", 100, "training data", TRAINING, "x", "y", true), bars("held_out", 100, "held-out data", HELD, "x", "y", true),
    bars("training_chi2", 1, "training data", TRAINING, "x2", "y2", false), bars("held_out_chi2", 1, "held-out data", HELD, "x2", "y2", false),
    numbers("training", 100, -1, "x", "y", same), numbers("held_out", 100, 1, "x", "y", same),
    numbers("training_chi2", 1, -1, "x2", "y2", foot), numbers("held_out_chi2", 1, 1, "x2", "y2", foot),
  ], {
    font: FONT, height: narrow ? 2 * height : height, margin: { l: 66, r: 52, t: narrow ? 62 : 34, b: footRoom }, barmode: "group", bargap: GAP, bargroupgap: 0.06,
    paper_bgcolor: "white", plot_bgcolor: "white", legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    xaxis: axis({ domain: places.x, ...ticks }), xaxis2: axis({ domain: places.x2, anchor: "y2", ...ticks }),
    yaxis: axis({ title: { text: "relative error [%]" }, domain: places.y, range: [0, 1.1 * highest || 1], ticks: "" }),
    yaxis2: axis({ title: { text: "reduced χ²" }, domain: places.y2, anchor: "x2", type: "log", range: [least, most + 0.12 * (most - least)], dtick: 1, ticks: "", exponentformat: "power" }),
    shapes: [{ type: "line", xref: "x2 domain", yref: "y2", x0: 0, x1: 1, y0: 1, y1: 1, layer: "below", line: { color: PALE, width: 1.2, dash: "dash" } }],
    annotations: [{ xref: "x2 domain", yref: "y2", x: 1, y: 0, yanchor: "middle", xanchor: "left", xshift: 5, text: "noise", showarrow: false, font: { size: 11, color: PALE } }],
  }, CONFIG);
}

const shown = { panel: 0, levels: [], stages: [] };

function choices() {
  const { panels, levels, stages, colours } = DATA.curves, select = byId("panel");
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
  select.onchange = () => { shown.panel = Number(select.value); drawResponse(); };
  const check = (home, text, list, number, on, mark) => {
    const box = document.createElement("input"), line = document.createElement("label");
    box.type = "checkbox"; box.checked = list[number] = on;
    box.onchange = () => { list[number] = box.checked; drawResponse(); };
    line.append(box, mark, text);
    byId(home).append(line);
  };
  levels.forEach((text, number) => {
    const mark = document.createElement("span");
    mark.className = "swatch"; mark.style.background = colours[number];
    check("levels", text, shown.levels, number, true, mark);
  });
  stages.forEach((text, number) => {
    const mark = document.createElement("span"), style = DASHES[number + 3 - stages.length];
    mark.className = "dash"; mark.style.borderTopStyle = { dot: "dotted", dash: "dashed", solid: "solid" }[style];
    check("stages", text, shown.stages, number, number >= stages.length - 2, mark);
  });
}

function drawResponse() {
  const { panels, levels, stages, colours } = DATA.curves, panel = panels[shown.panel], traces = [];
  const first = DASHES.length - stages.length;
  byId("history").hidden = !panel.static;
  const there = panel.groups.filter((group) => shown.levels[group.level]);
  const lines = there.flatMap((group) => group.lines.filter((_, stage) => shown.stages[stage]));
  const scale = panel.static ? null : logAxis(there.map((group) => group.amplitude), lines.map((line) => line.amplitude));
  for (const group of panel.groups) {
    if (!shown.levels[group.level]) continue;
    const colour = colours[group.level], name = levels[group.level];
    group.lines.forEach((line, stage) => {
      if (!shown.stages[stage]) return;
      const style = { mode: "lines", x: group.line_frequency, line: { color: colour, dash: DASHES[first + stage], width: WIDTHS[first + stage] },
        opacity: first + stage < 2 ? 0.75 : 1, showlegend: false, hoverinfo: "skip" };
      traces.push({ ...style, y: within(scale, line.amplitude), yaxis: "y" });
      if (!panel.static) traces.push({ ...style, y: line.phase, yaxis: "y2" });
    });
    const points = { mode: "markers", x: group.frequency, marker: { color: "white", size: 7, line: { color: colour, width: 1.5 } }, showlegend: false };
    const bars = (array) => ({ type: "data", array, color: colour, thickness: 1, width: 0 });
    traces.push({ ...points, y: group.amplitude, yaxis: "y", error_y: bars(group.deviation), hovertemplate: "%{x:.5g} Hz<br>%{y:.4g} " + panel.unit + "<extra>" + name + "</extra>" });
    if (!panel.static) traces.push({ ...points, y: group.phase, yaxis: "y2", error_y: bars(group.phase_deviation), hovertemplate: "%{x:.5g} Hz<br>%{y:.4g}°<extra>" + name + "</extra>" });
  }
  const layout = {
    font: FONT, height: panel.static ? 400 : 560, margin: { l: 78, r: 24, t: 12, b: 52 }, paper_bgcolor: "white", plot_bgcolor: "white", hovermode: "closest",
    xaxis: axis({ title: { text: "frequency [Hz]" }, anchor: panel.static ? "y" : "y2" }),
    yaxis: axis({ title: { text: (panel.static ? "" : "amplitude ") + "[" + panel.unit + "]" }, domain: panel.static ? [0, 1] : [0.37, 1], exponentformat: "power", ...(scale ? scale.axis : {}) }),
  };
  if (!panel.static) layout.yaxis2 = axis({ title: { text: "phase [deg]" }, domain: [0, 0.31] });
  if (!panel.static) layout.yaxis2.nticks = 7;
  if (!panel.static && panel.harmonic !== 1) Object.assign(layout.yaxis2, { range: [-190, 190], tickvals: [-180, -90, 0, 90, 180] });
  const split = splitBands(traces, layout);
  Plotly.react("response", split.traces, split.layout, CONFIG);
}

function drawMap(number) {
  const map = DATA.maps[number], n = DATA.steps.length, rows = map.labels.length, columns = map.frequency.length;
  const scale = DATA.mapColours.flatMap((colour, step) => [[step / n, colour], [(step + 1) / n, colour]]);
  const y = map.labels.map((_, row) => row);
  const traces = map.images.map((image, side) => ({
    type: "heatmap", z: image, y, x: map.frequency.map((_, column) => column), xaxis: side ? "x2" : "x", yaxis: side ? "y2" : "y", zmin: -0.5, zmax: n - 0.5, colorscale: scale,
    xgap: 1, ygap: 1, showscale: side === 1, hoverongaps: false, customdata: map.values[side],
    text: map.labels.map((text) => map.frequency.map((f) => text + ", " + f + " Hz")),
    hovertemplate: "%{text}<br>%{customdata:.3g} standard deviations<extra></extra>",
    colorbar: mapBar(DATA.steps, rows),
  }));
  const every = Math.max(1, Math.ceil(columns / 9));
  const ticks = map.frequency.map((_, column) => column).filter((column) => column % every === 0);
  const bottom = { tickvals: ticks, ticktext: ticks.map((column) => map.frequency[column]), showgrid: false, title: { text: "frequency [Hz]" }, tickangle: 0 };
  const left = mapRows(map);
  const title = (side, x) => ({ text: (side ? "after" : "before") + " (root mean square " + label(map.whole[side]) + ")", xref: x + " domain", yref: "paper", x: 0, y: 1, yanchor: "bottom", yshift: 6, showarrow: false, font: { size: 13.5 } });
  Plotly.react("map", traces, {
    font: FONT, height: mapHeight(rows), margin: { l: 90, r: 20, ...MAP_MARGIN }, paper_bgcolor: "white", plot_bgcolor: "white",
    xaxis: axis({ domain: [0, 0.487], ...bottom }), xaxis2: axis({ domain: [0.513, 1], anchor: "y2", ...bottom }),
    yaxis: axis(left), yaxis2: axis({ ...left, anchor: "x2", matches: "y", showticklabels: false }),
    annotations: [title(0, "x"), title(1, "x2")],
  }, CONFIG);
  [...byId("configurations").children].forEach((button, at) => button.classList.toggle("on", at === number));
}

// Begin where the model failed most.
const worst = DATA.maps.map((map) => map.whole[0]).reduce((best, value, number, all) => (value > all[best] ? number : best), 0);
shown.panel = Math.max(0, DATA.curves.panels.findIndex((panel) => panel.configuration === DATA.maps[worst].configuration));
drawWaterfall();
DATA.backbones.forEach((plot, number) => drawPlot("backbone" + number, plot));
choices();
byId("panel").value = shown.panel;
drawResponse();
DATA.maps.forEach((map, number) => {
  const button = document.createElement("button");
  button.textContent = map.configuration + " structure";
  button.onclick = () => drawMap(number);
  byId("configurations").append(button);
});
drawMap(worst);
