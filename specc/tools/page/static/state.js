/** What the page knows: the run, the moment that is shown, what is chosen; and who is told. */

import { digitsOf } from "./dom.js";

const LOST_MS = 1500;
/** After so long an answer is not waited for any more. */
const MOST_SPANS = 20000;
const MOST_MARKS = 5000;
/** Of a machine, and of a run, that are kept, as the server does. */

const listeners = new Map();

/** Call `action` whenever something of that name happened. */
export function on(names, action) {
  for (const name of names.split(" ")) {
    listeners.set(name, [...(listeners.get(name) ?? []), action]);
  }
}

/** Say that something happened. */
export function emit(name, value) {
  for (const action of listeners.get(name) ?? []) {
    action(value);
  }
}

/** Connections that were made or lost: what one was asked, another does not answer. */
let connections = 0;
on("connection", () => {
  connections += 1;
});

/** A question of which at most one is on its way, and after it only the newest. */
export class Question {
  constructor(type) {
    this.type = type;
    this.id = 0;
    this.next = null;
    this.sent_ms = -Infinity;
    this.asked_of = 0;
  }

  ask(message) {
    if (this.asked_of === connections && performance.now() - this.sent_ms < LOST_MS) {
      this.next = message;
      return;
    }
    this.id += 1;
    this.asked_of = connections;
    this.sent_ms = performance.now();
    page.send({ type: this.type, id: this.id, ...message });
  }

  /** Whether a message answers the last question; then the next one is asked. */
  answers(message) {
    if (message.id !== this.id) {
      return false;
    }
    this.sent_ms = -Infinity;
    const next = this.next;
    this.next = null;
    if (next) {
      this.ask(next);
    }
    return true;
  }
}

const looking = new Question("look");

export const page = {
  /** @type {import("./protocol.js").Hello|null} */
  hello: null,
  /** @type {import("./protocol.js").Now|null} */
  now: null,
  /** What is shown: parts of a `now` or `moment` message. */
  shown: { time_s: 0, states: {}, values: {}, requirements: [], poses: null, flow: [] },
  /** The time that is looked at; null while the page follows the run or shows the end. */
  cursor: null,
  machine: "",
  /** How a run ended. @type {import("./protocol.js").End|null} */
  end: null,
  /** @type {Object<string, import("./protocol.js").Span[]>} */
  spans: {},
  /** @type {import("./protocol.js").Mark[]} */
  marks: [],
  /** @type {import("./protocol.js").Breakpoint[]} */
  breakpoints: [],
  controls: false,
  clients: 1,
  connected: false,
  playing: false,
  stepping: false,
  /** Which breakpoint a run that is paused has come to; "" without one. */
  stop_reason: "",
  /** Whether this page has asked for another run, and what is said of one that begins. */
  restarting: false,
  starting: "",
  digits: 2,
  send: () => {},

  get isFile() {
    return this.hello?.source === "file";
  },

  /** Where the timeline ends. */
  get end_s() {
    return Math.max(this.now?.time_s ?? 0, this.hello?.end_s ?? 0, this.hello?.begin_s ?? 0);
  },

  get time_s() {
    return this.cursor ?? this.now?.time_s ?? 0;
  },

  /** Why a control cannot be used; "" if it can. */
  refusal(ability) {
    if (!this.connected) {
      return "the page is not connected";
    }
    if (!this.hello.can[ability]) {
      const real = this.hello.real_time ? "in real time" : "here";
      return `this cannot be done ${this.isFile ? "with a recording" : real}`;
    }
    if (!this.controls) {
      return "another page controls this run; take control first";
    }
    return this.now?.status === "ended" && ability !== "restart" ? "the run has ended" : "";
  },

  /** Look at a time, or follow the run with null. */
  look(time_s) {
    const begin_s = this.hello.begin_s;
    const at_s = time_s === null ? null : Math.max(begin_s, Math.min(this.end_s, time_s));
    this.cursor = at_s;
    looking.ask({ time_s: at_s });
    showSpans();
    emit("cursor");
    emit("shown");
  },

  choose(machine) {
    if (machine !== this.machine && this.hello.machines.some((one) => one.name === machine)) {
      this.machine = machine;
      emit("machine");
    }
  },

  /** @returns {import("./protocol.js").Machine|undefined} */
  get chosen() {
    return this.hello.machines.find((one) => one.name === this.machine);
  },
};

