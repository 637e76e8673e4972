/** Breakpoints: one list, set from the machine, from Why and from requirements; its dialog. */

import { button, byId, html } from "./dom.js";
import { on, page } from "./state.js";
import { say } from "./notices.js";

const DIALOG = byId("breakpoints");
const COMPARISONS = ["", "<", "<=", "==", "!=", ">=", ">"];

/** What a breakpoint stops at; equal ones are the same. */
function wordsOf(one) {
  switch (one.kind) {
    case "state":
      return `${one.machine} enters ${one.state}`;
    case "row":
      return `${one.machine} takes ${one.row}`;
    case "condition":
      return `${one.condition} decides in ${one.machine}`;
    case "requirement":
      return `violated: ${one.that}`;
    default:
      return sentWords(one);
  }
}

function sentWords({ machine, element, item, op, value }) {
  const at = item === undefined ? "" : `[${item}]`;
  return `${machine} sends ${element}${at}${op ? ` ${op} ${value}` : ""}`;
}

/** The breakpoint in the list that is equal to this one. */
function setBreakpoint(one) {
  return page.breakpoints.find((other) => wordsOf(other) === wordsOf(one));
}

/** Set breakpoints that belong together, or remove them if some are set. */
export function toggleBreakpoints(own) {
  const refusal = page.refusal("break");
  if (refusal) {
    say(`No breakpoint: ${refusal}.`);
    return;
  }
  const known = new Set(own.map(setBreakpoint).filter(Boolean));
  const others = page.breakpoints.filter((other) => !known.has(other));
  const added = known.size ? [] : own.map((one) => ({ id: wordsOf(one), ...one }));
  page.send({ type: "break", breakpoints: [...others, ...added] });
}

const toggleBreakpoint = (one) => toggleBreakpoints([one]);

/** A small button that sets and removes a breakpoint, and shows whether it is set. */
export function breakpointButton(one) {
  const is_set = Boolean(setBreakpoint(one));
  const words = `${is_set ? "Remove the breakpoint" : "Stop when"}: ${wordsOf(one)}`;
  return button("", words, () => toggleBreakpoint(one), {
    class: "stop-here",
    "aria-pressed": String(is_set),
    "aria-label": words,
  });
}

// The dialog.

export function showBreakpoints() {
  render();
  DIALOG.showModal();
}

function render() {
  const refusal = page.refusal("break");
  const items = page.breakpoints.map((one) =>
    html(
      "li",
      {},
      html("span", {}, wordsOf(one)),
      button("Remove", `Remove: ${wordsOf(one)}`, () => toggleBreakpoint(one), {
        disabled: Boolean(refusal),
      }),
    ),
  );
  const none = html("p", { class: "empty" }, "None is set.");
  DIALOG.replaceChildren(
    html("h2", { id: "breakpoints-title" }, "Breakpoints"),
    items.length ? html("ul", {}, ...items) : none,
    html(
      "p",
      { class: "hint" },
      "Click a state or an arc of the machine, or the dot beside a condition, a row or a " +
        "requirement. The run stops when the step is visible to others, one period after it; " +
        "other machines may be up to a period on.",
    ),
    sentForm(refusal),
    html("form", { method: "dialog", class: "ends" }, html("button", {}, "Close")),
  );
}

/** The outputs of a machine: `y.E.c_d` as `E.c_d`. */
function outputsOf(machine) {
  const begin = `${machine}.y.`;
  const signals = page.hello.signals.filter((signal) => signal.name.startsWith(begin));
  return signals.map((signal) => ({ ...signal, element: signal.name.slice(begin.length) }));
}

function options(values, chosen) {
  return values.map((value) => html("option", { value, selected: value === chosen }, value));
}

/** A form for a breakpoint on a value that is sent. */
function sentForm(refusal) {
  const machines = page.hello.machines.map((machine) => machine.name);
  const senders = machines.filter((name) => outputsOf(name).length > 0);
  const sender = senders.includes(page.machine) ? page.machine : senders[0];
  const machine = html("select", { "aria-label": "Machine" }, ...options(senders, sender));
  const element = html("select", { "aria-label": "Value" });
  const item = html("select", { "aria-label": "Component" });
  const op = html("select", { "aria-label": "Comparison" }, ...options(COMPARISONS, ""));
  const value = html("input", { "aria-label": "Compared with", type: "number", step: "any" });
  op.firstChild.textContent = "(any)";
  const showItems = () => {
    const signal = outputsOf(machine.value).find((one) => one.element === element.value);
    const parts = signal?.components ?? [];
    item.replaceChildren(
      ...parts.map((part, number) => html("option", { value: number }, part.name || `${number}`)),
    );
    item.hidden = parts.length < 2;
    value.disabled = op.value === "";
  };
  const showElements = () => {
    element.replaceChildren(...options(outputsOf(machine.value).map((one) => one.element)));
    showItems();
  };
  machine.addEventListener("change", showElements);
  element.addEventListener("change", showItems);
  op.addEventListener("change", showItems);
  showElements();
  const add = (event) => {
    event.preventDefault();
    const one = { kind: "sent", machine: machine.value, element: element.value };
    if (op.value) {
      Object.assign(one, { op: op.value, value: Number(value.value) });
      Object.assign(one, item.hidden ? {} : { item: Number(item.value) });
    }
    toggleBreakpoint(one);
  };
  const sends = html("span", {}, "sends");
  const submit = html("button", { disabled: Boolean(refusal), title: refusal }, "Add");
  return html(
    "form",
    { class: "row", onsubmit: add, hidden: senders.length === 0 },
    html("span", {}, "Stop when"), machine, sends, element, item, op, value, submit,
  );
}

on("breakpoints hello control", () => {
  if (DIALOG?.open && page.hello) {
    render();
  }
});
