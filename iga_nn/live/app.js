"use strict";
// Files come in by dropping them anywhere on the page, or by choosing one; the server's answer is the job's number.

async function post(address, body) {
  const answer = await fetch(address, {method: "POST", body});
  if (answer.ok) window.trame.state.set("shown", Number(await answer.text()));
}

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
