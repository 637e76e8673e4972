/** The chosen machine: its current state lit, the way into it, breakpoints on states and rows. */

import { toggleBreakpoint } from "./breakpoints.js";
import { Diagram } from "./diagram.js";
import { byId, html, setText, svg } from "./dom.js";
import { emit, on, page } from "./state.js";

const diagram = new Diagram(byId("states"));
const FLASH_MS = 900;

/** State or row of the machine that is drawn -> its element. */
let states = new Map();
let rows = new Map();
let last_row = "";

// Tabs.

function showTabs() {
  const tabs = page.hello.machines.map((machine) =>
    html(
      "button",
      {
        type: "button",
        role: "tab",
        id: `tab-${machine.name}`,
        title: machine.title || machine.name,
        "aria-controls": "states",
        onclick: () => page.choose(machine.name),
        onkeydown: (event) => moveTab(event, machine.name),
      },
      html("b", {}, machine.name),
      html("span", { class: "state" }),
    ),
  );
  byId("machines").replaceChildren(...tabs);
  markTab();
}

function moveTab(event, name) {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) {
    return;
  }
  event.preventDefault();
  event.stopPropagation();
  const names = page.hello.machines.map((machine) => machine.name);
  page.choose(names[(names.indexOf(name) + step + names.length) % names.length]);
  byId(`tab-${page.machine}`).focus();
}

function markTab() {
  for (const tab of byId("machines").children) {
    const is_chosen = tab.id === `tab-${page.machine}`;
    tab.setAttribute("aria-selected", String(is_chosen));
    tab.tabIndex = is_chosen ? 0 : -1;
    if (is_chosen) {
      const strip = byId("machines");
      const left = tab.offsetLeft - (strip.clientWidth - tab.offsetWidth) / 2;
      strip.scrollTo({ left, behavior: "instant" });
    }
  }
}

/** A state for readers: `S2 Execute position-force control`. */
export function stateWords(machine, name) {
  const state = machine?.states.find((one) => one.name === name);
  return state?.title && state.title !== name ? `${name} · ${state.title}` : name;
}

function showStatesInTabs() {
  for (const machine of page.hello.machines) {
    const standing = page.shown.states[machine.name];
    const tab = byId(`tab-${machine.name}`);
    setText(tab.lastChild, standing?.state ?? "");
    tab.title = [machine.title, standing && stateWords(machine, standing.state)]
      .filter(Boolean)
      .join("\n");
  }
}

// The picture.

async function draw() {
  const machine = page.chosen;
  states = new Map();
  rows = new Map();
  last_row = "";
  if (!(await diagram.show(machine?.svg ?? null)) || !machine) {
    return;
  }
  if (diagram.svg) {
    diagram.svg.setAttribute("role", "group");
    diagram.svg.setAttribute("aria-label", `States of ${machine.name}`);
    prepareStates(machine);
    prepareRows(machine);
  }
  showConditions();
  showMarks();
  light();
}

function prepareStates(machine) {
  for (const state of machine.states) {
    const element = diagram.find(state.id);
    if (element) {
      states.set(state.name, element);
      element.classList.add("state");
      element.classList.toggle("error", state.is_error);
      makeButton(element, 0, () => ({ kind: "state", machine: machine.name, state: state.name }));
      element.addEventListener("keydown", (event) => walk(event, state.name));
    }
  }
}

function prepareRows(machine) {
  const shared = new Map();
  for (const element of diagram.svg.querySelectorAll("[data-rows]")) {
    for (const number of element.getAttribute("data-rows").split(/\D+/)) {
      shared.set(Number(number), element);
    }
  }
  machine.rows.forEach((row, number) => {
    const element = diagram.find(row.id) ?? shared.get(number);
    if (!element) {
      return;
    }
    if (![...rows.values()].includes(element)) {
      for (const path of element.querySelectorAll("path")) {
        element.prepend(svg("path", { class: "reach", d: path.getAttribute("d") }));
      }
      makeButton(element, -1, () => ({ kind: "row", machine: machine.name, row: row.label }));
      element.addEventListener("keydown", (event) => walk(event, row.source, element));
    }
    element.classList.add("row");
    rows.set(row.label, element);
  });
}

