/** The timeline: a band for each machine, marks, and the slider exactly under the bands. */

import { AXIS, drawAxis, drawBands, layoutOf } from "./bands.js";
import { button, byId, hover, html, icon, seconds, setText, svg } from "./dom.js";
import { say } from "./notices.js";
import { on, page, spanAt, stateWords } from "./state.js";

const NARROW = matchMedia("(max-width: 699px)");
const THUMB = 16;
/** Width of the slider's thumb, as in the style sheet: its middle goes over the bands. */
const LOW = 800;
/** Of a window whose bands are narrow. */
const SHORTEST_S = 0.02;
/** Of what zooming shows. */

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

function layout() {
  const width = scroll.clientWidth;
  const left = NARROW.matches ? 92 : 204;
  const isDense = page.hello.machines.length > 7 || innerHeight < LOW;
  return layoutOf(width, left, visible(), isDense);
}

function draw() {
  if (!page.hello || !scroll.clientWidth) {
    return;
  }
  const place = layout();
  drawAxis(axis, place, page.time_s);
  drawBands(bands, place, page.hello.machines, page.time_s);
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

function placeSlider({ left, length, begin_s, end_s }) {
  slider.min = begin_s;
  slider.max = end_s;
  if (!is_dragged) {
    slider.value = page.time_s;
  }
  slider.style.marginLeft = `${left - THUMB / 2}px`;
  slider.style.width = `${length + THUMB}px`;
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
