"use strict";
// Errors falling step by step, the history of the case, and what was done here.
let errors = null;

function beginErrors(steps) {
  errors = steps;
  drawErrors();
}

function drawErrors() {
  if (!errors) return;
  const x = errors.map((_, number) => number), folded = errors.map((step) => (step.name + (step.proposed ? " (proposed)" : "")).replace(/(.{8,16}?) /g, "$1<br>"));
  const bar = (key, name, ink) => ({ type: "bar", name, x, y: errors.map((step) => (step[key] === null ? null : 100 * step[key])), marker: { color: errors.map((step) => (step.proposed ? colour("paper") : ink)), line: { color: ink, width: 1.5 }, pattern: { shape: errors.map((step) => (step.proposed ? "/" : "")), fillmode: "overlay", fgcolor: errors.map(() => ink), size: 7, solidity: 0.3 } }, text: errors.map((step) => (step[key] === null ? "" : digits(100 * step[key]))), textposition: "outside", textfont: { size: 11.5 }, cliponaxis: false, hovertemplate: "%{y:.4g} %<extra>" + name + "</extra>" });
  const highest = Math.max(...errors.flatMap((step) => [step.training ?? 0, step.held_out ?? 0])) * 100;
  Plotly.react("errors", [bar("training", "training data", isDark() ? "#5d7a94" : "#9fb3c8"), bar("held_out", "held-out data", colour("blue"))], layout({
    height: 250, margin: { l: 56, r: 10, t: 26, b: 50 }, barmode: "group", bargap: 0.3, showlegend: true, legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    xaxis: axis({ tickvals: x, ticktext: folded, showgrid: false, ticks: "" }), yaxis: axis({ title: "relative error [%]", range: [0, 1.15 * highest || 1] }),
  }), CONFIG);
}

// A source or a whole case is folded.
const SHORT = 200;
const WHAT = { diagnosis: "diagnosed", add: "added", undo: "took back", calibration: "calibrated" };

function drawHistory(steps) {
  byId("history").replaceChildren(...steps.toReversed().map((step) => {
    const words = step.what === "diagnosis" ? "diagnosed: " + step.sentence : step.what === "calibration" ? "calibrated" : WHAT[step.what] + " " + step.effect + (step.values.length ? " (" + step.values.join(", ") + ")" : "");
    const item = make("li", { className: step.back ? "standing" : "" }, make("span", { className: "when", text: step.when.slice(0, 16).replace("T", " ") }), make("span", { text: words }));
    if (step.back) {
      const button = make("button", { text: "Back to before this", disabled: isBusy() });
      button.onclick = () => call("undo", { count: step.back });
      item.append(button);
    }
    if (step.diff.length) item.append(make("details", {}, make("summary", { text: "what changed in the case" }), make("pre", { textContent: step.diff.join("\n"), tabIndex: 0 })));
    return item;
  }));
  if (!steps.length) byId("history").append(make("li", { className: "pale", text: "Nothing yet. What Diagnose finds, and what Add and Calibrate write into the case, is listed here." }));
  byId("undo").dataset.possible = steps.some((step) => step.back) ? "yes" : "";
}

function drawLog(entries) {
  const kind = document.querySelector("input[name=as]:checked").value;
  // The newest first.
  byId("log").replaceChildren(...entries.toReversed().map((entry) => {
    const numbers = Object.entries(entry.numbers).map(([name, value]) => name.replace(/ \[(.*)\]$/, "") + " " + (typeof value === "number" ? digits(value, 5) + (/\[%\]/.test(name) ? " %" : /\[deg\]/.test(name) ? "°" : "") : value)).join("; ");
    const done = make("code", { textContent: entry[kind] }), first = entry[kind].slice(0, SHORT);
    return make("li", {}, entry[kind].length > SHORT ? make("details", {}, make("summary", {}, make("code", { textContent: first + "…" })), done) : done, make("span", { className: "numbers", text: numbers }));
  }));
}
