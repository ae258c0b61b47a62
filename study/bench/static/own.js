"use strict";
// Effects of the user's own: their source is edited here, tried by the worker, and saved beside the case.
let own = null, opened = null;
// What was typed and is not saved yet, by the name of the file (a new file has none); and what was sent to be saved.
const drafts = {};
let sent = null;
const NEW = "", KEEP = "own_effect.py";

function beginOwn(data) {
  own = data;
  for (const { name, text, hash } of own.files) {
    if (sent && sent.file === name && sent.text === text) {
      // It is saved; what was typed since stays.
      if (opened.name === NEW && drafts[NEW] !== text) drafts[name] = drafts[NEW];
      if (opened.name === NEW) delete drafts[NEW];
      opened = { name, hash };
      sent = null;
    }
    if (drafts[name] === text) delete drafts[name];
  }
  const first = own.files.some((file) => opened && file.name === opened.name) ? opened.name : opened ? NEW : own.files.length ? own.files[0].name : NEW;
  byId("own-file").replaceChildren(...own.files.map(({ name }) => make("option", { value: name, textContent: name })), make("option", { value: NEW, text: "a new one" }));
  openOwn(first);
}

function openOwn(name) {
  const file = own.files.find((each) => each.name === name);
  // A draft is of the file as it was when it was opened.
  opened = { name, hash: opened && opened.name === name && name in drafts ? opened.hash : file ? file.hash : "" };
  byId("own-file").value = name;
  byId("own-name").value = file ? name : freeName();
  byId("own-name").readOnly = Boolean(file);
  byId("own-text").value = drafts[name] ?? (file ? file.text : own.template);
}

function freeName() {
  const names = own.files.map((file) => file.name);
  return names.includes(KEEP) ? KEEP.replace(".py", "_" + (names.length + 1) + ".py") : KEEP;
}

// Source from elsewhere, such as a recovered law, in the editor.
function editOwn(name, text) {
  const isThere = own.files.some((file) => file.name === name);
  drafts[isThere ? name : NEW] = text;
  openOwn(isThere ? name : NEW);
  byId("own-name").value = name;
  showOwn();
}

function showOwn() {
  byId("own").open = true;
  byId("own-text").focus({ preventScroll: true });
  byId("own").scrollIntoView({ block: "nearest" });
}

async function saveOwn() {
  const file = byId("own-name").value.trim(), text = byId("own-text").value;
  drafts[opened.name] = text;
  sent = { file, text };
  await call("save_effect", { file, text, before: opened.hash });
}

// The last answer to Save, and the line that it is about.
let told = "";
function tellOwn() {
  const failed = state.message && state.message.tone === "error" && state.message.of === "save_effect";
  const saves = (state.log || []).filter((entry) => entry.name === "save_effect"), saved = saves.at(-1);
  const words = failed ? state.message.text : saved ? "Saved. " + Object.entries(saved.numbers).map(([name, value]) => name[0].toUpperCase() + name.slice(1) + ": " + value).join("; ") + "." : "";
  const sign = words + saves.length;
  byId("own-save").disabled = isBusy() || !own;
  if (sign === told) return;
  told = sign;
  byId("own-note").textContent = words;
  byId("own-note").className = failed ? "error" : "";
  const line = failed && words.match(/line (\d+)/);
  if (line) goToLine(Number(line[1]));
}

function goToLine(number) {
  const field = byId("own-text"), lines = field.value.split("\n"), start = lines.slice(0, number - 1).join("\n").length + (number > 1 ? 1 : 0);
  field.focus({ preventScroll: true });
  field.setSelectionRange(start, start + (lines[number - 1] || "").length);
  field.scrollTop = Math.max(0, (number - 4) * (field.scrollHeight / lines.length));
}

byId("own-file").onchange = () => openOwn(byId("own-file").value);
byId("own-text").oninput = () => { drafts[opened.name] = byId("own-text").value; };
byId("own-save").onclick = saveOwn;
byId("write-own").onclick = showOwn;
