"use strict";
// Map of the misfit; a click goes to sensor, level and frequency.
let misfit = null;
const MOST_WORST = 4;

function beginMap(data) {
  const before = misfit && misfit.maps[byId("configuration").value || 0];
  misfit = data;
  const worst = data.maps.reduce((best, map, number, all) => (map.whole > all[best].whole ? number : best), 0);
  const same = before ? data.maps.findIndex((map) => map.configuration === before.configuration) : -1;
  byId("configuration").replaceChildren(...data.maps.map((map, number) => make("option", { value: number, text: map.configuration })));
  byId("configuration").value = same >= 0 ? same : worst;
  drawMap();
}

function drawMap() {
  if (!misfit) return;
  const map = misfit.maps[byId("configuration").value], n = misfit.steps.length, rows = map.labels.length, columns = map.frequency.length;
  // The palest step is the ground of the page: on a dark one it would glare.
  const inks = misfit.colours.map((ink, step) => (step || !isDark() ? ink : colour("grid")));
  const scale = inks.flatMap((ink, step) => [[step / n, ink], [(step + 1) / n, ink]]);
  const every = Math.max(1, Math.ceil(columns / 10)), ticks = map.frequency.map((_, column) => column).filter((column) => column % every === 0);
  const height = Math.max(230, 90 + 9 * rows);
  byId("map").style.minHeight = height + "px";
  Plotly.react("map", [{
    type: "heatmap", z: map.image, y: map.labels.map((_, row) => row), x: map.frequency.map((_, column) => column), zmin: -0.5, zmax: n - 0.5, colorscale: scale,
    xgap: 1, ygap: 1, hoverongaps: false, customdata: map.values, text: map.labels.map((text) => map.frequency.map((f) => text + ", " + f + " Hz")),
    hovertemplate: "%{text}<br>%{customdata:.3g} standard deviations<extra></extra>",
    colorbar: { tickvals: misfit.steps.map((_, step) => step - 0.5), ticktext: misfit.steps.map(String), title: { text: "standard deviations", side: "right", font: { size: 11.5 } }, thickness: 12, outlinewidth: 0 },
  }], layout({
    height, margin: { l: 100, r: 10, t: 8, b: 46 },
    xaxis: axis({ tickvals: ticks, ticktext: ticks.map((column) => map.frequency[column]), showgrid: false, title: "frequency [Hz]", tickangle: 0 }),
    yaxis: axis({ tickvals: map.groups.map((group) => (group.first + group.last) / 2), ticktext: map.groups.map((group) => group.label), showgrid: false, ticks: "", autorange: false, range: [rows - 0.4, -0.6] }),
  }), CONFIG);
  const element = byId("map");
  element.removeAllListeners("plotly_click");
  element.on("plotly_click", (event) => show(map, event.points[0].y, event.points[0].x));
  byId("whole").textContent = "all points together: " + digits(map.whole) + " standard deviations";
  listWorst(map);
}

// The worst cells as buttons, for the keyboard: one of each row.
function listWorst(map) {
  const cells = map.values.map((line, row) => ({ row, column: line.reduce((best, value, at) => ((value ?? -1) > (line[best] ?? -1) ? at : best), 0) }));
  const worst = cells.filter(({ row, column }) => map.places[row].sensor && map.values[row][column] !== null).sort((a, b) => map.values[b.row][b.column] - map.values[a.row][a.column]);
  byId("worst").replaceChildren("Worst:", ...worst.slice(0, MOST_WORST).map(({ row, column }) => {
    const button = make("button", { text: map.labels[row] + " at " + map.frequency[column] + " Hz: " + digits(map.values[row][column]) });
    button.onclick = () => show(map, row, column);
    return button;
  }));
}

function show(map, row, column) {
  const place = map.places[row];
  if (!place.sensor || !responses) return;
  const panel = responses.panels.findIndex((each) => each.sensor === place.sensor && each.harmonic === place.harmonic && each.configuration === map.configuration);
  if (panel < 0) return;
  shown.panel = panel;
  shown.frequency = Number(map.frequency[column]);
  shown.level = responses.levels.findIndex((text) => parseFloat(text) === place.level);
  byId("panel").value = panel;
  if (shown.level >= 0) shown.levels[shown.level] = true; else shown.level = null;
  fillLevels();
  drawResponse();
  byId("responses").scrollIntoView({ block: "nearest" });
}
