/** Signals chosen by name: their values at the cursor, and the plot of the window around it. */

import { button, byId, debounce, dotted, html, recall, remember, setText } from "./dom.js";
import { plots } from "./plot.js";
import { askValues, on, page, Question } from "./state.js";

const WINDOWS = [2, 5, 10, 30, 60];
const USUAL_S = 10;
const WHOLE = 0;
/** The window that is all of a recording. */
const MOST_FOUND = 60;
const BETWEEN_MS = 1000;
/** Between plots while time goes on by itself; values come twice as often. */
const REST_MS = 120;

const list = byId("plots");
/** Signal -> its card: elements, question, and the last series. */
let cards = new Map();
let window_s = recall("window", USUAL_S);
let last_ms = 0;
let last_values_ms = 0;
/** Cards that are in sight; others are not drawn. */
const seen = new Set();
const sight = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const card = cards.get(target.dataset.name);
    if (!card || !isIntersecting) {
      seen.delete(target.dataset.name);
    } else if (!seen.has(card.signal.name)) {
      seen.add(card.signal.name);
      askSeries(card);
    }
  }
});

// What is chosen.

/** Under which choices are remembered: those of a report are its own. */
function keyOf({ report, system }) {
  return `signals of ${report ?? system}`;
}

function chosenNames() {
  const known = new Set(page.hello.signals.map((signal) => signal.name));
  const before = recall(keyOf(page.hello), []).filter((name) => known.has(name));
  return before.length ? before : page.hello.usual;
}

function keep() {
  remember(keyOf(page.hello), [...cards.keys()]);
  tellServer();
}

function tellServer() {
  page.watching = { ...page.watching, signals: all.open ? null : [...cards.keys()] };
  page.send({ type: "watch", ...page.watching, machine: page.machine });
}

function choose(name) {
  const signal = page.hello.signals.find((one) => one.name === name);
  if (signal && !cards.has(name)) {
    cards.set(name, cardOf(signal));
    const { element } = cards.get(name);
    list.append(element);
    sight.observe(element);
    showValues();
  }
}

function drop(name) {
  const { element } = cards.get(name);
  sight.unobserve(element);
  element.remove();
  seen.delete(name);
  cards.delete(name);
  keep();
}

function cardOf(signal) {
  const value = html("output", { class: "value" });
  const pictures = html("div", { class: "pictures" });
  const remove = button("×", `Remove ${signal.name}`, () => drop(signal.name), {
    "aria-label": `Remove ${signal.name}`,
  });
  const name = html("span", { class: "name", title: signal.title }, ...dotted(signal.name));
  const title = html("span", { class: "title" }, signal.title);
  const head = html("div", { class: "head" }, name, title, value, remove);
  const look = signal.components.length > 3 ? "signal long" : "signal";
  const properties = { class: look, "aria-label": signal.name, "data-name": signal.name };
  const element = html("article", properties, head, pictures);
  return { signal, element, value, pictures, question: new Question("series"), series: null };
}

// Values and plots.

function showValues() {
  for (const [name, card] of cards) {
    const text = page.shown.values?.[name] ?? "–";
    setText(card.value, text);
    card.value.title = text;
  }
  if (all.open) {
    showAll();
  }
}

function askSeries(card) {
  if (card.signal.components.length) {
    const whole = { time_s: null, window_s: page.end_s - page.hello.begin_s };
    const around = { time_s: page.cursor, window_s };
    card.question.ask({ name: card.signal.name, ...(window_s === WHOLE ? whole : around) });
  }
}

function askAll() {
  last_ms = performance.now();
  for (const name of seen) {
    askSeries(cards.get(name));
  }
}

const askAtRest = debounce(askAll, REST_MS);

function askInTime() {
  const now_ms = performance.now();
  const is_live = page.cursor === null && !page.isFile;
  if (document.hidden || !(page.playing || is_live)) {
    return;
  }
  if (is_live && (seen.size || all.open) && now_ms - last_values_ms > BETWEEN_MS / 2) {
    last_values_ms = now_ms;
    askValues();
  }
  if (now_ms - last_ms > BETWEEN_MS) {
    askAll();
  }
}

function draw(card) {
  const width = list.clientWidth - 24;
  if (card.series && width > 100) {
    card.pictures.replaceChildren(...plots(card.signal, card.series, page.time_s, width));
  }
}

// Search.

const field = html("input", {
  type: "search",
  role: "combobox",
  placeholder: "Add a signal…",
  "aria-label": "Add a signal by name",
  "aria-expanded": "false",
  "aria-controls": "found",
  "aria-autocomplete": "list",
  autocomplete: "off",
  spellcheck: "false",
});
const found = html("ul", { id: "found", role: "listbox", "aria-label": "Signals", hidden: true });
byId("search").append(field, found);
let active = 0;