/** Let a part of the picture set and remove a breakpoint. */
function makeButton(element, tabindex, breakpoint) {
  element.setAttribute("tabindex", tabindex);
  element.setAttribute("role", "button");
  element.addEventListener("click", () => toggleBreakpoint(breakpoint()));
  element.addEventListener("keydown", (event) => {
    if (event.key === "Enter") {
      event.preventDefault();
      toggleBreakpoint(breakpoint());
    }
  });
}

/** From a state, the arrow keys go through the rows that leave it; Escape goes back. */
function walk(event, source, element = null) {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (event.key === "Escape" && element) {
    states.get(source)?.focus();
  } else if (step) {
    const leaving = page.chosen.rows.filter((row) => row.source === source);
    const own = [...new Set(leaving.map((row) => rows.get(row.label)).filter(Boolean))];
    own[(own.indexOf(element) + step + own.length) % own.length]?.focus();
    event.preventDefault();
  } else {
    return;
  }
  event.stopPropagation();
}

function showConditions() {
  const details = byId("conditions");
  const notes = diagram.notes.filter((cells) => cells.length > 0);
  details.hidden = notes.length === 0;
  details.querySelector("dl").replaceChildren(
    ...notes.flatMap(([name, ...text]) => {
      const begins = name.trim() !== "";
      return begins && text.length
        ? [html("dt", {}, name), html("dd", {}, text.join(" "))]
        : [html("dd", {}, [name, ...text].join(" "))];
    }),
  );
}

// What is lit.

function light() {
  const machine = page.chosen;
  const standing = page.shown.states[page.machine];
  if (!machine || !standing || !states.size) {
    return;
  }
  const modes = machine.states.find((state) => state.name === standing.state)?.modes ?? [];
  for (const [name, element] of states) {
    const is_lit = name === standing.state;
    element.classList.toggle("lit", is_lit);
    describe(element, `state ${stateWords(machine, name)}`, is_lit ? "current" : "");
    if (is_lit) {
      element.setAttribute("aria-current", "true");
      diagram.centre(element);
    } else {
      element.removeAttribute("aria-current");
    }
  }
  for (const frame of diagram.svg.querySelectorAll(".mode")) {
    frame.classList.toggle("lit", modes.some((mode) => frame.id.endsWith(`m-${mode}`)));
  }
  lightRow(standing);
}

function lightRow(standing) {
  const element = rows.get(standing.row);
  for (const [label, other] of rows) {
    other.classList.toggle("lit", other === element);
    describe(other, `row ${label}`, other === element ? "taken last" : "");
  }
  const key = `${standing.since_s} ${standing.row}`;
  if (last_row && key !== last_row && element && page.cursor === null) {
    element.classList.add("flash");
    setTimeout(() => element.classList.remove("flash"), FLASH_MS);
  }
  last_row = key;
}

function describe(element, name, more) {
  const is_break = element.classList.contains("breakpoint");
  const words = [name, more, is_break ? "breakpoint" : ""].filter(Boolean).join(", ");
  if (element.getAttribute("aria-label") !== words) {
    element.setAttribute("aria-label", words);
    element.setAttribute("aria-pressed", String(is_break));
  }
}

// Marks of breakpoints.

function showMarks() {
  for (const mark of diagram.svg?.querySelectorAll(".stop") ?? []) {
    mark.remove();
  }
  const own = page.breakpoints.filter((one) => one.machine === page.machine);
  const stops = new Set();
  for (const one of own) {
    stops.add(one.kind === "state" ? states.get(one.state) : rows.get(one.row));
  }
  for (const element of [...states.values(), ...rows.values()]) {
    element.classList.toggle("breakpoint", stops.has(element));
  }
  for (const element of stops) {
    element?.append(svg("circle", { class: "stop", r: 4.5, ...placeOfMark(element) }));
  }
}

/** The corner of a box, or the middle of an arc. */
function placeOfMark(element) {
  const path = element.querySelector("path");
  if (element.classList.contains("row") && path) {
    const { x, y } = path.getPointAtLength(path.getTotalLength() / 2);
    return { cx: x, cy: y };
  }
  const { x, y, width } = (path ?? element).getBBox();
  return { cx: x + width - 3, cy: y + 3 };
}

on("hello", () => {
  showTabs();
  draw();
});
on("machine", () => {
  markTab();
  draw();
});
on("shown", () => {
  showStatesInTabs();
  light();
});
on("breakpoints", () => {
  showMarks();
  light();
});
on("machine", () => emit("shown"));
