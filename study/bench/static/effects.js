"use strict";
// Candidate effects: what each is, what it would explain, what it is confused with; and Add.
let candidates = null, showAll = false;
const FIRST = 6;

function beginEffects(data) {
  candidates = data;
  drawEffects();
}

function drawEffects() {
  if (!candidates) return;
  const { rows, verdict, chance } = candidates, most = Math.max(...rows.map((row) => row.gain), chance ?? 0);
  const isScreened = chance !== null;
  byId("finding").textContent = verdict ? typeset(verdict.sentence) : isScreened ? "By the screening, to first order. Diagnose fits the promising ones and tests them on held-out data." : "Diagnose fits them to the data.";
  byId("finding").className = verdict ? "" : "sub";
  drawDoubts(verdict);
  byId("finding").title = verdict ? verdict.threshold : "";
  byId("chance").hidden = !isScreened;
  byId("chance").textContent = "Where nothing is missing, the best χ² still falls: by more than " + digits(chance) + " in 1 of 100 campaigns.";
  byId("gain-head").textContent = rows.some((row) => row.probability !== null) ? "probability, χ² falls by" : "χ² falls by";
  byId("candidates").replaceChildren(byId("candidates").tHead, ...rows.slice(0, showAll ? rows.length : FIRST).map((row) => drawCandidate(row, most)));
  byId("all").hidden = rows.length <= FIRST;
  byId("all").textContent = showAll ? "fewer" : "all " + rows.length;
}

function drawCandidate(row, most) {
  const bar = make("i"), button = make("button", { className: "add", text: "Add", disabled: isBusy(), title: row.is_fitted ? "with the values of the diagnosis" : "with the strength to first order" });
  bar.style.width = (100 * Math.max(row.gain, 0)) / most + "%";
  button.setAttribute("aria-label", "Add " + row.name);
  button.onclick = () => call("add", { effect: row.name, values: row.value });
  const gain = (row.probability !== null ? digits(100 * row.probability) + " %, " : "") + (row.is_fitted ? digits(row.gain) : "(" + digits(row.gain) + ")");
  const why = [row.physics];
  if (row.held_out !== null) why.push("Held-out error with it: " + digits(100 * row.held_out) + " %.");
  if (row.held_out_deviations !== undefined) why.push("Held-out error with it: " + digits(row.held_out_deviations) + " standard deviations.");
  if (row.confused.length) why.push("Confused with " + row.confused.map(([other, cosine]) => other + " (" + cosine.toFixed(2) + ")").join(", ") + ".");
  return make("tbody", { className: row.is_named ? "named" : "" },
    make("tr", { className: "head" }, make("td", { className: "word" }, make("b", { text: row.name })), make("td", { text: row.strength }), make("td", { className: "gain" }, gain, make("span", { className: "track" }, bar)), make("td", {}, button)),
    make("tr", {}, make("td", { className: "word why", colSpan: 4, text: why.join(" ") })));
}
