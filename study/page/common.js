const INK = "#18222d", PALE = "#5d6b7a", GRID = "#e2e7ec";
const FONT = { family: 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif', size: 13, color: INK };
// Measurements are nobody else's business: without the button that sends a chart to a server.
const CONFIG = { responsive: true, displaylogo: false, showSendToCloud: false, modeBarButtonsToRemove: ["sendChartToCloud", "sendDataToCloud", "lasso2d", "select2d", "autoScale2d"] };
const byId = (id) => document.getElementById(id);
const axis = (more) => ({ gridcolor: GRID, zeroline: false, linecolor: "#9aa5b1", ticks: "outside", tickcolor: "#9aa5b1", ticklen: 4, automargin: true, tickfont: { size: 12 }, ...more, ...(more.title ? { title: { ...more.title, font: { size: 13 } } } : {}) });
const label = (value) => (value < 0.001 && value > 0 ? value.toExponential(1) : Number(value.toPrecision(3)).toLocaleString("en-US", { maximumSignificantDigits: 3 }));
// A logarithmic axis for some curves, see `logScale`.
function logAxis(measured, predicted) {
  const scale = logScale(measured, predicted);
  if (!scale) return null;
  return { ...scale, axis: { type: "log", range: scale.range, ...logTicks(scale.range, label), minor: { showgrid: true, gridcolor: "#f0f3f6" } } };
}
// Height of a map of the misfit, and its scale: beside few rows the numbers of the scale need room as well.
const MAP_MARGIN = { t: 34, b: 56 };
const mapHeight = (rows) => Math.max(240, MAP_MARGIN.t + MAP_MARGIN.b + 13 * rows);
const mapBar = (steps, rows) => ({ tickvals: steps.map((_, step) => step - 0.5), ticktext: steps.map(String), title: { text: "standard deviations", side: "right", font: { size: 12 } }, thickness: 14, len: Math.min(1, 420 / (mapHeight(rows) - MAP_MARGIN.t - MAP_MARGIN.b)), lenmode: "fraction", y: 1, yanchor: "top", outlinewidth: 0 });
// Names of its rows: of each the level, and of the first of a sensor and harmonic these before it.
function mapRows(map) {
  const named = map.groups.flatMap(({ label, levels, first }) => levels.map((level, number) => [first + number, number ? level : "<b>" + label + "</b>, " + level]));
  return { tickvals: named.map(([row]) => row), ticktext: named.map(([, text]) => text), tickfont: { size: 11 }, showgrid: false, ticks: "", autorange: false, range: [map.labels.length - 0.4, -0.6] };
}
// A figure that was made as plain data.
function drawPlot(id, plot) {
  const layout = { font: FONT, paper_bgcolor: "white", plot_bgcolor: "white", margin: { l: 70, r: 24, t: 14, b: 50 }, hovermode: "closest", legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" }, ...plot.layout };
  for (const name of Object.keys(layout)) if (/^[xy]axis/.test(name)) layout[name] = axis(layout[name]);
  Plotly.newPlot(id, plot.data, layout, CONFIG);
}
