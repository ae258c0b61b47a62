"use strict";
// Candidate effects: what each is, what it would explain, what it is confused with; and Add.
let candidates = null, showAll = false;
const FIRST = 7;

function beginEffects(data) {
  candidates = data;
  drawEffects();
}

function drawEffects() {
  if (!candidates) return;
  const { rows, verdict } = candidates, most = Math.max(...rows.map((row) => row.gain), 1e-9);
  byId("finding").textContent = verdict ? typeset(verdict.sentence) : "By the screening, to first order. Diagnose fits the promising ones and tests them on held-out data.";
  byId("finding").className = verdict ? "" : "sub";
  byId("finding").title = verdict ? verdict.threshold : "";
  byId("gain-head").textContent = rows.some((row) => row.probability !== null) ? "probability, χ² falls by" : "χ² falls by";
  document.querySelector("#candidates tbody").replaceChildren(...rows.slice(0, showAll ? rows.length : FIRST).map((row) => drawCandidate(row, most)));
  byId("all").hidden = rows.length <= FIRST;
  byId("all").textContent = showAll ? "fewer" : "all " + rows.length;
}

function drawCandidate(row, most) {
  const bar = make("i"), button = make("button", { className: "add", text: "Add", disabled: isBusy(), title: row.is_fitted ? "with the values of the diagnosis" : "with the strength to first order" });
  bar.style.width = (100 * Math.max(row.gain, 0)) / most + "%";
  button.setAttribute("aria-label", "Add " + row.name);
  button.onclick = () => call("add", { effect: row.name, values: row.value });
  const gain = (row.probability !== null ? digits(100 * row.probability) + " %, " : "") + (row.is_fitted ? digits(row.gain) : "(" + digits(row.gain) + ")");
  const name = make("td", { className: "word" }, make("b", { text: row.name }), make("span", { className: "why", text: row.physics }));
  if (row.confused.length) name.append(make("span", { className: "confused", text: "confused with " + row.confused.map(([other, cosine]) => other + " (" + cosine.toFixed(2) + ")").join(", ") }));
  const held = row.held_out === null ? [] : [make("span", { className: "why", text: "held-out error " + digits(100 * row.held_out) + " %" })];
  return make("tr", { className: row.is_named ? "named" : "" }, name, make("td", { text: row.strength }), make("td", { className: "gain" }, gain, make("span", { className: "track" }, bar), ...held), make("td", {}, button));
}
