"use strict";
// Parameters: prior, interval, bounds, and a slider that moves the curves.
let parameters = null, fitted = {}, exact = null, moved = {};

function beginParameters(rows) {
  parameters = rows;
  moved = {};
  exact = null;
  tellStart();
  drawParameters();
}

function drawParameters() {
  if (!parameters) return;
  // What is at its bound, in the case or in the fit, comes first.
  const atBound = (row) => row.at_bound || Boolean(fitted[row.name] && fitted[row.name].at_bound);
  byId("parameters").replaceChildren(...[...parameters].sort((a, b) => atBound(b) - atBound(a)).map(drawParameter));
  byId("back").hidden = !Object.keys(moved).length;
}

function drawParameter(row) {
  const { first, last, step, size, unit } = row.slider, number = row.number, fit = fitted[row.name];
  const written = (value) => digits(value / size, 5) + (unit ? " " + unit : "");
  const value = make("output", { text: written(moved[row.name] ?? row.value) });
  const slider = make("input", { type: "range", min: first, max: last, step, value: moved[row.name] ?? row.value });
  slider.setAttribute("aria-label", row.name);
  slider.dataset.parameter = row.name;
  slider.setAttribute("aria-valuetext", written(row.value));
  slider.oninput = () => {
    moved[row.name] = Number(slider.value);
    exact = null;
    value.textContent = typeset(written(moved[row.name]));
    slider.setAttribute("aria-valuetext", value.textContent);
    byId("back").hidden = false;
    tellMoved(isAlone() ? "below when you let go" : "by sensitivities; the exact curve follows");
    drawMoved();
  };
  slider.onchange = () => call("move", { values: { ...moved } });
  const atBound = row.at_bound || (fit && fit.at_bound);
  const facts = ["case " + row.text + (row.interval ? " ± " + row.interval : ""), ...(fit ? ["fitted " + fit.text] : []), "prior " + row.prior, "bounds " + row.bounds.join(" to ")];
  return make("div", { className: "parameter" + (atBound ? " bound" : "") },
    make("div", { className: "head" }, make("span", {}, make("b", { text: row.name + (atBound ? ", at its bound" : "") + " " }), make("span", { className: "facts", text: row.is_effect ? "added" : row.physics })), value),
    slider, make("div", { className: "facts", text: facts.join(" · ") }));
}

const valueOf = (name) => parameters.find((row) => row.name === name);
// Steps of the moved parameters by their numbers, as the slopes count them.
const movedSteps = () => Object.entries(moved).map(([name, value]) => [valueOf(name).number, value - valueOf(name).value]).filter(([, step]) => step !== 0);
const exactLines = () => (exact && JSON.stringify(exact.values) === JSON.stringify(moved) ? exact.panels || exact.data : null);

// Data without steady states have no curves: their features are computed anew.
const isAlone = () => document.body.classList.contains("is-alone");
const START = "Drag a slider: the dashed curve moves. The case stays as it is.", START_ALONE = "Move a slider: when you let go, all that is predicted is computed anew. The case stays as it is.";

function tellStart() {
  byId("moved").textContent = isAlone() ? START_ALONE : START;
}

function takeMoved(data) {
  exact = data;
  if (!exactLines()) return;
  tellMoved("exact");
  if (data.data) drawSections(data.data); else drawMoved();
}

function tellMoved(how) {
  const words = Object.entries(moved).map(([name, value]) => name + " = " + digits(value / valueOf(name).slider.size, 5) + " " + valueOf(name).slider.unit).join(", ");
  byId("moved").textContent = typeset((isAlone() ? "Predicted with " : "Dashed: ") + words + " (" + how + "). " + (isAlone() || movesShown() ? "" : "The response that is shown does not depend on it. ") + "The case stays as it is.");
}

// Whether what was moved changes the lines that are shown.
function movesShown() {
  const numbers = movedSteps().map(([number]) => number);
  return !responses || responses.panels[shown.panel].groups.some((group) => numbers.some((number) => group.slopes[number].some((part) => part.some((value) => value))));
}

function moveBack() {
  moved = {};
  exact = null;
  tellStart();
  drawParameters();
  if (isAlone()) drawSections(sections); else drawMoved();
}
