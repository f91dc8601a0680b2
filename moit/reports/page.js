"use strict";
document.documentElement.classList.add("js"); // what does nothing without a script is hidden till now

// Tables: a click on a heading sorts by that column, numbers as numbers, empty fields last.
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0];
  const given = [...body.rows];
  table.tHead.addEventListener("click", (event) => {
    const head = event.target.closest("th");
    if (!head) return;
    const before = head.getAttribute("aria-sort");
    const order = before === "ascending" ? "descending" : before === "descending" ? null : "ascending";
    for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
    let rows = given;
    if (order) {
      head.setAttribute("aria-sort", order);
      const sign = order === "ascending" ? 1 : -1;
      rows = [...given].sort((a, b) => {
        const x = a.cells[head.cellIndex].dataset.value, y = b.cells[head.cellIndex].dataset.value;
        if (x === "" || y === "") return (x === "") - (y === "");
        const number = Number(x.replace("inf", "Infinity")) - Number(y.replace("inf", "Infinity"));
        return sign * (Number.isNaN(number) ? x.localeCompare(y) : number);
      });
    }
    body.classList.toggle("sorted", Boolean(order));
    body.append(...rows);
  });
}

// Scenes: one technique is chosen; the view, the gallery, the curves and the points follow it.
for (const scene of document.querySelectorAll(".of-scene")) {
  const view = scene.querySelector(".view");
  if (!view) continue;
  const cards = [...scene.querySelectorAll(".card")];
  const reference = view.querySelector(".reference");
  const front = view.querySelector(".front");
  const seam = view.querySelector(".seam");
  const [tag, rightTag] = view.querySelectorAll(".tag");
  const buttons = [...scene.querySelectorAll(".controls button")];
  let chosen = cards.find((card) => card.dataset.first !== undefined) || cards[0];
  let mode = "technique";
  let shown = true; // the front image, in the modes that alternate
  let split = 0.5;
  let timer = 0;

  function draw() {
    const [image, map] = chosen.querySelectorAll("img");
    const name = chosen.dataset.name;
    front.src = (mode === "map" ? map : image).src;
    front.hidden = mode === "reference" || !shown;
    front.style.clipPath = mode === "split" ? `inset(0 0 0 ${100 * split}%)` : "";
    seam.hidden = mode !== "split";
    seam.style.left = `${100 * split}%`;
    tag.textContent = front.hidden || mode === "split" ? "reference"
      : mode === "map" ? `error of ${name}` : name;
    rightTag.hidden = mode !== "split";
    rightTag.textContent = name;
    for (const button of buttons) button.setAttribute("aria-pressed", button.dataset.mode === mode);
  }

  // marks: whether its curve and points stand out, too.
  function choose(card, marks) {
    chosen = card;
    if (mode === "reference") mode = "technique";
    for (const one of cards) one.classList.toggle("chosen", one === card);
    for (const one of scene.querySelectorAll("[data-key]"))
      one.classList.toggle("chosen", marks && one.dataset.key === card.dataset.key);
    card.classList.add("chosen");
    for (const chart of scene.querySelectorAll(".plots svg"))
      chart.classList.toggle("some-chosen", marks);
    draw();
  }

  function enter(next) {
    mode = next;
    shown = true;
    clearInterval(timer);
    if (mode === "flicker") timer = setInterval(() => { shown = !shown; draw(); }, 600);
    draw();
  }

  for (const button of buttons) button.addEventListener("click", () => enter(button.dataset.mode));
  view.addEventListener("pointermove", (event) => {
    if (mode !== "split") return;
    const box = view.getBoundingClientRect();
    split = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    draw();
  });
  view.addEventListener("click", () => {
    if (mode === "split" || mode === "flicker") return;
    if (mode === "reference") return enter("technique");
    shown = !shown;
    draw();
  });
  for (const card of cards) {
    card.tabIndex = 0;
    card.setAttribute("role", "button");
    card.addEventListener("click", () => choose(card, true));
    card.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      const to = step && cards[cards.indexOf(card) + step];
      if (to) { to.focus(); choose(to, true); }
      else if (event.key === "Enter" || event.key === " ") choose(card, true);
      else return;
      event.preventDefault();
    });
  }
  for (const mark of scene.querySelectorAll(".point, .series, .legend > [data-key]"))
    mark.addEventListener("click", () => {
      const card = cards.find((one) => one.dataset.key === mark.dataset.key);
      if (card) choose(card, true);
    });
  if (chosen) choose(chosen, false);
}

// Names in legends are pressed by keys, too.
for (const name of document.querySelectorAll(".legend > [data-key]")) {
  name.tabIndex = 0;
  name.setAttribute("role", "button");
  name.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    name.click();
    event.preventDefault();
  });
}
