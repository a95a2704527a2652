"use strict";
// Sorts the table by the column whose heading is clicked, the other way round at the second click; what is empty last.
const table = document.getElementById("surfaces");
const headings = [...table.tHead.rows[0].cells];
const rows = [...table.tBodies[0].rows];

function compare(a, b) {
  const [x, y] = [Number(a), Number(b)];
  return Number.isNaN(x) || Number.isNaN(y) ? a.localeCompare(b, undefined, { numeric: true }) : x - y;
}

function sortBy(heading) {
  const column = headings.indexOf(heading);
  const value = (row) => row.cells[column].dataset.value;
  const way = heading.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  rows.sort((a, b) => (value(a) === "") - (value(b) === "") || way * compare(value(a), value(b)));
  for (const other of headings) if (other.hasAttribute("aria-sort")) other.setAttribute("aria-sort", "none");
  heading.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
  table.tBodies[0].append(...rows);
}

for (const heading of headings) heading.querySelector("button")?.addEventListener("click", () => sortBy(heading));
