/** The timeline: a band for each machine, marks, and the slider exactly under the bands. */

import { button, byId, hover, html, icon, seconds, setText, svg } from "./dom.js";
import { say } from "./notices.js";
import { on, page, spanAt, stateWords } from "./state.js";

const NARROW = matchMedia("(max-width: 699px)");
const RIGHT = 14;
const THUMB = 16;
/** Width of the slider's thumb, as in the style sheet: its middle goes over the bands. */
const AXIS = 32;
const LETTER = 6.4;
const BOLD_LETTER = 7.4;
/** Width of a letter of labels, and of the name of the chosen machine, about. */
const NEAR = 2;
/** Pixels; marks of a kind that are closer are drawn as one. */
const LOW = 800;
/** Of a window whose bands are narrow. */
const SHORTEST_S = 0.02;
/** Of what zooming shows. */
const TICKS = [1, 2, 5];
const WORDS = {
  fault: "fault", violation: "violated", disturbance: "disturbance", change: "changed",
  panel: "operator", cycle: "cycle", break: "stopped",
};
export const SHAPES = {
  fault: "M-4-4L4 4M4-4L-4 4",
  violation: "M0-5L5 0L0 5L-5 0Z",
  disturbance: "M-4.5-4H4.5L0 4Z",
  change: "M-3.5-3.5H3.5V3.5H-3.5Z",
  panel: "M-3.5-3.5H3.5V3.5H-3.5Z",
  cycle: "M0-5V5",
  break: "M-3-4.5V4.5M3-4.5V4.5",
};

/** What is seen while zoomed in; null for all. */
let view = null;
let is_asked = false;
let is_dragged = false;

const axis = svg("svg", { class: "axis", height: AXIS, role: "group", "aria-label": "Marks" });
const bands = svg("svg", { class: "bands", role: "list", "aria-label": "States over time" });
const scroll = html("div", { class: "scroll" }, bands);
const slider = html("input", {
  type: "range", class: "cursor", step: "any", min: 0, max: 1, value: 0, "aria-label": "Time",
});
const tools = html("div", { class: "tools", role: "toolbar", "aria-label": "Jumps and zoom" });
byId("timeline").append(axis, scroll, html("div", { class: "under" }, tools, slider));

function addTool(d, title, action) {
  tools.append(button(icon(d), title, action, { "aria-label": title }));
}

addTool("M4 3V13M13 3L6 8L13 13Z", "Previous fault or violation (Shift ←)", () => jumpMark(-1));
addTool("M11 3L5 8L11 13", "Previous transition of the machine (←)", () => jumpTransition(-1));
addTool("M5 3L11 8L5 13", "Next transition of the machine (→)", () => jumpTransition(1));
addTool("M12 3V13M3 3L10 8L3 13Z", "Next fault or violation (Shift →)", () => jumpMark(1));
addTool("M3 8H13", "Zoom out (−)", () => zoom(2));
addTool("M3 8H13M8 3V13", "Zoom in (+)", () => zoom(0.5));
addTool("M2 3V13M14 3V13M4 8H12M6 6L4 8L6 10M10 6L12 8L10 10", "All of the run (0)", showAll);

// What is seen.

function visible() {
  const begin_s = page.hello.begin_s;
  const end_s = Math.max(page.end_s, begin_s + 0.1);
  if (!view) {
    return [begin_s, end_s];
  }
  const length_s = view[1] - view[0];
  if (page.cursor === null && !page.isFile) {
    return [Math.max(begin_s, end_s - length_s), end_s]; // goes on with the run
  }
  return view;
}

/** Show a stretch of time that is `factor` times as long, around the cursor. */
export function zoom(factor, around_s = page.time_s) {
  const [begin_s, end_s] = visible();
  const whole_s = page.end_s - page.hello.begin_s;
  const length_s = Math.max(SHORTEST_S, (end_s - begin_s) * factor);
  if (length_s >= whole_s) {
    return showAll();
  }
  const middle_s = Math.max(begin_s, Math.min(end_s, around_s));
  const share = (middle_s - begin_s) / (end_s - begin_s);
  pan(middle_s - share * length_s, length_s);
}

export function showAll() {
  view = null;
  draw();
}

function pan(begin_s, length_s) {
  const first_s = Math.min(begin_s, page.end_s - length_s);
  const from_s = Math.max(page.hello.begin_s, first_s);
  view = [from_s, from_s + length_s];
  draw();
}

