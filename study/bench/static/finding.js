"use strict";
// What a verdict leaves to do: doubts and advice, the recovered law, what to measure next.
const drawPicture = (picture, alt) => (picture ? [make("figure", {}, make("img", { src: "data:image/png;base64," + picture, alt }))] : []);

function drawDoubts(verdict) {
  const lines = verdict ? [...(verdict.doubts || []).map((text) => "Doubt: " + text), ...(verdict.advice ? ["Next: " + verdict.advice + "."] : [])] : [];
  byId("doubts").replaceChildren(...lines.map((text) => make("p", { className: "sub", text })));
}

function beginLaw(law) {
  byId("law").hidden = !law;
  if (!law) return;
  const button = make("button", { text: "Edit and save it as an effect" });
  button.onclick = () => editOwn(law.file, law.text);
  byId("law").replaceChildren(make("h2", { text: "The missing law, recovered" }), ...law.sentences.map((text) => make("p", { className: "sub", text })), ...drawPicture(law.picture, "Force against displacement and velocity, with its bands"),
    make("details", {}, make("summary", { text: "as an effect of your own" }), make("pre", { textContent: law.text, tabIndex: 0 })), button);
}

function beginNextTest(next) {
  byId("next").hidden = !next;
  if (!next) return;
  const rows = next.rows.map((row) => [row.title, digits(100 * row.probability) + " %", Math.round(row.minutes) + " min"]);
  byId("next").replaceChildren(make("h2", { text: "What to measure next" }), make("p", { text: next.sentence }),
    ...(rows.length ? [make("p", { className: "sub", text: "Probability that a test separates " + next.between.join(" and ") + ", and its approximate time." }), drawTable({ head: ["test", "decides", "takes"], rows, words: 1 })] : []),
    ...(next.remark ? [make("p", { className: "sub", text: next.remark[0].toUpperCase() + next.remark.slice(1) + "." })] : []), ...drawPicture(next.picture, "What each explanation predicts for the advised test"));
}
