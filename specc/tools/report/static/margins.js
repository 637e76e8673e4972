/** The margins of requirements over time, below their verdicts. */

import { MARGIN, run } from "./answers.js";
import { byId, html } from "./dom.js";
import { plots } from "./plot.js";
import { on, page } from "./state.js";

let boxes = [];

function build() {
  const rows = byId("verdict-list").children;
  boxes = run.margins.map(({ lines: [line] }, place) => {
    const box = html("div", { class: "margins", "aria-label": "Margin over time" });
    if (line.filter((value) => value !== null).length > 1) {
      rows[place].append(box);
    }
    return box;
  });
  draw();
}

function draw() {
  boxes.forEach((box, place) => {
    if (box.clientWidth > 100) {
      const pictures = plots(MARGIN, run.margins[place], page.time_s, box.clientWidth);
      box.replaceChildren(...pictures);
    }
  });
}

on("hello", build);
on("cursor now", draw);
new ResizeObserver(draw).observe(byId("verdict-list"));
