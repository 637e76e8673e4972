/** Why the chosen machine is where it is, in the words of `specc why`, and what is missing. */

import { breakpointButton } from "./breakpoints.js";
import { byId, debounce, html, placeOf, seconds, setText } from "./dom.js";
import { stateWords } from "./machine.js";
import { on, page, Question } from "./state.js";

const REST_MS = 100;
const BETWEEN_MS = 500;
const SOON_MS = 250;
/** Between questions while time goes on by itself, and after a change of the state. */
const ASIDE = /^(not asked|rows of |conditions of |by )|: not asked/;
/** What is said besides. */
const TIME = /^([\d.e+-]+) s\s+/;

const asking = new Question("why");
const reasons = byId("reasons");
const head = html("div", { class: "where" });
const body = html("div", { class: "lines" });
reasons.append(head, body);

/** Titles of groups that were opened or closed by hand. */
const opened = new Map([["Sent", false], ["Last transitions", true]]);
let shape = "";
let texts = [];
let last_ms = 0;
let asked = "";
let asked_since = null;
/** Reasons out of sight are not asked for while time goes on. */
let is_seen = true;
new IntersectionObserver((entries) => {
  is_seen = entries.at(-1).isIntersecting;
}).observe(reasons);

function sinceWhen() {
  return page.shown.states[page.machine]?.since_s ?? null;
}

function ask() {
  last_ms = performance.now();
  asked = `${page.machine} ${page.time_s}`;
  asked_since = sinceWhen();
  asking.ask({ machine: page.machine, time_s: page.cursor });
}

const askAtRest = debounce(ask, REST_MS);

function askInTime() {
  const is_moving = (page.cursor === null || page.playing) && is_seen && !document.hidden;
  const is_new = asked !== `${page.machine} ${page.time_s}`;
  const between_ms = asked_since === sinceWhen() ? BETWEEN_MS : SOON_MS;
  if (is_moving && is_new && performance.now() - last_ms > between_ms) {
    ask();
  }
}

// Where it is: known before the reasons come.

const where = {
  state: html("b", { class: "current" }),
  title: html("span", { class: "title" }),
  since: html("span", { class: "since" }),
};
head.append(where.state, where.title, where.since);

function showWhere() {
  const standing = page.shown.states[page.machine];
  const machine = page.chosen;
  if (!standing || !machine) {
    setText(where.state, page.machine);
    setText(where.title, page.isFile ? "no step is known at this time" : "has made no step yet");
    setText(where.since, "");
    return;
  }
  const state = machine.states.find((one) => one.name === standing.state);
  setText(where.state, standing.state);
  where.state.classList.toggle("error", Boolean(state?.is_error));
  const title = stateWords(machine, standing.state).slice(standing.state.length + 3);
  const modes = state?.modes.length ? `in ${[...state.modes].reverse().join(" in ")}` : "";
  setText(where.title, [title, modes].filter(Boolean).join(", "));
  const { since_s } = standing;
  const lasted_s = since_s === null ? 0 : Math.max(0, page.shown.time_s - since_s);
  const digits = Math.min(page.digits, 3);
  setText(
    where.since,
    since_s === null
      ? ""
      : `since ${seconds(since_s, digits)}, for ${seconds(lasted_s, digits)}`,
  );
}

// The reasons.

/** @param {import("./protocol.js").WhyLine} line */
function breakpointOf(line) {
  const { role, name } = line;
  if (page.isFile || !name || name === "always" || name === "never") {
    return null;
  }
  const machine = page.machine;
  return role === "row"
    ? { kind: "row", machine, row: name }
    : { kind: "condition", machine, condition: name };
}

const TRUTHS = new Map([
  [true, ["●", "true"]],
  [false, ["○", "false"]],
  [null, ["–", "not known"]],
]);

function truthMark(truth) {
  const [sign, words] = TRUTHS.get(truth);
  return html("span", { class: "truth", title: words, "aria-hidden": "true" }, sign);
}

