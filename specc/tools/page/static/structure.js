/** The structure of the system: arcs lit on which something fresh went; a part chooses its machine. */

import { Diagram } from "./diagram.js";
import { byId } from "./dom.js";
import { on, page } from "./state.js";

const diagram = new Diagram(byId("parts"));
let lit = [];

/** The machine that a node stands for: its id ends with `n-` and the name. */
function machineOf(element) {
  const name = element.id.replace(/^.*?n-/, "");
  return page.hello.machines.find((machine) => machine.name === name);
}

async function draw() {
  lit = [];
  if (!(await diagram.show(page.hello.structure)) || !diagram.svg) {
    return;
  }
  diagram.svg.setAttribute("role", "group");
  diagram.svg.setAttribute("aria-label", "Structure");
  for (const element of diagram.svg.querySelectorAll(".node")) {
    const machine = machineOf(element);
    if (machine) {
      element.classList.add("choice");
      element.setAttribute("tabindex", 0);
      element.setAttribute("role", "button");
      element.setAttribute("aria-label", `show ${machine.name} ${machine.title}`);
      element.addEventListener("click", () => page.choose(machine.name));
      element.addEventListener("keydown", (event) => {
        if (event.key === "Enter") {
          page.choose(machine.name);
        }
      });
    }
  }
  mark();
  light();
}

function mark() {
  for (const element of diagram.svg?.querySelectorAll(".choice") ?? []) {
    const is_chosen = machineOf(element)?.name === page.machine;
    element.classList.toggle("chosen", is_chosen);
    element.setAttribute("aria-pressed", String(is_chosen));
  }
}

function light() {
  if (!diagram.svg) {
    return;
  }
  const fresh = (page.shown.flow ?? []).map((id) => diagram.find(id)).filter(Boolean);
  for (const element of lit) {
    element.classList.toggle("flow", fresh.includes(element));
  }
  for (const element of fresh) {
    element.classList.add("flow");
  }
  lit = fresh;
}

on("hello", draw);
on("machine", mark);
on("shown", light);
