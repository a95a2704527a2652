"use strict";
// Files come in by dropping them anywhere on the page, or by choosing one; the server's answer is the job's number.

async function post(address, body) {
  const answer = await fetch(address, {method: "POST", body}), said = await answer.text();
  if (answer.ok) window.trame.state.set("shown", Number(said));
  return answer.ok ? "" : said;
}

// Sends the form of a problem; what the server says against it is shown in the form.
async function solve(number, form) {
  form.querySelector("[role=alert]").textContent = await post(`solve/${number}`, new URLSearchParams(new FormData(form)));
}

// A face clicked in the report's picture is chosen in the form, or no longer.
window.addEventListener("message", (event) => {
  const box = document.querySelector(`form input[name="face ${event.data?.face}"]`);
  if (event.origin !== location.origin || !box) return;
  box.closest("details").open = true;
  box.click();
});

document.querySelector("meta[name=viewport]").content = "width=device-width, initial-scale=1";  // zooming is allowed
window.paper = matchMedia("(prefers-color-scheme: dark)").matches ? [0.08, 0.1, 0.12] : [1, 1, 1];

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
