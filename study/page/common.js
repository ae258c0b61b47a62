"use strict";
const INK = "#18222d", PALE = "#5d6b7a", GRID = "#e2e7ec";
const FONT = { family: 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif', size: 13, color: INK };
// Measurements are nobody else's business: without the button that sends a chart to a server.
const CONFIG = { responsive: true, displaylogo: false, showSendToCloud: false, modeBarButtonsToRemove: ["sendChartToCloud", "sendDataToCloud", "lasso2d", "select2d", "autoScale2d"] };
const byId = (id) => document.getElementById(id);
const axis = (more) => ({ gridcolor: GRID, zeroline: false, linecolor: "#9aa5b1", ticks: "outside", tickcolor: "#9aa5b1", ticklen: 4, automargin: true, tickfont: { size: 12 }, ...more, ...(more.title ? { title: { ...more.title, font: { size: 13 } } } : {}) });
const label = (value) => (value < 0.001 && value > 0 ? value.toExponential(1) : Number(value.toPrecision(3)).toLocaleString("en-US", { maximumSignificantDigits: 3 }));
// A logarithmic axis for some curves, shape lists of amplitudes. It holds all of them, but for predictions below a hundredth
// of all measurements, which `within` leaves out: a model without friction has no third harmonic at all.
function logAxis(measured, predicted) {
  const ends = (values) => values.reduce(([low, high], value) => (value > 0 ? [Math.min(low, value), Math.max(high, value)] : [low, high]), [Infinity, 0]);
  const least = measured.flat().some((value) => value > 0) ? ends(measured.flat())[0] / 100 : 0;
  const [low, high] = ends([...measured, ...predicted].flat().filter((value) => value >= least));
  if (!(high > 0)) return null;
  const range = [Math.log10(low) - 0.08, Math.log10(high) + 0.05];
  // From three decades on labels at 2 and 5 lie on each other.
  return { least, axis: { type: "log", range, dtick: range[1] - range[0] > 3 ? 1 : "D2", exponentformat: "power", minor: { showgrid: true, gridcolor: "#f0f3f6" } } };
}
const within = (scale, amplitude) => (scale ? amplitude.map((value) => (value >= scale.least ? value : null)) : amplitude);
// A figure that was made as plain data.
function drawPlot(id, plot) {
  const layout = { font: FONT, paper_bgcolor: "white", plot_bgcolor: "white", margin: { l: 70, r: 24, t: 14, b: 50 }, hovermode: "closest", legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" }, ...plot.layout };
  for (const name of Object.keys(layout)) if (/^[xy]axis/.test(name)) layout[name] = axis(layout[name]);
  Plotly.newPlot(id, plot.data, layout, CONFIG);
}
