"use strict";
const INK = "#18222d", PALE = "#5d6b7a", GRID = "#e2e7ec";
const FONT = { family: 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif', size: 13, color: INK };
// Measurements are nobody else's business: without the button that sends a chart to a server.
const CONFIG = { responsive: true, displaylogo: false, showSendToCloud: false, modeBarButtonsToRemove: ["sendChartToCloud", "sendDataToCloud", "lasso2d", "select2d", "autoScale2d"] };
const byId = (id) => document.getElementById(id);
const axis = (more) => ({ gridcolor: GRID, zeroline: false, linecolor: "#9aa5b1", ticks: "outside", tickcolor: "#9aa5b1", ticklen: 4, automargin: true, tickfont: { size: 12 }, ...more, ...(more.title ? { title: { ...more.title, font: { size: 13 } } } : {}) });
const label = (value) => (value < 0.001 && value > 0 ? value.toExponential(1) : Number(value.toPrecision(3)).toLocaleString("en-US", { maximumSignificantDigits: 3 }));
// A figure that was made as plain data.
function drawPlot(id, plot) {
  const layout = { font: FONT, paper_bgcolor: "white", plot_bgcolor: "white", margin: { l: 70, r: 24, t: 14, b: 50 }, hovermode: "closest", legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" }, ...plot.layout };
  for (const name of Object.keys(layout)) if (/^[xy]axis/.test(name)) layout[name] = axis(layout[name]);
  Plotly.newPlot(id, plot.data, layout, CONFIG);
}