/** The span of a machine at a time. */
export function spanAt(machine, time_s) {
  const spans = page.spans[machine] ?? [];
  let low = 0;
  let high = spans.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (spans[middle][0] <= time_s + 1e-9) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return spans[low - 1] ?? null;
}

/** A state for readers: `S2 Execute position-force control`. */
export function stateWords(machine, name) {
  const state = machine?.states.find((one) => one.name === name);
  return state?.title && state.title !== name ? `${name} · ${state.title}` : name;
}

/** Show the states at the cursor that the spans have; the answer of the server says more. */
function showSpans() {
  const { shown, time_s } = page;
  shown.time_s = time_s;
  for (const machine of Object.keys(page.spans)) {
    const span = spanAt(machine, time_s);
    const before = shown.states[machine];
    const is_since = before && span && before.since_s >= span[0] && before.since_s <= time_s;
    const isKnown = span && (span[1] === null || time_s <= span[1] + 1e-9 || time_s >= page.end_s);
    if (!isKnown) {
      delete shown.states[machine];
    } else if (!is_since || before.state !== span[2]) {
      shown.states[machine] = { state: span[2], since_s: span[0], row: "" };
    }
  }
}

/** Ask for the values of now; a page that follows gets states by themselves. */
export function askValues() {
  looking.ask({ time_s: page.cursor });
}

function takeHello(message) {
  const is_same = page.hello?.system === message.system;
  page.hello = message;
  page.controls = message.controls;
  page.now = null;
  page.end = message.end ?? null;
  page.cursor = is_same && page.isFile ? page.cursor : null; // after a lost connection
  page.playing = false;
  page.stepping = false;
  page.stop_reason = "";
  page.spans = {};
  page.marks = [];
  page.shown = { time_s: message.begin_s, states: {}, values: {}, requirements: [], poses: null };
  page.shown.flow = [];
  const periods = message.machines.map((machine) => machine.period_s);
  page.digits = Math.max(2, ...periods.map(digitsOf));
  if (!is_same || !page.chosen) {
    const most = message.machines.toSorted((a, b) => b.states.length - a.states.length)[0];
    page.machine = most?.name ?? "";
  }
}

function takeNow(message) {
  page.now = { ...page.now, ...message }; // it has what is new
  for (const [machine, { state }] of Object.entries(page.now.states)) {
    page.spans[machine] ??= [[page.hello.begin_s, null, state]]; // it has not changed yet
  }
  if (page.cursor !== null) {
    return;
  }
  const { time_s, states, flow, poses, requirements } = page.now;
  Object.assign(page.shown, { time_s, states: { ...states }, flow, poses, requirements });
}

function takeMoment(message) {
  if (!looking.answers(message)) {
    return false;
  }
  if (page.cursor === null) {
    page.shown.values = message.values;
    page.shown.frames = message.frames;
    page.shown.requirements = message.requirements ?? page.shown.requirements;
  } else {
    Object.assign(page.shown, message);
  }
  return true;
}

function takeSpans({ spans, replace }) {
  page.spans = replace ? {} : page.spans;
  for (const [machine, more] of Object.entries(spans)) {
    const own = page.spans[machine] ?? [];
    for (const span of more) {
      const last = own[own.length - 1];
      if (last && last[0] === span[0]) {
        own.pop();
      } else if (last && last[1] === null) {
        last[1] = span[0];
      }
      own.push(span);
    }
    page.spans[machine] = own.slice(-MOST_SPANS);
  }
}

function takeMarks({ marks, replace }) {
  const all = replace ? marks : [...page.marks, ...marks];
  page.marks = all.sort((a, b) => a.time_s - b.time_s).slice(-MOST_MARKS);
}

/** Take a message of the server and say what happened. */
export function take(message) {
  switch (message.type) {
    case "hello":
      takeHello(message);
      break;
    case "now":
      takeNow(message);
      break;
    case "moment":
      if (!takeMoment(message)) {
        return;
      }
      break;
    case "spans":
      takeSpans(message);
      break;
    case "marks":
      takeMarks(message);
      break;
    case "end":
      page.end = message;
      break;
    case "control":
      page.controls = message.controls;
      page.clients = message.clients;
      break;
    case "breakpoints":
      page.breakpoints = message.breakpoints;
      break;
  }
  emit(message.type, message);
  if (message.type === "moment" || (message.type === "now" && page.cursor === null)) {
    emit("shown");
  }
}
