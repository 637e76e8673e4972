/** The structure of the system: arcs on which something fresh went; a part chooses its machine. */

import { Diagram } from "./diagram.js";
import { byId } from "./dom.js";
import { on, page } from "./state.js";

const diagram = new Diagram(byId("parts"));
let lit = [];

/** Machine -> its box, which may be that of several copies. */
let boxes = new Map();

async function draw() {
  lit = [];
  boxes = new Map();
  if (!(await diagram.show(page.hello.structure)) || !diagram.svg) {
    return;
  }
  diagram.svg.setAttribute("role", "group");
  diagram.svg.setAttribute("aria-label", "Structure");
  const { parts = {}, machines } = page.hello;
  for (const machine of machines) {
    const [element] = parts[machine.name] ? diagram.find(parts[machine.name]) : [];
    if (element) {
      boxes.set(machine.name, element);
      prepare(element, machine);
    }
  }
  mark();
  light();
}

function prepare(element, machine) {
  if (element.classList.contains("choice")) {
    return; // a copy, of which the box chooses the first
  }
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

function mark() {
  const chosen = boxes.get(page.machine);
  for (const element of boxes.values()) {
    element.classList.toggle("chosen", element === chosen);
    element.setAttribute("aria-pressed", String(element === chosen));
  }
  diagram.centre(chosen);
}

function light() {
  if (!diagram.svg) {
    return;
  }
  const fresh = (page.shown.flow ?? []).flatMap((id) => diagram.find(id));
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
