"use strict";
// Tells the interactive views, in frames, whether the page is light or dark: at first, and when the reader changes it.

function tell(frame) {
  const asked = document.body.dataset.theme, system = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  frame.postMessage({theme: ["light", "dark"].includes(asked) ? asked : system}, "*");
}

window.addEventListener("message", (event) => {
  if (event.data?.scene === "ready") tell(event.source);
});
document.addEventListener("DOMContentLoaded", () => {
  const all = () => document.querySelectorAll("iframe.scene").forEach((frame) => tell(frame.contentWindow));
  new MutationObserver(all).observe(document.body, {attributeFilter: ["data-theme"]});
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", all);
});
