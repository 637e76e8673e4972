/** Draws what happened over time: a band of states for each machine, the axis, and marks. */

import { hover, seconds, svg } from "./dom.js";
import { page, spanAt } from "./state.js";

const RIGHT = 14;
export const AXIS = 32;
const LETTER = 6.4;
const BOLD_LETTER = 7.4;
/** Width of a letter of labels, and of the name of the chosen machine, about. */
const NEAR = 2;
/** Pixels; marks of a kind that are closer are drawn as one. */
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

/**
 * Where things are: `x` of a time, and the height of bands.
 * @param {number} width
 * @param {number} left where the bands begin
 * @param {[number, number]} times_s what is seen
 * @param {boolean} isDense
 */
export function layoutOf(width, left, [begin_s, end_s], isDense) {
  const scale = (width - left - RIGHT) / (end_s - begin_s);
  const height = isDense ? 14 : 18;
  const x = (time_s) => left + (time_s - begin_s) * scale;
  const time = (at) => Math.max(begin_s, Math.min(end_s, begin_s + (at - left) / scale));
  const length = width - left - RIGHT;
  return { width, left, length, begin_s, end_s, scale, x, time, height, step: height + 3 };
}

/** The distance of ticks that leaves room for their labels. */
function tickOf(scale) {
  const least_s = 70 / scale;
  const power = 10 ** Math.floor(Math.log10(least_s));
  return power * (TICKS.find((tick) => tick * power >= least_s) ?? 10);
}

/** Ticks, marks and the cursor, over bands in the same layout. */
export function drawAxis(axis, place, time_s) {
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
  const cursor = x(time_s).toFixed(1);
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

/** The states of machines, and lines where something went wrong. */
export function drawBands(bands, place, machines, time_s) {
  const { width, x, begin_s, end_s, step } = place;
  const height = machines.length * step;
  const rows = machines.map((machine, row) => drawBand(machine, row * step, place, time_s));
  const bad = page.marks.filter((mark) => mark.kind === "fault" || mark.kind === "violation");
  const lines = bad
    .filter((mark) => mark.time_s >= begin_s && mark.time_s <= end_s)
    .map((mark) => svg("path", { class: "bad", d: `M${x(mark.time_s).toFixed(1)} 0V${height}` }));
  const cursor = svg("path", { class: "cursor", d: `M${x(time_s).toFixed(1)} 0V${height}` });
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

function drawBand(machine, y, place, time_s) {
  const { left, x, begin_s, end_s, height } = place;
  const spans = page.spans[machine.name] ?? [];
  const current = spanAt(machine.name, time_s);
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
