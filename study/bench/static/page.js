"use strict";
// The page asks for the state again and again, fetches the parts that are new, and sends clicks.
let state = { revision: -1, versions: {} }, seen = "", fetching = 0;
const versions = {};
const WORDS = { compare: "Comparing", screen: "Screening the effects", diagnose: "Diagnosing", add: "Adding", undo: "Taking back", calibrate: "Calibrating", save_effect: "Trying the effect", move: "Computing the exact curve", limits: "Searching for the limits of all friction histories" };

// Whether something runs or waits that must end before the case may be written.
const isBusy = () => [state.busy && state.busy.name, ...(state.waiting || [])].some((name) => name && name !== "move");

async function call(name, args = {}) {
  const writes = ["add", "undo", "calibrate", "save_effect"].includes(name);
  try {
    const answer = await fetch("call", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ name, arguments: writes ? { ...args, seen } : args }) });
    if (answer.ok) await take(await answer.json()); else tell("error", await answer.text());
  } catch { tell("error", "The server does not answer; nothing is lost. Start stickslip bench again."); }
}

const TAKE = {
  verdict: drawVerdict, responses: beginResponses, map: beginMap, parameters: beginParameters, structure: beginStructure, history: drawHistory,
  candidates: beginEffects, errors: beginErrors, fitted: (data) => { fitted = data; drawParameters(); }, moved: takeMoved, limits: beginLimits, data: beginData, law: beginLaw, next_test: beginNextTest, own: beginOwn,
};

async function take(next) {
  if (next.revision < state.revision) return;
  state = next;
  drawState();
  for (const [name, version] of Object.entries(state.versions)) {
    if (versions[name] === version || !TAKE[name]) continue;
    versions[name] = version;
    fetching += 1;
    try {
      const answer = await fetch("view/" + name);
      if (answer.ok) TAKE[name](await answer.json());
    } finally { fetching -= 1; }
  }
  drawState();
}

function drawState() {
  const busy = state.busy;
  byId("working").hidden = !busy;
  if (busy) {
    const steps = state.steps.map((step) => step.name + (step.share ? " " + Math.round(100 * step.share) + " %" : "")).join(" › ");
    byId("doing").textContent = WORDS[busy.name] + (steps ? ": " + steps : "") + ", " + Math.round(busy.seconds) + " s" + (state.is_last ? ". Below: as it was last time" : "");
    const share = state.steps.length ? state.steps[0].share : null;
    if (share === null || share === undefined) byId("progress").removeAttribute("value"); else byId("progress").value = share;
  }
  const occupied = isBusy();
  byId("calibrate").disabled = byId("diagnose").disabled = byId("limits").disabled = occupied || !versions.candidates;
  byId("undo").disabled = occupied || !byId("undo").dataset.possible;
  document.querySelectorAll("button.add, #history button").forEach((button) => { button.disabled = occupied; });
  if (state.message && state.message.tone === "error" && !versions.verdict) byId("tag").textContent = "There is no comparison: the message above says why.";
  if (state.message) tell(state.message.tone, state.message.text); else byId("message").hidden = true;
  drawLog(state.log);
  tellOwn();
}

function tell(tone, text) {
  byId("message").hidden = false;
  byId("message").className = tone;
  if (byId("message").textContent !== text) byId("message").textContent = text;
}

function drawVerdict(data) {
  seen = data.seen;
  document.body.classList.toggle("is-alone", Boolean(data.is_alone));
  document.title = data.title + " – stickslip bench";
  byId("title").textContent = data.title;
  byId("campaign").textContent = data.campaign === data.title ? state.case + " beside " + state.campaign : data.campaign;
  byId("verdict").className = data.tone;
  byId("tag").textContent = data.tag;
  byId("cards").replaceChildren(...data.cards.map(([name, value]) => make("div", {}, make("b", { text: value }), " ", typeset(name))));
  byId("sentences").replaceChildren(...data.sentences.map((text) => make("p", { text })), ...data.suspicions.map((item) => make("p", { text: "Suspicious: " + item.where + ": " + item.sentence })));
  byId("more").hidden = false;
}

async function watch() {
  for (;;) {
    try {
      const answer = await fetch("state?seen=" + state.revision);
      if (answer.ok) await take(await answer.json());
      else { tell("error", await answer.text()); return; }
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;
      tell("error", "The server does not answer; nothing is lost: case, history and finished results are on the disk. Start stickslip bench again.");
      await new Promise((done) => setTimeout(done, 1000));
    }
  }
}

function drawAll() {
  if (responses) { fillLevels(); drawResponse(); }
  drawMap(); drawErrors(); drawStructure();
}

byId("panel").onchange = () => { shown.panel = Number(byId("panel").value); shown.frequency = shown.level = null; drawResponse(); };
byId("runs").onchange = byId("residual").onchange = drawResponse;
byId("configuration").onchange = drawMap;
byId("all").onclick = () => { showAll = !showAll; drawEffects(); };
byId("back").onclick = moveBack;
byId("mode").onchange = drawStructure;
byId("still").onclick = () => { const still = byId("still").getAttribute("aria-pressed") !== "true"; byId("still").setAttribute("aria-pressed", still); byId("still").textContent = still ? "Move" : "Stop"; move(); };
byId("diagnose").onclick = () => call("diagnose");
byId("calibrate").onclick = () => call("calibrate");
byId("limits").onclick = () => call("limits");
byId("undo").onclick = () => call("undo");
byId("cancel").onclick = () => call("cancel");
byId("theme").onclick = () => { document.documentElement.dataset.theme = isDark() ? "light" : "dark"; drawAll(); };
document.querySelectorAll("input[name=as]").forEach((box) => { box.onchange = () => drawLog(state.log); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
watch();