/** Keep the cursor in sight. */
function follow() {
  if (view && page.cursor !== null && (page.cursor < view[0] || page.cursor > view[1])) {
    const length_s = view[1] - view[0];
    pan(page.cursor - length_s / 2, length_s);
  }
}

// Jumps.

/** The next or previous of ascending times; undefined if there is none. */
function nextOf(times, direction) {
  const now_s = page.time_s;
  return direction > 0
    ? times.find((time_s) => time_s > now_s + 1e-6)
    : times.findLast((time_s) => time_s < now_s - 1e-6);
}

function jump(times, direction, what) {
  const time_s = nextOf(times, direction);
  if (time_s === undefined) {
    say(`There is no ${direction > 0 ? "later" : "earlier"} ${what}.`);
  } else {
    page.look(time_s);
  }
}

export function jumpTransition(direction) {
  const times = (page.spans[page.machine] ?? []).map((span) => span[0]);
  jump(times, direction, `transition of ${page.machine}`);
}

export function jumpMark(direction) {
  const bad = page.marks.filter((mark) => mark.kind === "fault" || mark.kind === "violation");
  jump(bad.map((mark) => mark.time_s), direction, "fault or violation");
}

// Drawing.

/** Where things are: `x` of a time, widths, and the height of bands. */
function layout() {
  const width = scroll.clientWidth;
  const left = NARROW.matches ? 92 : 204;
  const [begin_s, end_s] = visible();
  const scale = (width - left - RIGHT) / (end_s - begin_s);
  const is_dense = page.hello.machines.length > 7 || innerHeight < LOW;
  const height = is_dense ? 14 : 18;
  const x = (time_s) => left + (time_s - begin_s) * scale;
  const time = (at) => Math.max(begin_s, Math.min(end_s, begin_s + (at - left) / scale));
  return { width, left, begin_s, end_s, scale, x, time, height, step: height + 3 };
}

function draw() {
  if (!page.hello || !scroll.clientWidth) {
    return;
  }
  const place = layout();
  drawAxis(place);
  drawBands(place);
  placeSlider(place);
}

function drawLater() {
  if (!is_asked) {
    is_asked = true;
    requestAnimationFrame(() => {
      is_asked = false;
      draw();
    });
  }
}

/** The distance of ticks that leaves room for their labels. */
function tickOf(scale) {
  const least_s = 70 / scale;
  const power = 10 ** Math.floor(Math.log10(least_s));
  return power * (TICKS.find((tick) => tick * power >= least_s) ?? 10);
}

function drawAxis(place) {
  const { width, begin_s, end_s, scale, x } = place;
  const tick_s = tickOf(scale);
  const digits = Math.max(0, -Math.floor(Math.log10(tick_s) + 1e-9));
  const parts = [];
  for (let n = Math.ceil(begin_s / tick_s - 1e-9); n * tick_s <= end_s + 1e-9; n += 1) {
    const at = x(n * tick_s).toFixed(1);
    parts.push(svg("path", { class: "tick", d: `M${at} ${AXIS - 4}V${AXIS}` }));
    const text = `${(n * tick_s).toFixed(digits)} s`;
    parts.push(svg("text", { x: at, y: 11, "text-anchor": "middle" }, text));
  }
  const cursor = x(page.time_s).toFixed(1);
  parts.push(svg("path", { class: "cursor", d: `M${cursor} 16V${AXIS}` }));
  const visible = page.marks.filter(({ time_s }) => time_s >= begin_s && time_s <= end_s);
  const spot = ({ kind, time_s }) => `${kind} ${Math.round(x(time_s) / NEAR)}`;
  for (const marks of Map.groupBy(visible, spot).values()) {
    parts.push(drawMark(marks, x(marks[0].time_s)));
  }
  axis.setAttribute("width", width);
  axis.replaceChildren(...parts);
}

/** One mark for those of a kind that would cover each other; it tells of the first. */
function drawMark([mark, ...others], at) {
  const more = others.length ? `\nand ${others.length} more` : "";
  const what = WORDS[mark.kind] ?? mark.kind;
  const words = `${seconds(mark.time_s, page.digits)} ${what}: ${mark.text}${more}`;
  const element = svg(
    "g",
    { class: `mark ${mark.kind}`, role: "img", "aria-label": words },
    svg("rect", { x: -7, y: -8, width: 14, height: 16, class: "reach" }),
    svg("path", { d: SHAPES[mark.kind] ?? SHAPES.change }),
  );
  element.setAttribute("transform", `translate(${at.toFixed(1)} 21)`);
  element.addEventListener("pointermove", (event) => hover(event, words));
  element.addEventListener("pointerleave", (event) => hover(event, ""));
  element.addEventListener("click", () => page.look(mark.time_s));
  return element;
}

