/** The tables of a report, whose rows lead to the sections of runs, and what is said of a run. */

import { dataOf, run } from "./answers.js";
import { button, byId, html, seconds, setText } from "./dom.js";
import { on, page } from "./state.js";

const about = dataOf("about");
/** Rows by the runs that they lead to. */
const links = new Map();

function cellOf(text, place, { run }) {
  if (place > 0 || run === null) {
    return html(place ? "td" : "th", place ? {} : { scope: "row" }, text);
  }
  const link = html("a", { href: `#run=${run}` }, text);
  links.set(run, [...(links.get(run) ?? []), link]);
  return html("th", { scope: "row" }, link);
}

function rowOf(row) {
  const cells = row.cells.map((text, place) => cellOf(text, place, row));
  return html("tr", { class: row.is_bad ? "bad" : false }, ...cells);
}

function tableOf({ title, columns, rows, notes }) {
  const names = columns.map((name) => html("th", { scope: "col" }, name));
  const table = html("table", {},
    html("thead", {}, html("tr", {}, ...names)), html("tbody", {}, ...rows.map(rowOf)));
  return html("section", { class: "card table" },
    html("header", {}, html("h2", {}, title)),
    ...notes.map((note) => html("p", { class: "note" }, note)),
    rows.length ? html("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": title },
      table) : null);
}

byId("tables").append(...about.tables.map(tableOf));

/** Names of machines, for the reasons of each. */
function machineTabs() {
  const tabs = page.hello.machines.map(({ name, title }) =>
    button(name, title || name, () => page.choose(name), { "data-name": name }));
  byId("machines").replaceChildren(...tabs);
  markTab();
}

function markTab() {
  for (const tab of byId("machines").children) {
    tab.setAttribute("aria-pressed", String(tab.dataset.name === page.machine));
  }
}

on("hello", () => {
  const { title, file, seed } = page.hello;
  if (!about.tables.length) {
    setText(byId("title"), title);
  }
  const chip = byId("source");
  chip.hidden = false;
  setText(chip, [file, seed && `seed ${seed}`].filter(Boolean).join(", "));
  const facts = about.facts[run.number] ?? [];
  const items = facts.flatMap(([name, text]) => [html("dt", {}, name), html("dd", {}, text)]);
  byId("facts").replaceChildren(...items);
  machineTabs();
  byId("cards").hidden = false;
  byId("timeline").hidden = false;
  for (const [number, own] of links) {
    const is_shown = number === run.number;
    own.forEach((link) => link.setAttribute("aria-current", String(is_shown)));
  }
});
on("machine", markTab);
on("shown cursor", () => setText(byId("time"), seconds(page.time_s, page.digits)));
