"use strict";
const CLICK = 4;  // pixels that the pointer may move while a face is clicked

// Files come in by dropping them anywhere on the page, or by choosing one; the server's answer is the job's number.
// What this tab keeps for itself, the job it shows and what was typed, is in its session storage: it outlives a reload.

const kept = (name) => `${window.trame.state.get("page")} ${name}`;  // another server counts its jobs anew

function choose(number) {
  sessionStorage.setItem(kept("shown"), number);
  window.trame.state.set("shown", number);
}

async function post(address, body) {
  try {
    const answer = await fetch(address, {method: "POST", body}), said = await answer.text();
    if (answer.ok) choose(Number(said));
    return answer.ok ? "" : said;
  } catch {
    return "The page's program does not answer.";
  }
}

// Starts a job with the problem that its form states, where it has one.
async function start(number) {
  const form = document.querySelector("form");
  const wrong = await post(`start/${number}`, form ? statedBy(form) : new URLSearchParams());
  if (!wrong) sessionStorage.removeItem(kept(`form ${number}`));  // the job has it now
  if (!form) return;
  form.querySelector("[role=alert]").textContent = wrong;
  if (wrong) form.closest("details").open = true;
}

// Where the pointer went down: a face is clicked where it has hardly moved since.
let down = [0, 0], moved = 0;
document.addEventListener("pointerdown", (event) => { [down, moved] = [[event.clientX, event.clientY], 0]; }, true);
document.addEventListener("pointermove", (event) => {
  moved = Math.max(moved, Math.hypot(event.clientX - down[0], event.clientY - down[1]));
}, true);

// A face of the part that is clicked is named by the server; its region goes into the list that was chosen last.
let aimed = null;
function aim(list) {
  aimed = list;
}

async function pick(number, hit) {
  if (!hit?.ray || moved > CLICK) return;
  const sight = {method: "POST", body: JSON.stringify(hit.ray)};
  const found = await fetch(`face/${number}`, sight).then((answer) => answer.ok ? answer.json() : null, () => null);
  if (!found) return;
  window.trame.state.set("picked", {...found, job: number});
  enter(found.region);
}

// Writes a region into the list of the chosen problem that was chosen last; what is typed next are its data.
let entered = null;  // the list of the last entry, and its text before and after
function enter(region) {
  const form = document.querySelector("form"), lists = form?.querySelectorAll(`.${form.elements.problem.value} textarea`) ?? [];
  const list = [...lists].find((one) => one === aimed) ?? lists[0];
  if (list) enterIn(list, region);
}

function enterIn(list, entry) {
  const before = list.value.trimEnd(), after = list.dataset.after, old = list.value;
  list.value = `${before}${before && "\n"}${entry}${after}`;
  entered = {list, old, now: list.value};
  list.dispatchEvent(new Event("input", {bubbles: true}));
  for (let part = list.closest("details"); part; part = part.parentElement.closest("details")) part.open = true;
  list.focus({preventScroll: true});
  list.setSelectionRange(list.value.length - after.length + after.startsWith("="), list.value.length);
}

// Offers what the picked face may be: the lists and the asks of the chosen problem.
function offer(select) {
  const form = document.querySelector("form"), problems = window.trame.state.get("problems");
  const {lists, more, asks} = problems.find((one) => one.name === form.elements.problem.value);
  const option = (value, text, title = "") => Object.assign(document.createElement("option"), {value, text, title});
  const entries = [...lists, ...more].map((field) => option(field.name, field.short, field.title));
  select.replaceChildren(select.options[0], ...entries, ...asks.map((words) => option(`ask ${words}`, `ask: ${words} it`)));
}

// Gives the picked face a support, a load or an ask, in place of what the click entered.
function give(select) {
  const form = document.querySelector("form"), region = window.trame.state.get("picked")?.region, value = select.value;
  select.value = "";
  if (!value || !form || !region) return;
  if (entered && entered.list.value === entered.now) entered.list.value = entered.old;
  const words = value.startsWith("ask ") ? value.slice(4) : "";
  if (words) enterIn(form.elements.ask, `${words} ${region}`);
  else enterIn(form.querySelector(`.${form.elements.problem.value} [name=${value}]`), region);
}

// What a form states of its chosen problem; fields of the other ones may have the same names.
function statedBy(form) {
  const found = new FormData(form), chosen = form.elements.problem.value;
  for (const field of form.elements) {
    const of = field.closest(".of");
    if (of?.classList.contains(chosen) && ["textarea", "text"].includes(field.type)) found.set(field.name, field.value);
  }
  return new URLSearchParams(found);
}

// Sends the form of a problem; what the server says against it is shown in the form.
async function solve(number, form) {
  form.querySelector("[role=alert]").textContent = await post(`solve/${number}`, statedBy(form));
}

function draft(number, form) {
  sessionStorage.setItem(kept(`form ${number}`), statedBy(form));
}

// Fills a form with what was typed into it before, else with the problem that the job has solved.
function fill(number, form, given) {
  const typed = sessionStorage.getItem(kept(`form ${number}`));
  const values = new URLSearchParams(typed ?? given);
  for (const field of form.elements)
    if (field.type === "checkbox") field.checked = values.has(field.name);
    else if (field.type === "radio") field.checked = field.value === (values.get(field.name) ?? "poisson");
    else if (values.has(field.name)) field.value = values.get(field.name);
  if (typed !== null) form.closest("details").open = true;
}

// A face clicked in the report's picture is chosen in the form, or no longer; of an elastic body it is a region.
window.addEventListener("message", (event) => {
  const box = document.querySelector(`form input[name="face ${event.data?.face}"]`);
  if (event.origin !== location.origin || !box) return;
  box.closest("details").open = true;
  if (box.form.elements.problem.value === "poisson") box.click();
  else enter(event.data.face);
});

document.querySelector("meta[name=viewport]").content = "width=device-width, initial-scale=1";  // zooming is allowed

// A file over the limit is only announced, so that the server says the same as of any other refused one.
function upload(file) {
  const limit = Number(document.getElementById("file").dataset.limit) * 2 ** 20;
  post(`upload?name=${encodeURIComponent(file.name)}&size=${file.size}`, file.size > limit ? null : file);
}

document.addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("over");
});
document.addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) document.body.classList.remove("over");
});
document.addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("over");
  for (const file of event.dataTransfer.files) upload(file);
});
document.addEventListener("change", (event) => {
  if (event.target.id !== "file") return;
  for (const file of event.target.files) upload(file);
  event.target.value = "";
});

// A frame as high as what it shows, so that there is one scroll bar; its width changes with the window's.
function fit(frame) {
  const grow = () => { frame.style.height = `${frame.contentDocument.documentElement.offsetHeight + 4}px`; };
  frame.contentWindow.addEventListener("resize", grow);
  grow();
}

// The page is drawn once `paper`, the colour behind its pictures, is known: see app.html.
const dark = matchMedia("(prefers-color-scheme: dark)");
const paint = () => window.trame.state.set("paper", dark.matches ? [0.08, 0.1, 0.12] : [1, 1, 1]);
dark.addEventListener("change", paint);
window.Vue.nextTick(() => {  // this script runs while Vue still draws, and does not yet follow the state
  const canvas = document.createElement("canvas");
  window.trame.state.set("webgl", Boolean(canvas.getContext("webgl2") ?? canvas.getContext("webgl")));
  window.trame.state.set("shown", Number(sessionStorage.getItem(kept("shown"))));
  paint();
});
