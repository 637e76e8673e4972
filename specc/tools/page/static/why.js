/** Why the chosen machine is where it is, in the words of `specc why`, and what is missing. */

import { breakpointButton } from "./breakpoints.js";
import { byId, debounce, html, placeOf, setText } from "./dom.js";
import { on, page, Question, stateWords } from "./state.js";

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
const opened = new Map([["Would stop if", false], ["Sent", false], ["Last transitions", true]]);
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

/** After the last moment of a run, which perhaps came too soon after the one before. */
const askLast = debounce(askInTime, BETWEEN_MS + REST_MS);

// Where it was in the step that the reasons are of.

const where = {
  state: html("b", { class: "current" }),
  title: html("span", { class: "title" }),
  since: html("span", { class: "since" }),
};
head.append(where.state, where.title, where.since);

/** `gate.c at 2.5 s (stamp 50): in lifting in working since 1.2 s, for 1.3 s` */
const STANDING =
  /^(\S+ s)(?: \(stamp \d+\))?: in (\S+)(.*?)(?: since (\S+ s), (.*)|, since when .*)$/;

/** @param {import("./protocol.js").WhyLine|undefined} line that says where the machine is */
function showWhere(line) {
  const words = line?.text.slice(`${page.machine} at `.length).match(STANDING);
  where.state.classList.remove("error");
  if (!words) {
    setText(where.state, page.machine);
    setText(where.title, "");
    setText(where.since, "");
    return;
  }
  const [, at, name, modes, since, lasted] = words;
  const state = page.chosen?.states.find((one) => one.name === name);
  setText(where.state, name);
  where.state.classList.toggle("error", Boolean(state?.is_error));
  const title = stateWords(page.chosen, name).slice(name.length + 3);
  setText(where.title, [title, modes.trim()].filter(Boolean).join(", "));
  setText(where.since, since ? `since ${since}, ${lasted}; step of ${at}` : `step of ${at}`);
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
  const [value, need] = line.is_wanted ? splitNeed(words) : [words, ""];
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

/**
 * What lets the machine go on first: each line with the group in which it stands, and whether what
 * it needs is wanted. The lines below a condition belong to it.
 * @param {import("./protocol.js").WhyLine[]} lines
 */
function judged(lines) {
  const is_taken = lines.some(({ role, depth, truth }) => role === "row" && depth > 1 && truth);
  let group = "";
  let is_wanted = false;
  const found = lines.map((line) => {
    const { role, depth, truth, text } = line;
    if (role === "sent" || role === "past") {
      return { ...line, group: role, is_wanted: false };
    }
    if (depth <= 2) {
      const is_error = /^(rows of )?error[ :]/.test(text);
      const is_decided = truth !== null || ASIDE.test(text);
      group = is_error && !truth && is_decided ? "error" : role === "row" && depth > 1 ? "row" : "";
      is_wanted = truth === false && group !== "error" && !is_taken;
    }
    return { ...line, group, is_wanted: is_wanted && role === "reason" };
  });
  const ranks = ["", "row", "error", "sent", "past"];
  return found.sort((a, b) => ranks.indexOf(a.group) - ranks.indexOf(b.group));
}

/** Whether a line says what stands above all lines. */
function isHead({ role, text }, machine) {
  return role === "state" && text.startsWith(`${machine} at `);
}

/** The lines of an answer, trimmed, and those of them that are reasons, in their order. */
function linesOf({ machine, lines }) {
  const all = lines.map((line) => ({ ...line, text: line.text.trim() }));
  const isReason = (one) => one.text !== "last transitions:" && !isHead(one, machine);
  return [all.find((one) => isHead(one, machine)), judged(all.filter(isReason))];
}

/** @param {import("./protocol.js").Why} message @returns {Element[]} a list that stays as it is */
export function listOf(message) {
  const [head, lines] = linesOf(message);
  const pairs = lines.map(lineOf);
  pairs.forEach(([, text], at) => write(text, lines[at]));
  const title = head ? [html("p", { class: "title" }, head.text)] : [];
  return [...title, ...arranged(lines, pairs)];
}

/** @param {import("./protocol.js").Why} message */
function show(message) {
  const [head, lines] = linesOf(message);
  showWhere(head);
  const keys = lines.map((line) => {
    const stop = breakpointOf(line);
    const time = line.role === "past" ? line.text : "";
    const { role, depth, truth, place, group } = line;
    return [role, depth, truth, place, group, time, JSON.stringify(stop)].join("|");
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
  body.replaceChildren(...arranged(lines, pairs));
}

/** The elements of lines, in groups. */
function arranged(lines, pairs) {
  const of = (name) => pairs.filter((_, at) => lines[at].group === name).map(([one]) => one);
  const [errors, sent, past] = ["error", "sent", "past"].map(of);
  return [
    ...of(""),
    ...of("row"),
    ...(errors.length ? [group("Would stop if", errors)] : []),
    ...(sent.length ? [group("Sent", sent)] : []),
    ...(past.length ? [group("Last transitions", past.reverse())] : []),
  ];
}

on("why", (message) => {
  if (asking.answers(message) && message.machine === page.machine) {
    if (page.cursor === null) {
      asked = `${message.machine} ${message.time_s}`; // the present has gone on perhaps
    }
    show(message);
  }
});
on("breakpoints control", () => page.hello && ask());
on("cursor", () => (page.playing ? askInTime() : askAtRest()));
on("machine hello", () => {
  shape = "";
  body.replaceChildren();
  showWhere();
  ask();
});
on("shown", () => {
  askInTime();
  askLast();
});