/** The parts of a line; its text is the first. */
function lineOf(line) {
  const text = html("span", { class: "text" });
  const is_judged = line.truth !== null || /: not known$/.test(line.text);
  const is_jump = line.role === "past" && TIME.test(line.text);
  const element = html(
    is_jump ? "button" : "div",
    {
      class: `line ${line.role}`,
      type: is_jump && "button",
      title: is_jump && "Look at this time",
      onclick: is_jump && (() => page.look(Number(line.text.match(TIME)[1]))),
    },
    is_judged ? truthMark(line.truth) : null,
    text,
    line.place ? placeOf(line.place) : null,
  );
  const stop = breakpointOf(line);
  if (stop) {
    element.append(breakpointButton(stop));
  }
  element.classList.toggle("judged", is_judged);
  element.classList.toggle("aside", ASIDE.test(line.text));
  const depth = Math.max(0, Math.min(line.depth, 5) - 1);
  element.classList.add(`depth-${depth}`);
  return [element, text];
}

/** Put a text in, with what is needed told apart. */
function write(element, line) {
  const words = line.role === "past" ? line.text.replace(TIME, "") : line.text;
  const [value, need] = line.role === "reason" ? splitNeed(words) : [words, ""];
  const time = line.role === "past" && line.text.match(TIME);
  element.replaceChildren(
    ...(time ? [html("span", { class: "at" }, `${time[1]} s`)] : []),
    ...unbroken(value),
    ...(need ? [html("b", { class: "need" }, need)] : []),
  );
}

/** A text whose arrows are not broken between lines. */
function unbroken(text) {
  return text.split(/(->)/).map((part) =>
    part === "->" ? html("span", { class: "arrow" }, part) : part,
  );
}

function splitNeed(text) {
  const sign = text.includes(" is not near ") ? ": apart by " : ", needs ";
  const at = text.indexOf(sign);
  return at < 0 ? [text, ""] : [`${text.slice(0, at)} `, text.slice(at + 2)];
}

function group(title, elements) {
  const details = html(
    "details",
    { open: opened.get(title), ontoggle: () => opened.set(title, details.open) },
    html("summary", {}, title),
    ...elements,
  );
  return details;
}

/** Whether a line says what stands above all lines. */
function isHead({ role, text }) {
  return role === "state" && text.startsWith(`${page.machine} at `);
}

/** @param {import("./protocol.js").Why} message */
function show(message) {
  const lines = message.lines
    .map((line) => ({ ...line, text: line.text.trim() }))
    .filter((line) => line.text !== "last transitions:" && !isHead(line));
  const keys = lines.map((line) => {
    const stop = breakpointOf(line);
    const time = line.role === "past" ? line.text : "";
    return [line.role, line.depth, line.truth, line.place, time, JSON.stringify(stop)].join("|");
  });
  const marks = JSON.stringify(page.breakpoints);
  const own = `${message.machine}\n${page.controls}\n${marks}\n${keys.join("\n")}`;
  if (own !== shape) {
    shape = own;
    build(lines);
  }
  lines.forEach((line, place) => {
    if (texts[place].dataset.text !== line.text) {
      texts[place].dataset.text = line.text;
      write(texts[place], line);
    }
  });
}

function build(lines) {
  const pairs = lines.map(lineOf);
  texts = pairs.map(([, text]) => text);
  const ofRole = (role) => pairs.filter((_, at) => lines[at].role === role).map(([one]) => one);
  const [sent, past] = [ofRole("sent"), ofRole("past")];
  const others = pairs.filter((_, at) => !["sent", "past"].includes(lines[at].role));
  body.replaceChildren(
    ...others.map(([one]) => one),
    ...(sent.length ? [group("Sent", sent)] : []),
    ...(past.length ? [group("Last transitions", past.reverse())] : []),
  );
}

on("why", (message) => {
  if (asking.answers(message) && message.machine === page.machine) {
    show(message);
  }
});
on("breakpoints control", () => page.hello && ask());
on("cursor", () => (page.playing ? askInTime() : askAtRest()));
on("machine", ask);
on("hello", () => {
  shape = "";
  body.replaceChildren();
  ask();
});
on("shown", () => {
  showWhere();
  askInTime();
});
