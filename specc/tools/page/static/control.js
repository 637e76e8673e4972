/** Control of the run, or of playing a recording: buttons, keys, and starting again. */

import { SHAPES } from "./bands.js";
import { showBreakpoints } from "./breakpoints.js";
import { button, byId, html, seconds, setText, svg } from "./dom.js";
import { say } from "./notices.js";
import { on, page } from "./state.js";
import { jumpMark, jumpTransition, showAll, zoom } from "./timeline.js";

const MOST_VALUES = 2;
/** Of constants that were set, beside the seed. */
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

// Playing a recording: the page moves its cursor itself.

let play_speed = 1;
let played_ms = 0;

function play() {
  page.playing = !page.playing;
  if (page.playing) {
    if (page.cursor === null || page.cursor >= page.end_s - 1e-6) {
      page.look(page.hello.begin_s);
    }
    played_ms = performance.now();
    requestAnimationFrame(playOn);
  }
  show();
}

function playOn(now_ms) {
  if (!page.playing) {
    return;
  }
  const passed_s = (Math.max(0, now_ms - played_ms) / 1000) * play_speed;
  played_ms = now_ms;
  const time_s = Math.min(page.end_s, page.cursor + passed_s);
  page.playing = time_s < page.end_s;
  page.look(time_s);
  if (page.playing) {
    requestAnimationFrame(playOn);
  } else {
    show();
  }
}

// Commands.

function command(ability, message) {
  const refusal = page.refusal(ability);
  if (refusal) {
    say(`Not done: ${refusal}.`);
  } else {
    page.send(message);
  }
}

function pauseOrGoOn() {
  if (page.isFile) {
    play();
  } else {
    command("pause", { type: page.now?.status === "paused" ? "continue" : "pause" });
  }
}

function step() {
  if (page.isFile) {
    page.playing = false;
    page.look(page.time_s + (page.chosen?.period_s ?? 0.1));
  } else {
    page.look(null);
    page.stepping = true;
    command("step", { type: "step", machine: page.machine });
  }
}

function setSpeed() {
  const value = speed.value === "max" ? null : Number(speed.value);
  if (page.isFile) {
    play_speed = value ?? 100;
  } else {
    command("speed", { type: "speed", value });
  }
}

const pause = button("Pause", "", pauseOrGoOn, { id: "pause", class: "main" });
const stepping = button("Step", "", step, { id: "step" });
const speed = html(
  "select",
  { id: "speed", "aria-label": "Speed", onchange: setSpeed },
  ...SPEEDS.map((value) => html("option", { value, selected: value === 1 }, `× ${value}`)),
  html("option", { value: "max" }, "max"),
);
const breaks = button("Breakpoints", "Breakpoints (b)", showBreakpoints, { id: "breaks" });
const again = button("Start again…", "", showRestart, { id: "again" });
const help = button("?", "Help (?)", showHelp, { id: "keys", "aria-label": "Help" });
byId("controls").append(pause, stepping, speed, breaks, again, help);
byId("follow").addEventListener("click", () => page.look(null));
byId("take").addEventListener("click", () => page.send({ type: "take" }));

// What the buttons and the clock show.

/** Hide what cannot be done at all, and say why what is there cannot be done now. */
function offer(element, ability, title) {
  element.hidden = !page.isFile && !page.hello.can[ability];
  const refusal = page.isFile ? "" : page.refusal(ability);
  element.setAttribute("aria-disabled", String(Boolean(refusal)));
  element.title = refusal ? `${title}\nNot now: ${refusal}.` : title;
}

function show() {
  if (!page.hello) {
    return;
  }
  const is_still = page.isFile ? !page.playing : page.now?.status === "paused";
  setText(pause, is_still ? (page.isFile ? "Play" : "Continue") : "Pause");
  pause.classList.toggle("go", is_still);
  offer(pause, "pause", `${pause.textContent} (Space)`);
  offer(stepping, "step", `One period of ${page.machine} (s)`);
  offer(speed, "speed", "Simulated seconds in a second");
  offer(breaks, "break", "Breakpoints (b)");
  offer(again, "restart", "Start again, with other constants if wanted");
  breaks.hidden = !page.hello.can.break;
  again.hidden = !page.hello.can.restart;
  const number = page.breakpoints.length;
  setText(breaks, number ? `Breakpoints ${number}` : "Breakpoints");
  showClock();
  showStatus();
}

function showClock() {
  setText(byId("time"), seconds(page.time_s, page.digits));
  const is_past = page.cursor !== null && !page.isFile;
  byId("follow").hidden = !is_past;
  document.body.classList.toggle("past", is_past);
  setText(byId("follow"), page.now?.status === "ended" ? "End" : "Live");
  byId("follow").title = "Back to the latest moment (l)";
}

