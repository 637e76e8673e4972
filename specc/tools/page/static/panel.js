/**
 * The operator's panel and live constants. A hold button sends a sign of life while it is held and
 * the page has the focus; the run itself releases it when they stop.
 */

import { byId, html, number, setText } from "./dom.js";
import { on, page } from "./state.js";

const SIGN_OF_LIFE_MS = 50;
const STEPS = 200;
/** Of a slider, unless it has whole numbers. */
const MOST_CHOICES = 4;
const PRESSED_MS = 250;

/** Name -> what shows a value that came: of panel elements, and of live constants. */
let widgets = new Map();
let constants = new Map();
/** Releases of the buttons that are held now. */
const releases = new Set();

function releaseAll() {
  for (const release of [...releases]) {
    release();
  }
}

function operate(element, value) {
  page.send({ type: "panel", name: element.name, value });
  promise(element.name);
}

/** Name -> what says that a value comes with the next step. */
let promises = new Map();

/** A run that is paused takes what was done when it goes on. */
function promise(name) {
  const line = promises.get(name);
  if (line && page.now?.status === "paused") {
    line.hidden = false;
    line.step_s = page.now.time_s;
  }
}

function keepPromises() {
  for (const line of promises.values()) {
    if (!line.hidden && (page.now.status !== "paused" || page.now.time_s > line.step_s)) {
      line.hidden = true;
    }
  }
}

// One function for each kind of element: its control, and how it shows a value.

/** A button, of which each press is an event. */
function pushButton(element) {
  const control = html("button", { type: "button", class: "push" }, "Press");
  control.addEventListener("click", () => {
    operate(element, true);
    control.classList.add("pressed");
    setTimeout(() => control.classList.remove("pressed"), PRESSED_MS);
  });
  return { control, show: () => {} };
}

