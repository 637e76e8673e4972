/** What is in a report: answers of the page's source at some moments, in place of a server. */

import { byId } from "./dom.js";
import { emit, page, take } from "./state.js";

const SAME_S = 2e-6;

/** The run that is shown. */
export const run = { number: -1, data: null, moments: [], margins: [] };

/** What is in an element with data. */
export function dataOf(id) {
  return JSON.parse(byId(id).textContent);
}

/** Moments of which each says what is another than before -> moments that say all. */
function unpacked(changes) {
  const now = { states: {}, values: {}, requirements: {} };
  return changes.map((change) => {
    for (const [name, before] of Object.entries(now)) {
      const entries = Object.entries({ ...before, ...change[name] });
      now[name] = Object.fromEntries(entries.filter(([, value]) => value !== null));
    }
    const requirements = Object.values(now.requirements);
    const { states, values } = now;
    return { time_s: change.t, states, values, requirements, flow: [], poses: null, frames: {} };
  });
}

/** The margins of each requirement as a series. */
function marginsOf(moments, requirements) {
  const t = moments.map(({ time_s }) => time_s);
  return requirements.map((_, place) => ({
    t,
    lines: [moments.map(({ requirements }) => requirements[place]?.margin ?? null)],
    words: [],
    begin_s: t[0],
    end_s: t[t.length - 1],
  }));
}

export const MARGIN = { kind: "numbers", components: [{ name: "margin", unit: "", words: [] }] };

/** Show a run, as a server would. */
export function open(number) {
  const data = dataOf(`run-${number}`);
  const moments = unpacked(data.moments);
  const margins = marginsOf(moments, data.hello.requirements);
  Object.assign(run, { number, data, moments, margins });
  page.cursor = null;
  page.hello = null; // another run of the same system begins anew
  page.connected = true;
  take({ type: "hello", ...data.hello, controls: true });
  emit("connection");
  take({ type: "spans", spans: data.spans, replace: true });
  take({ type: "marks", marks: data.marks, replace: true });
  const end = moments[moments.length - 1];
  take({ type: "now", ...end, status: "ended", speed: null, factor: null });
}

/** The moment of the report that is nearest to a time. */
export function nearest(time_s) {
  let low = 0;
  let high = run.moments.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (run.moments[middle].time_s < time_s) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  const [before, after] = [run.moments[Math.max(0, low - 1)], run.moments[low]];
  return time_s - before.time_s < after.time_s - time_s ? before : after;
}

function at(list, time_s) {
  return list.find(({ t }) => Math.abs(t - time_s) <= SAME_S);
}

/** The reasons that the report has; undefined if it has none of that moment. */
export function reasonsAt(machine, time_s) {
  const found = at(run.data.whys[machine] ?? [], time_s);
  return found && { type: "why", machine, time_s, lines: found.lines };
}

function why({ machine, time_s }) {
  const at_s = time_s ?? page.end_s;
  const text = `Why is in this report where ${machine || "a machine"} changes its state (← →), `
    + "at faults and violations (Shift ← →), and at the end.";
  const line = { text, depth: 1, role: "read", truth: null, place: null, name: null };
  return reasonsAt(machine, at_s) ?? { type: "why", machine, time_s: at_s, lines: [line] };
}

/** The part of a series in a window, and a point on both sides of it. */
function clipped({ t, lines, words }, begin_s, end_s) {
  const first = Math.max(0, t.findLastIndex((time_s) => time_s <= begin_s));
  const after = t.findIndex((time_s) => time_s >= end_s);
  const part = (list) => list.slice(first, after < 0 ? undefined : after + 1);
  return { t: part(t), lines: lines.map(part), words, begin_s, end_s };
}

function series({ name, time_s, window_s }) {
  const end_s = time_s === null ? page.end_s : time_s + window_s / 2;
  const begin_s = end_s - window_s;
  const around = run.data.incidents.map((one) => one.series[name]).filter(Boolean);
  const finer = around.find((one) => one.begin_s <= begin_s + 1e-9 && one.end_s >= end_s - 1e-9);
  const found = finer ?? run.data.series[name] ?? { t: [], lines: [], words: [] };
  return { type: "series", name, ...clipped(found, begin_s, end_s) };
}

const ANSWERS = {
  look: ({ time_s }) => ({ type: "moment", ...nearest(time_s ?? page.end_s) }),
  why,
  series,
};

page.send = (question) => {
  const { number } = run;
  const answer = ANSWERS[question.type];
  if (answer) {
    queueMicrotask(() => number === run.number && take({ ...answer(question), id: question.id }));
  }
};

/** Only moments of the report are looked at: of these it says what the page says. */
const look = page.look.bind(page);
page.look = (time_s) => look(time_s === null ? null : nearest(time_s).time_s);