function search() {
  const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
  const fits = ({ name, title }) => {
    const text = `${name} ${title}`.toLowerCase();
    return words.every((word) => text.includes(word));
  };
  const names = page.hello.signals.filter((signal) => fits(signal) && !cards.has(signal.name));
  const items = names.slice(0, MOST_FOUND).map((signal) =>
    html(
      "li",
      {
        role: "option",
        "data-name": signal.name,
        onpointerdown: (event) => {
          event.preventDefault();
          take(signal.name);
        },
      },
      html("span", {}, ...dotted(signal.name)),
      html("span", { class: "title" }, [signal.title, signal.unit].filter(Boolean).join(" · ")),
    ),
  );
  const none = html("li", { class: "empty" }, "No other signal has that in its name or title.");
  found.replaceChildren(...(items.length ? items : [none]));
  activate(0);
  open(true);
}

function open(is_open) {
  found.hidden = !is_open;
  field.setAttribute("aria-expanded", String(is_open));
}

function activate(place) {
  const items = [...found.querySelectorAll("[role=option]")];
  active = items.length ? (place + items.length) % items.length : 0;
  items.forEach((item, at) => {
    item.setAttribute("aria-selected", String(at === active));
    item.id = at === active ? "found-active" : "";
  });
  if (items.length) {
    field.setAttribute("aria-activedescendant", "found-active");
    items[active].scrollIntoView({ block: "nearest" });
  } else {
    field.removeAttribute("aria-activedescendant");
  }
}

function take(name) {
  choose(name);
  keep();
  field.value = "";
  open(false);
  cards.get(name)?.element.scrollIntoView({ block: "nearest" });
}

function onKey(event) {
  const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
  if (step) {
    event.preventDefault();
    if (found.hidden) {
      search();
    } else {
      activate(active + step);
    }
  } else if (event.key === "Enter" && !found.hidden) {
    const name = found.querySelector("#found-active")?.dataset.name;
    if (name) {
      take(name);
    }
  } else if (event.key === "Escape" && !found.hidden) {
    open(false);
    event.stopPropagation();
  }
}

field.addEventListener("input", search);
field.addEventListener("focus", search);
field.addEventListener("blur", () => open(false));
field.addEventListener("keydown", onKey);

// All values, without plots.

const table = html("table", {}, html("tbody"));
const all = html(
  "details",
  { class: "all", ontoggle: onAll },
  html("summary", {}, "All values"),
  table,
);
let cells = new Map();

function onAll() {
  tellServer();
  askValues();
  showAll();
}

function showAll() {
  if (!all.open) {
    return;
  }
  if (!cells.size) {
    for (const signal of page.hello.signals) {
      cells.set(signal.name, html("td", { class: "value" }));
    }
    const rows = [...cells].map(([name, cell]) =>
      html("tr", {}, html("th", { scope: "row" }, ...dotted(name)), cell),
    );
    table.tBodies[0].replaceChildren(...rows);
  }
  for (const [name, cell] of cells) {
    setText(cell, page.shown.values?.[name] ?? "–");
  }
}

// The window of time.

const choice = html("select", {
  "aria-label": "Length of plots",
  onchange: () => {
    window_s = Number(choice.value);
    remember("window", window_s);
    askAll();
  },
});
byId("windows").append(choice);

function offerWindows() {
  const all = page.isFile ? [...WINDOWS, WHOLE] : WINDOWS;
  window_s = page.hello.window_s ?? (all.includes(window_s) ? window_s : USUAL_S);
  const words = (s) => (s === WHOLE ? "whole run" : `${s} s`);
  choice.replaceChildren(
    ...all.map((s) => html("option", { value: s, selected: s === window_s }, words(s))),
  );
}

on("hello", () => {
  cards = new Map();
  cells = new Map();
  seen.clear();
  sight.disconnect();
  list.replaceChildren();
  offerWindows();
  for (const name of chosenNames()) {
    choose(name);
  }
  list.after(all);
  tellServer();
  askValues();
});
on("series", (message) => {
  const card = cards.get(message.name);
  if (card?.question.answers(message)) {
    card.series = message;
    draw(card);
  }
});
on("shown", () => {
  showValues();
  askInTime();
});
on("cursor", () => {
  cards.forEach(draw);
  askAtRest();
});
on("machine", tellServer);
new ResizeObserver(debounce(() => cards.forEach(draw), 50)).observe(list);