function showStatus() {
  const chip = byId("status");
  const { now } = page;
  let words = page.isFile ? "" : (now?.status ?? "begins");
  if (page.starting) {
    words = page.starting;
  } else if (now?.status === "running" && now.time_s < page.hello.repeats_until_s) {
    words = `repeating until ${seconds(page.hello.repeats_until_s, page.digits)}`;
  } else if (now?.status === "running" && !page.isFile) {
    words = page.hello.real_time ? "running in real time" : `running ${factorWords(now)}`;
  }
  if (now?.status === "paused" && page.stop_reason) {
    words = `paused: ${page.stop_reason}`;
  }
  const ending = now?.status === "ended" && !page.isFile ? page.end : null;
  if (ending) {
    words = endWords(ending);
  }
  const late = Object.entries(now?.real_time ?? {});
  if (late.length && !ending) {
    const worst = Math.max(...late.map(([, { late_ms }]) => late_ms));
    words += `, ${worst.toFixed(1)} ms late`;
  }
  const state = page.connected ? (now?.status ?? "") : "lost";
  chip.className = `chip is-${page.isFile && page.connected ? "file" : state}`;
  chip.classList.toggle("has-failed", ending?.ended === "fault");
  setText(chip, page.connected ? words : "not connected");
  chip.hidden = page.connected && !words;
  const faults = (ending?.report?.faults ?? []).map((one) => `${one.culprit}: ${one.message}`);
  const pages = page.clients > 1 ? [`${page.clients} pages are open`] : [];
  chip.title = [...faults, ...pages].join("\n");
  byId("take").hidden = page.isFile || page.controls || !page.connected;
}

/** How a run ended: `completed, 2 cycles, exit code 0`, `fault of arm.c, exit code 1`. */
function endWords({ ended, exit_code, report }) {
  const cycles = page.marks.filter((mark) => mark.kind === "cycle").length;
  const culprit = ended === "fault" ? report?.faults?.[0]?.culprit : "";
  return [
    culprit ? `fault of ${culprit}` : ended,
    ...(cycles ? [`${cycles} cycle${cycles > 1 ? "s" : ""}`] : []),
    `exit code ${exit_code}`,
  ].join(", ");
}

/** How fast simulated time goes: as it should, or as it does where that is slower. */
function factorWords({ speed: wanted, factor }) {
  const is_reached = wanted !== null && (factor === null || factor > 0.9 * wanted);
  const reached = factor === null ? "max" : Number(factor.toPrecision(2));
  return `× ${is_reached ? wanted : reached}`;
}

function showAbout() {
  const { title, source, file, seed, set = {} } = page.hello;
  setText(byId("title"), title);
  document.title = `${title} – specc`;
  const chip = byId("source");
  chip.hidden = false;
  const values = Object.entries(set).map(([name, text]) => `${name}=${text}`);
  const more = values.length > MOST_VALUES ? [`${values.length - MOST_VALUES} more set`] : [];
  const run = [source === "live" ? "live" : file, `seed ${seed}`];
  setText(chip, [...run, ...values.slice(0, MOST_VALUES), ...more].join(", "));
  chip.title = [...run, ...values].join("\n");
  show();
}

// Starting again.

function showRestart() {
  const refusal = page.isFile ? "" : page.refusal("restart");
  if (refusal) {
    say(`Not done: ${refusal}.`);
    return;
  }
  const dialog = byId("restart");
  const here_s = page.time_s;
  const fields = page.hello.constants.map((constant) => {
    const { name } = constant;
    const text = page.hello.set?.[name] ?? constant.text;
    const field = html("input", {
      value: text, placeholder: "as in the specification", "aria-label": name, spellcheck: "false",
    });
    return { ...constant, text, field };
  });
  const rows = fields.map(({ name, unit, field }) =>
    html("label", { class: "constant", "data-name": name }, html("span", {}, name), field, unit),
  );
  const search = html("input", {
    type: "search", placeholder: "Find a constant…", "aria-label": "Find a constant",
    oninput: () => {
      for (const row of rows) {
        row.hidden = !row.dataset.name.toLowerCase().includes(search.value.toLowerCase());
      }
    },
  });
  const from = (value, text, checked) =>
    html("label", {}, html("input", { type: "radio", name: "from", value, checked }), text);
  const answer = html("p", { class: "answer", role: "status" });
  const start = html("button", { value: "start", class: "main" }, "Start");
  const send = (event) => {
    if (event.submitter?.value !== "start") {
      return;
    }
    const is_here = dialog.querySelector("[name=from]:checked").value === "here";
    const changed = fields.filter(({ text, field }) => field.value.trim() !== text);
    const set = Object.fromEntries(changed.map(({ name, field }) => [name, field.value.trim()]));
    page.send({ type: "restart", from_s: is_here ? here_s : null, set });
    if (!page.isFile) {
      event.preventDefault(); // it stays open until the new run begins
      page.restarting = true;
      start.disabled = true;
      setText(answer, "The constants are checked…");
    }
  };
  dialog.replaceChildren(
    html("h2", { id: "restart-title" }, "Start again"),
    html(
      "form",
      { method: "dialog", onsubmit: send },
      html(
        "fieldset",
        {},
        html("legend", {}, "From"),
        from("begin", "the beginning", page.cursor === null),
        from("here", `here, ${seconds(here_s, page.digits)}`, page.cursor !== null),
      ),
      rows.length ? html("fieldset", {}, html("legend", {}, "Constants"), search,
        html("div", { class: "constants" }, ...rows)) : null,
      html("p", { class: "hint" }, "Constants are checked before the present run ends."),
      answer,
      html(
        "div",
        { class: "ends" },
        html("button", { value: "" }, "Cancel"),
        start,
      ),
    ),
  );
  dialog.showModal();
}

