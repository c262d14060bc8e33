"use strict";

// One of several tables or charts is seen at a time: those marked with what the pressed button stands for.
for (const group of document.querySelectorAll("[data-switch]")) {
  const key = group.dataset.switch;
  const show = (chosen) => {
    for (const button of group.querySelectorAll("button"))
      button.setAttribute("aria-pressed", button.value === chosen);
    for (const part of document.querySelectorAll(`[data-${key}]`))
      part.hidden = part.dataset[key] !== chosen;
  };
  group.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (button) show(button.value);
  });
  const pressed = group.querySelector("[aria-pressed=true]") ?? group.querySelector("button");
  if (pressed) show(pressed.value);
}

// A click on a column's head sorts by it, a second one the other way round; what has no value comes last.
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => head.addEventListener("click", () => {
    const direction = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", direction === 1 ? "ascending" : "descending");
    const value = (row) => {
      const cell = row.cells[column];
      return cell.dataset.value === undefined ? cell.textContent : parseFloat(cell.dataset.value);
    };
    const order = (a, b) => {
      const [x, y] = [value(a), value(b)];
      if (typeof x === "string") return direction * x.localeCompare(y);
      return Number.isNaN(x) - Number.isNaN(y) || direction * (x - y);
    };
    const body = table.tBodies[0];
    body.append(...[...body.rows].sort(order));
  }));
}

// A click on a picture shows it as large as the window.
const enlarged = document.getElementById("enlarged");
document.addEventListener("click", (event) => {
  const picture = event.target.closest(".pair img");
  if (picture) {
    enlarged.querySelector("img").src = picture.src;
    enlarged.querySelector("p").textContent = picture.alt;
    enlarged.showModal();
  } else if (event.target.closest("dialog")) {
    enlarged.close();
  }
});