/** A button that is true while it is held. */
function holdButton(element) {
  const control = html("button", { type: "button", class: "push hold" }, "Hold");
  let timer = 0;
  let was_held = false;
  const release = () => {
    if (!timer) {
      return;
    }
    clearInterval(timer);
    timer = 0;
    was_held = false;
    releases.delete(release);
    control.classList.remove("held");
    page.send({ type: "release", name: element.name });
  };
  const sign = () => {
    if (!document.hasFocus() || document.hidden || control.disabled || !page.connected) {
      release();
    } else {
      // The run takes no sign that waited on its way: it knows by its own time when this was sent.
      page.send({ type: "hold", name: element.name, wall_s: page.now?.wall_s ?? null });
    }
  };
  const hold = () => {
    if (timer || control.disabled) {
      return;
    }
    // A run that released the button by itself takes no sign of life before it was let go.
    page.send({ type: "release", name: element.name });
    timer = setInterval(sign, SIGN_OF_LIFE_MS);
    releases.add(release);
    promise(element.name);
    control.classList.add("held");
    sign();
  };
  control.addEventListener("pointerdown", (event) => {
    if (event.button === 0) {
      control.setPointerCapture(event.pointerId);
      hold();
    }
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) {
    control.addEventListener(name, release);
  }
  control.addEventListener("contextmenu", (event) => event.preventDefault());
  control.addEventListener("keydown", (event) => {
    if (event.key === " " || event.key === "Enter") {
      event.preventDefault();
      if (!event.repeat) {
        hold(); // what was released by itself is held only by a new press
      }
    } else {
      release();
    }
  });
  control.addEventListener("keyup", release);
  const show = (value) => {
    control.setAttribute("aria-pressed", String(Boolean(value)));
    // Signs of life may come too late while the hand is still on the button.
    const is_lost = Boolean(timer) && was_held && !value;
    was_held ||= Boolean(timer) && value;
    setText(control, value ? "Held" : is_lost ? "Released: hold again" : "Hold");
    control.classList.toggle("held", Boolean(timer) && !is_lost);
  };
  return { control, show };
}

function switchButton(element) {
  const control = html("button", { type: "button", role: "switch", class: "switch" });
  control.addEventListener("click", () => {
    operate(element, control.getAttribute("aria-checked") !== "true");
  });
  const show = (value) => {
    control.setAttribute("aria-checked", String(Boolean(value)));
    setText(control, value ? "on" : "off");
  };
  return { control, show };
}

function choiceButtons(element) {
  if (element.choices.length > MOST_CHOICES) {
    const items = element.choices.map((choice) => html("option", { value: choice }, choice));
    const control = html("select", {}, ...items);
    control.addEventListener("change", () => operate(element, control.value));
    return { control, show: (value) => (control.value = value) };
  }
  const items = element.choices.map((choice) => {
    const properties = { type: "radio", name: element.name, value: choice };
    const radio = html("input", properties);
    radio.addEventListener("change", () => operate(element, choice));
    return html("label", {}, radio, html("span", {}, choice));
  });
  const control = html("div", { role: "radiogroup", class: "choice" }, ...items);
  const show = (value) => {
    for (const item of items) {
      item.firstChild.checked = item.firstChild.value === value;
    }
  };
  return { control, show };
}

function rangeWords({ least, greatest, unit }) {
  return `${number(least)} … ${number(greatest)}${unit ? ` ${unit}` : ""}`;
}

function slider(element) {
  const { least, greatest, whole } = element;
  const step = whole ? 1 : (greatest - least) / STEPS;
  const track = html("input", { type: "range", min: least, max: greatest, step });
  const output = html("output", { class: "value" });
  const control = html("div", { class: "slide" }, track, output);
  let is_moved = false;
  const write = (value) => setText(output, `${number(value)} ${element.unit}`);
  track.addEventListener("input", () => {
    is_moved = true;
    write(Number(track.value));
    operate(element, Number(track.value));
  });
  track.addEventListener("change", () => (is_moved = false));
  const show = (value) => {
    if (!is_moved) {
      track.value = value;
      write(value);
    }
  };
  return { control, show };
}

/** A number in its range; `send` gets what was entered. */
function numberField(element, send) {
  const { least, greatest, whole } = element;
  const field = html("input", {
    type: "number", min: least, max: greatest, step: whole ? 1 : "any", inputmode: "decimal",
  });
  const range = html("span", { class: "range" }, rangeWords(element));
  const control = html("div", { class: "entry" }, field, range);
  const mark = (is_right) => {
    field.setAttribute("aria-invalid", String(!is_right));
    const words = rangeWords(element);
    setText(range, is_right ? words : `has to be ${whole ? "a whole number " : ""}in ${words}`);
  };
  field.addEventListener("change", () => {
    const is_right = field.value !== "" && field.validity.valid;
    mark(is_right);
    if (is_right) {
      send(Number(field.value));
    }
  });
  const show = (value) => {
    // What is wrong stays until it is corrected, or emptied.
    const is_wrong = field.getAttribute("aria-invalid") === "true" && field.value !== "";
    if (document.activeElement !== field && !is_wrong) {
      field.value = Number(Number(value).toPrecision(6));
      mark(true);
    }
  };
  return { control, show };
}

const KINDS = {
  button: (element) => (element.hold ? holdButton(element) : pushButton(element)),
  switch: switchButton,
  slider,
  choice: choiceButtons,
  number: (element) => numberField(element, (value) => operate(element, value)),
};

// The card.

function labelled(element, { control, show }, index) {
  const id = `widget-${index}`;
  const title = element.title || element.name.slice(element.name.lastIndexOf(".") + 1);
  const words = element.key ? `${element.name}; with --keys: ${element.key}` : element.name;
  const name = html("span", { class: "label", id, title: words }, title);
  const target = control.querySelector("input:not([type=radio])") ?? control;
  target.setAttribute("aria-labelledby", id);
  const kind = element.kind ?? "number";
  const later = html("span", { class: "later", role: "status", hidden: true }, "with the next step");
  promises.set(element.name, later);
  name.append(later);
  return [html("div", { class: `widget of-${kind}` }, name, control), show];
}

function build() {
  releaseAll();
  const { panel, live } = page.hello;
  widgets = new Map();
  constants = new Map();
  promises = new Map();
  byId("operate").hidden = panel.length + live.length === 0;
  byId("cards").classList.toggle("has-operate", panel.length + live.length > 0);
  setText(byId("operate-title"), panel.length ? "Operator’s panel" : "Live constants");
  const parts = panel.map((element, index) => {
    const [row, show] = labelled(element, KINDS[element.kind](element), index);
    show(element.initial);
    widgets.set(element.name, show);
    return row;
  });
  const entries = live.map((constant, index) => {
    const send = (value) => {
      page.send({ type: "set", name: constant.name, value });
      promise(constant.name);
    };
    const entry = numberField(constant, send);
    const [row, show] = labelled(constant, entry, panel.length + index);
    show(constant.value);
    constants.set(constant.name, show);
    row.classList.add("constant");
    return row;
  });
  const safety = "This panel is no safety device: keep a real emergency stop within reach.";
  byId("widgets").replaceChildren(
    ...(panel.length ? [html("p", { class: "safety" }, safety)] : []),
    html("p", { class: "locked", id: "locked", hidden: true }),
    html("div", { class: "grid" }, ...parts),
    ...(live.length && panel.length ? [html("h3", {}, "Live constants")] : []),
    html("div", { class: "grid" }, ...entries),
  );
  lock();
}

/** Disable all controls while they cannot be used, and say why. */
function lock() {
  const refusals = { panel: page.refusal("panel"), live: page.refusal("live") };
  for (const row of byId("widgets").querySelectorAll(".widget")) {
    const refusal = row.classList.contains("constant") ? refusals.live : refusals.panel;
    for (const control of row.querySelectorAll("button, input, select")) {
      control.disabled = Boolean(refusal);
      control.title = refusal;
    }
  }
  const refusal = (widgets.size && refusals.panel) || (constants.size && refusals.live);
  const line = byId("locked");
  line.hidden = !refusal;
  setText(line, refusal ? `Not now: ${refusal}.` : "");
  if (refusal) {
    releaseAll();
  }
}

function showValues() {
  for (const [name, value] of Object.entries(page.now.panel ?? {})) {
    widgets.get(name)?.(value);
  }
  for (const [name, value] of Object.entries(page.now.live ?? {})) {
    constants.get(name)?.(value);
  }
}

window.addEventListener("blur", releaseAll);
window.addEventListener("pagehide", releaseAll);
document.addEventListener("visibilitychange", releaseAll);

let status = "";
on("hello", build);
on("control connection", () => page.hello && lock());
on("now", () => {
  showValues();
  keepPromises();
  if (page.now.status !== status) {
    status = page.now.status;
    lock();
  }
});