/** Say in the dialog, while it waits for a start, what comes of it. */
function tellStart(text, is_refused) {
  const start = byId("restart").querySelector("[value=start]");
  if (start?.disabled) {
    setText(byId("restart").querySelector(".answer"), text);
    start.disabled = !is_refused;
  }
}

// Keys.

const KEYS = [
  ["Space", "pause, go on, play"],
  ["s", "step: one period of the chosen machine"],
  ["← →", "previous and next transition of the machine"],
  ["Shift ← →", "previous and next fault or violation"],
  ["+ − 0", "zoom the timeline in, out, to the whole run"],
  ["l", "back to the latest moment"],
  ["m, Shift m", "next and previous machine"],
  ["b", "breakpoints"],
  ["Enter", "on a state or an arc: set or remove a breakpoint"],
  ["← →", "on a state: through the rows that leave it; Escape: back"],
  ["Escape", "leave an enlarged card"],
];
const OTHERS = [
  ["Speed", "simulated seconds in a second; max: as fast as it can"],
  ["Start again", "from the beginning or from the time shown, with other constants if wanted"],
  ["Panel", "Space or Enter press its buttons; a hold button is on only while it is held"],
];
const MARKS = [
  ["fault", "a fault"],
  ["violation", "a requirement is violated"],
  ["disturbance", "a disturbance of the task"],
  ["change", "a live constant was changed, or the panel operated"],
  ["cycle", "a cycle has ended"],
  ["break", "the run stopped at a breakpoint"],
];

function markSign(kind) {
  const path = svg("path", { d: SHAPES[kind] });
  const sign = svg("g", { class: `mark ${kind}` }, path);
  return svg("svg", { width: 16, height: 16, viewBox: "-8 -8 16 16", "aria-hidden": "true" }, sign);
}

function entries(pairs) {
  const items = pairs.flatMap(([sign, words]) => [html("dt", {}, sign), html("dd", {}, words)]);
  return html("dl", { class: "keys" }, ...items);
}

function showHelp() {
  const dialog = byId("help");
  dialog.replaceChildren(
    html("h2", { id: "help-title" }, "Keys, buttons and marks"),
    entries(KEYS.map(([key, words]) => [html("kbd", {}, key), words])),
    html("h3", {}, "Buttons and the panel"),
    entries(OTHERS),
    html("h3", {}, "Marks of the timeline"),
    entries(MARKS.map(([kind, words]) => [markSign(kind), words])),
    html("form", { method: "dialog", class: "ends" }, html("button", {}, "Close")),
  );
  dialog.showModal();
}

function chooseNext(direction) {
  const names = page.hello.machines.map((machine) => machine.name);
  page.choose(names[(names.indexOf(page.machine) + direction + names.length) % names.length]);
}

const ACTIONS = {
  " ": pauseOrGoOn,
  s: step,
  ArrowLeft: (event) => (event.shiftKey ? jumpMark(-1) : jumpTransition(-1)),
  ArrowRight: (event) => (event.shiftKey ? jumpMark(1) : jumpTransition(1)),
  "+": () => zoom(0.5),
  "-": () => zoom(2),
  0: showAll,
  l: () => page.look(null),
  m: () => chooseNext(1),
  M: () => chooseNext(-1),
  b: () => page.hello.can.break && showBreakpoints(),
  "?": showHelp,
};

document.addEventListener("keydown", (event) => {
  const { target } = event;
  const action = ACTIONS[event.key];
  const is_modified = event.ctrlKey || event.altKey || event.metaKey;
  const is_entry = target.closest("input, textarea, select, dialog");
  const is_pressed = event.key === " " && target.closest("button, summary");
  if (action && page.hello && !is_modified && !is_entry && !is_pressed) {
    event.preventDefault();
    action(event);
  }
});

on("hello", showAbout);
on("now end marks cursor control connection breakpoints machine", show);
on("now", () => {
  const value = page.now.speed === null ? "max" : String(page.now.speed);
  if (!page.isFile && document.activeElement !== speed) {
    speed.value = [...speed.options].some((option) => option.value === value) ? value : "1";
  }
});
on("stopped", () => page.look(null));
on("starting", ({ text }) => {
  page.starting = text;
  tellStart(`The run is ${text}…`, false);
  show();
});
on("hello", () => {
  if (byId("restart").querySelector("[value=start]:disabled")) {
    byId("restart").close();
  }
});
on("refused", ({ text }) => {
  tellStart(text, true);
  show();
});
on("connection", () => !page.connected && tellStart("The connection is lost.", true));
