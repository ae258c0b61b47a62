"use strict";
// What all drawings share: the theme's colours, axes, and numbers in words.
const byId = (id) => document.getElementById(id);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const isDark = () => getComputedStyle(document.documentElement).colorScheme === "dark";
// Measurements are nobody else's business: without the button that sends a chart to a server.
const CONFIG = { responsive: true, displaylogo: false, showSendToCloud: false, modeBarButtonsToRemove: ["sendChartToCloud", "sendDataToCloud", "lasso2d", "select2d", "autoScale2d"] };
const FAMILY = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';

function axis(more) {
  const title = more.title ? { title: { text: more.title, font: { size: 12.5 } } } : {};
  return { gridcolor: colour("grid"), zeroline: false, linecolor: colour("line"), ticks: "outside", tickcolor: colour("line"), ticklen: 4, automargin: true, tickfont: { size: 11.5 }, ...more, ...title };
}

function layout(more) {
  return { font: { family: FAMILY, size: 12.5, color: colour("ink") }, paper_bgcolor: colour("paper"), plot_bgcolor: colour("paper"), hovermode: "closest", showlegend: false, hoverlabel: { font: { family: FAMILY, size: 12 } }, ...more };
}

function digits(value, count = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6)) return value.toExponential(count - 1);
  return Number(value.toPrecision(count)).toLocaleString("en-US", { maximumSignificantDigits: count });
}

// Words as they are printed: ± for +-, χ² for chi^2, µm for um.
const typeset = (text) => text.replaceAll("+-", "±").replaceAll("chi^2", "χ²").replaceAll("^2", "²").replaceAll("^3", "³").replace(/\bum\b/g, "µm");

// An element with text, classes and children; text is never read as HTML.
function make(name, { text, className, ...more } = {}, ...children) {
  const element = document.createElement(name);
  if (text !== undefined) element.textContent = typeset(text);
  if (className) element.className = className;
  Object.assign(element, more);
  element.append(...children);
  return element;
}