function drawBands(place) {
  const { width, x, begin_s, end_s, step } = place;
  const { machines } = page.hello;
  const height = machines.length * step;
  const rows = machines.map((machine, row) => drawBand(machine, row * step, place));
  const bad = page.marks.filter((mark) => mark.kind === "fault" || mark.kind === "violation");
  const lines = bad
    .filter((mark) => mark.time_s >= begin_s && mark.time_s <= end_s)
    .map((mark) => svg("path", { class: "bad", d: `M${x(mark.time_s).toFixed(1)} 0V${height}` }));
  const cursor = svg("path", { class: "cursor", d: `M${x(page.time_s).toFixed(1)} 0V${height}` });
  bands.setAttribute("width", width);
  bands.setAttribute("height", height);
  bands.replaceChildren(...rows, ...lines, cursor);
}

/** The visible spans of a machine: the place of the first, and of the first after them. */
function range(spans, begin_s, end_s) {
  let first = spans.findIndex((span) => (span[1] ?? Infinity) > begin_s);
  first = first < 0 ? spans.length : first;
  let after = first;
  while (after < spans.length && spans[after][0] < end_s) {
    after += 1;
  }
  return [first, after];
}

function drawBand(machine, y, place) {
  const { left, x, begin_s, end_s, height } = place;
  const spans = page.spans[machine.name] ?? [];
  const current = spanAt(machine.name, page.time_s);
  const errors = new Set(machine.states.filter((one) => one.is_error).map((one) => one.name));
  const is_chosen = machine.name === page.machine;
  const is_moving = machine.states.length > 1;
  const paths = { plain: "", error: "", same: "", lit: "" };
  const labels = [];
  const [first, after] = range(spans, begin_s, end_s);
  let drawn = -Infinity;
  for (let at = first; at < after; at += 1) {
    const span = spans[at];
    const from = x(Math.max(begin_s, span[0]));
    const until = x(Math.min(end_s, span[1] ?? page.end_s));
    const is_lit = span === current && is_moving;
    const is_error = errors.has(span[2]);
    if (until < drawn + 1 && !is_lit && !is_error) {
      continue; // less than a pixel, beside what is drawn already
    }
    const gap = until - from > 3 ? 1 : 0;
    const wide = Math.max(is_lit ? 2 : 1, until - from - gap);
    const is_same = is_chosen && is_moving && span[2] === current?.[2];
    const look = is_lit ? "lit" : is_error ? "error" : is_same ? "same" : "plain";
    paths[look] += `M${from.toFixed(1)} ${y}h${wide.toFixed(1)}v${height}h${(-wide).toFixed(1)}z`;
    drawn = Math.max(drawn, from + wide);
    const room = Math.floor((wide - 8) / LETTER);
    if (room >= 2) {
      const fits = span[2].length <= room;
      const text = fits ? span[2] : room > 3 ? `${span[2].slice(0, room - 1)}…` : "";
      labels.push(svg("text", { class: look, x: from + 5, y: y + height / 2 + 4 }, text));
    }
  }
  const since = current && `since ${seconds(current[0], page.digits)}`;
  const words = current ? `${machine.name} in ${current[2]} ${since}` : `${machine.name} in no state`;
  return svg(
    "g",
    { class: is_chosen ? "band chosen" : "band", role: "listitem", "aria-label": words },
    drawName(machine, y, place),
    ...Object.entries(paths)
      .filter(([, d]) => d)
      .map(([look, d]) => svg("path", { class: `span ${look}`, d })),
    ...labels,
    svg("rect", { class: "frame", x: left, y, width: x(end_s) - left, height }),
  );
}

function drawName({ name }, y, { left, height }) {
  const room = Math.floor((left - 24) / BOLD_LETTER);
  const text = name.length > room ? `…${name.slice(1 - room)}` : name;
  const place = { x: left - 10, y: y + height / 2 + 4, "text-anchor": "end" };
  return svg("text", { class: "name", ...place }, text);
}

