// Numbers by size, words by the alphabet; what has no value stays at the end.
function compared(one, other, way) {
  if (one === undefined || other === undefined) return (one === undefined) - (other === undefined);
  return way * (Number(one) - Number(other) || one.localeCompare(other, undefined, { numeric: true }));
}

// Up first, then down; what is equal keeps its order.
function sortBy(head) {
  const way = head.ariaSort === "ascending" ? -1 : 1, body = head.closest("table").tBodies[0];
  for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
  const value = (line) => line.cells[head.cellIndex].dataset.value;
  body.append(...[...body.rows].sort((one, other) => compared(value(one), value(other), way)));
}

document.querySelectorAll("#estimates th button").forEach((button) =>
  button.addEventListener("click", () => sortBy(button.closest("th"))));
