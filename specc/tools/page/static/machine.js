/** The chosen machine: its current state lit, the way into it, breakpoints on states and rows. */

import { toggleBreakpoints } from "./breakpoints.js";
import { Diagram } from "./diagram.js";
import { byId, hover, html, setText, svg } from "./dom.js";
import { emit, on, page, stateWords } from "./state.js";

const diagram = new Diagram(byId("states"));
const FLASH_MS = 900;
const MOST_ROWS = 4;
/** Of one arc that are listed. */

/** State of the machine that is drawn -> its element; row -> its arc, and what is beside it. */
let states = new Map();
let rows = new Map();
/** Arc, or what is beside it -> labels of its rows. */
let arcs = new Map();
let last_row = "";
const NOWHERE = { state: null, since_s: null, row: "" };

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
  arcs = new Map();
  last_row = "";
  if (!(await diagram.show(machine?.svg ?? null)) || !machine) {
    return;
  }
  const picture = diagram.svg ?? listOfStates(machine);
  picture.setAttribute("role", "group");
  picture.setAttribute("aria-label", `States of ${machine.name}`);
  if (diagram.svg) {
    for (const state of machine.states) {
      const [element] = diagram.find(state.id);
      if (element) {
        prepareState(machine, state, element);
      }
    }
    prepareRows(machine);
  }
  showMarks();
  light();
}

/** Where there is no picture, e.g. of hundreds of states. */
function listOfStates(machine) {
  const list = html("div", { class: "state-list" });
  for (const state of machine.states) {
    const element = html("div", { class: "state" }, stateWords(machine, state.name));
    prepareState(machine, state, element);
    list.append(element);
  }
  byId("states").append(list);
  return list;
}

function prepareState(machine, state, element) {
  states.set(state.name, element);
  element.classList.toggle("error", state.is_error);
  makeButton(element, 0, () => [{ kind: "state", machine: machine.name, state: state.name }]);
  explain(element, () => `${stateWords(machine, state.name)}\n${state.place}`);
  element.addEventListener("keydown", (event) => walk(event, state.name));
}

/** An arc and what is beside it may stand for several rows. */
function prepareRows(machine) {
  for (const [id, own] of Map.groupBy(machine.rows, (row) => row.id)) {
    const elements = diagram.find(id);
    for (const element of elements) {
      for (const path of element.matches(".edge") ? element.querySelectorAll("path") : []) {
        element.prepend(svg("path", { class: "reach", d: path.getAttribute("d") }));
      }
      element.classList.add("row");
      arcs.set(element, own.map((row) => row.label));
      const breakpoints = () =>
        own.map((row) => ({ kind: "row", machine: machine.name, row: row.label }));
      makeButton(element, -1, breakpoints);
      explain(element, () => wordsOfRows(own));
      element.addEventListener("keydown", (event) => walk(event, own[0].source, element));
    }
    for (const row of own) {
      rows.set(row.label, elements);
    }
  }
}

function wordsOfRows(own) {
  const labels = own.map((row) => row.label);
  const more = labels.length > MOST_ROWS ? `\nand ${labels.length - MOST_ROWS} more` : "";
  return `${labels.slice(0, MOST_ROWS).join("\n")}${more}\n${own[0].place}`;
}

function wordsOfArc(labels) {
  return labels.length > 1 ? `${labels.length} rows, ${labels[0]} first` : `row ${labels[0]}`;
}

function explain(element, words) {
  element.addEventListener("pointermove", (event) => {
    const is_set = element.classList.contains("breakpoint");
    const action = is_set ? "Click to remove the breakpoint" : "Click to stop here";
    hover(event, page.refusal("break") ? words() : `${words()}\n${action}`);
  });
  element.addEventListener("pointerleave", (event) => hover(event, ""));
}

/** Let a part of the picture set and remove breakpoints. */
function makeButton(element, tabindex, breakpoints) {
  element.setAttribute("tabindex", tabindex);
  element.setAttribute("role", "button");
  element.addEventListener("click", () => toggleBreakpoints(breakpoints()));
  element.addEventListener("keydown", (event) => {
    if (event.key === "Enter") {
      event.preventDefault();
      toggleBreakpoints(breakpoints());
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
    const own = [...new Set(leaving.map((row) => rows.get(row.label)?.[0]).filter(Boolean))];
    const first = step > 0 ? 0 : own.length - 1;
    const next = (own.indexOf(element) + step + own.length) % own.length;
    own[element ? next : first]?.focus();
    event.preventDefault();
  } else {
    return;
  }
  event.stopPropagation();
}

// What is lit.

function light() {
  const machine = page.chosen;
  const standing = page.shown.states[page.machine] ?? NOWHERE;
  if (!machine || !states.size) {
    return;
  }
  const around = machine.states.find((state) => state.name === standing.state)?.modes ?? [];
  for (const [name, element] of states) {
    const is_lit = name === standing.state;
    element.classList.toggle("lit", is_lit);
    element.setAttribute("aria-current", String(is_lit));
    describe(element, `state ${stateWords(machine, name)}`);
    if (is_lit) {
      diagram.centre(element);
    }
  }
  for (const { name, id } of machine.modes ?? []) {
    for (const frame of diagram.find(id)) {
      frame.classList.toggle("lit", around.includes(name));
    }
  }
  lightRow(standing);
}

function lightRow({ row, since_s }) {
  const taken = rows.get(row) ?? [];
  for (const [element, labels] of arcs) {
    const is_taken = taken.includes(element);
    element.classList.toggle("lit", is_taken);
    describe(element, is_taken ? `row ${row}` : wordsOfArc(labels));
  }
  const key = `${since_s} ${row}`;
  if (last_row && key !== last_row && page.cursor === null) {
    for (const element of taken) {
      element.classList.add("flash");
      setTimeout(() => element.classList.remove("flash"), FLASH_MS);
    }
  }
  last_row = key;
}

function describe(element, name) {
  const is_break = element.classList.contains("breakpoint");
  const is_taken = element.matches(".row.lit");
  const words = [name, is_taken && "taken last", is_break && "breakpoint"];
  const text = words.filter(Boolean).join(", ");
  if (element.getAttribute("aria-label") !== text) {
    element.setAttribute("aria-label", text);
    element.setAttribute("aria-pressed", String(is_break));
  }
}

// Marks of breakpoints.

function showMarks() {
  for (const mark of diagram.svg?.querySelectorAll(".stop") ?? []) {
    mark.remove();
  }
  const stops = new Set();
  for (const one of page.breakpoints) {
    if (one.machine === page.machine) {
      stops.add(one.kind === "state" ? states.get(one.state) : rows.get(one.row)?.[0]);
    }
  }
  const arcs = [...rows.values()].map(([element]) => element);
  for (const element of [...states.values(), ...arcs]) {
    element?.classList.toggle("breakpoint", stops.has(element));
  }
  for (const element of diagram.svg ? stops : []) {
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
new ResizeObserver(markTab).observe(byId("machines"));
