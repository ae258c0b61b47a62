"use strict";
// Data without steady states: the sections of `stickslip compare` with their tables and pictures.
let sections = null;

function beginData(data) {
  sections = data;
  drawSections(data);
}

function drawSections(listed) {
  byId("data").replaceChildren(...(listed || []).map(({ title, text, table, pictures }) => make("section", {},
    make("h2", { text: title }), ...(text ? [make("p", { className: "sub", text })] : []), ...(table ? [drawTable(table)] : []),
    ...pictures.map(([caption, picture]) => make("figure", {}, make("img", { src: "data:image/png;base64," + picture, alt: caption }), make("figcaption", { className: "sub", text: caption }))))));
}

function drawTable({ head, rows, words }) {
  const cell = (kind, text, column) => make(kind, { text, className: column < words ? "word" : "" });
  return make("div", { className: "scroll", tabIndex: 0 }, make("table", {}, make("thead", {}, make("tr", {}, ...head.map((text, column) => cell("th", text, column)))), make("tbody", {}, ...rows.map((row) => make("tr", {}, ...row.map((text, column) => cell("td", text, column)))))));
}
