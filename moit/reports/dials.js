"use strict";

// A click on a technique, in a legend, a table or a chart, shows its curves everywhere.
{
  let chosen = null;
  document.addEventListener("click", (event) => {
    const marked = event.target.closest("[data-key]");
    if (!marked) return;
    chosen = chosen === marked.dataset.key ? null : marked.dataset.key;
    for (const one of document.querySelectorAll("[data-key]"))
      one.classList.toggle("chosen", one.dataset.key === chosen);
    for (const chart of document.querySelectorAll(".plots svg"))
      chart.classList.toggle("some-chosen", chosen !== null);
  });
}