function placeSlider({ left, width, begin_s, end_s }) {
  slider.min = begin_s;
  slider.max = end_s;
  if (!is_dragged) {
    slider.value = page.time_s;
  }
  slider.style.marginLeft = `${left - THUMB / 2}px`;
  slider.style.width = `${width - left - RIGHT + THUMB}px`;
  const state = page.shown.states[page.machine]?.state;
  const words = `${seconds(page.time_s, page.digits)}${state ? `, ${page.machine} ${state}` : ""}`;
  slider.setAttribute("aria-valuetext", words);
}

// The pointer and keys.

/** Look at a time; at the very end of a run, follow it again. */
function moveTo(time_s) {
  const is_end = time_s >= page.end_s - 1e-9;
  page.look(is_end && !page.isFile ? null : time_s);
}

function machineAt(event, { step }) {
  const row = Math.floor((event.clientY - bands.getBoundingClientRect().top) / step);
  return page.hello.machines[row];
}

function acrossOf(event) {
  return event.clientX - bands.getBoundingClientRect().left;
}

bands.addEventListener("pointerdown", (event) => {
  const place = layout();
  const machine = machineAt(event, place);
  if (machine) {
    page.choose(machine.name);
  }
  if (event.button === 0 && acrossOf(event) >= place.left - 4) {
    is_dragged = true;
    bands.setPointerCapture(event.pointerId);
    moveTo(place.time(acrossOf(event)));
  }
});
bands.addEventListener("pointermove", (event) => {
  const place = layout();
  const time_s = place.time(acrossOf(event));
  if (is_dragged) {
    moveTo(time_s);
  }
  const machine = machineAt(event, place);
  hover(event, machine ? wordsAt(machine, acrossOf(event) < place.left ? null : time_s) : "");
});
for (const name of ["pointerup", "pointercancel"]) {
  bands.addEventListener(name, () => (is_dragged = false));
}
bands.addEventListener("pointerleave", (event) => hover(event, ""));

function wordsAt(machine, time_s) {
  const span = time_s === null ? null : spanAt(machine.name, time_s);
  const late = page.now?.real_time?.[machine.name];
  const words = late ? `\n${late.late_ms.toFixed(1)} ms late, ${late.skipped} skipped` : "";
  if (!span) {
    return [machine.name, machine.title].filter(Boolean).join(" · ") + words;
  }
  const end_s = span[1] ?? page.end_s;
  const until = span[1] === null ? "now" : seconds(end_s, page.digits);
  const times = `${seconds(span[0], page.digits)} – ${until}`;
  const length = seconds(end_s - span[0], page.digits);
  return `${machine.name}: ${stateWords(machine, span[2])}\n${times}, ${length}`;
}

byId("timeline").addEventListener(
  "wheel",
  (event) => {
    const is_scrolled = scroll.scrollHeight > scroll.clientHeight + 1;
    const across = event.shiftKey ? event.deltaY : event.deltaX;
    const [begin_s, end_s] = visible();
    if (Math.abs(across) > Math.abs(event.shiftKey ? 0 : event.deltaY)) {
      if (view) {
        pan(begin_s + (across / 600) * (end_s - begin_s), end_s - begin_s);
      }
    } else if (event.ctrlKey || (!is_scrolled && !NARROW.matches)) {
      zoom(Math.exp(event.deltaY / 300), layout().time(acrossOf(event)));
    } else {
      return;
    }
    event.preventDefault();
  },
  { passive: false },
);

slider.addEventListener("input", () => {
  is_dragged = true;
  moveTo(Number(slider.value));
});
slider.addEventListener("change", () => (is_dragged = false));
slider.addEventListener("keydown", (event) => {
  const [begin_s, end_s] = visible();
  const page_s = (end_s - begin_s) / 20;
  const small_s = page.chosen?.period_s ?? page_s;
  const steps = {
    ArrowLeft: -small_s, ArrowDown: -small_s, ArrowRight: small_s, ArrowUp: small_s,
    PageDown: -page_s, PageUp: page_s, Home: -Infinity, End: Infinity,
  };
  if (event.key in steps && !event.shiftKey) {
    event.preventDefault();
    event.stopPropagation();
    moveTo(page.time_s + steps[event.key]);
  }
});

on("hello", () => {
  view = null;
  setText(bands, "");
  draw();
});
on("cursor", () => {
  follow();
  drawLater();
});
on("now spans marks machine shown", drawLater);
new ResizeObserver(drawLater).observe(scroll);
