/** The plot of a signal in a window of time: lines of numbers, steps of words, the cursor. */

import { html, number, svg } from "./dom.js";
import { page } from "./state.js";

const HEIGHT = 54;
const TOP = 4;
const LEFT = 58;
const RIGHT = 6;
const PAD = 3;
/** Between lines and the edge of their area. */
const BETWEEN_S = 0.1;
/** Between states that a run at speed 1 sends to a page that is open. */
const LEAST_GAP_S = 0.5;
const SPARSE =
  "Points without a line: the run sent its states once a second until the page was opened.";

/**
 * Components that share an axis: those of one unit; each with its number.
 * @param {import("./protocol.js").Component[]} components
 */
function axes(components) {
  const found = new Map();
  components.forEach((component, place) => {
    const key = component.words.length ? `words ${place}` : component.unit;
    found.set(key, [...(found.get(key) ?? []), { ...component, place }]);
  });
  return [...found.values()];
}

function extent(lines) {
  let least = Infinity;
  let greatest = -Infinity;
  for (const line of lines) {
    for (const value of line) {
      if (value !== null) {
        least = Math.min(least, value);
        greatest = Math.max(greatest, value);
      }
    }
  }
  return least > greatest ? null : [least, greatest];
}

/** Samples of a run that are further apart than this have no line between them. */
function leastGap_s(t) {
  if (page.isFile) {
    return Infinity;
  }
  const apart = t.slice(1).map((time_s, place) => time_s - t[place]);
  const usual_s = apart.sort((a, b) => a - b)[apart.length >> 2] ?? 0;
  const wanted_s = BETWEEN_S * Math.max(1, page.now?.factor ?? 1);
  return Math.max(LEAST_GAP_S, 3 * Math.min(usual_s, wanted_s));
}

/**
 * The path of a line, and that of points beside which there is none: steps where values are words,
 * gaps where there is no value.
 */
function pathsOf(t, line, x, y, is_stepped) {
  const gap_s = is_stepped ? Infinity : leastGap_s(t);
  let [path, points] = ["", ""];
  let before = -1;
  line.forEach((value, place) => {
    if (value === null) {
      return;
    }
    const [across, down] = [x(t[place]).toFixed(1), y(value).toFixed(1)];
    const onwards = is_stepped ? `H${across}V${down}` : `L${across} ${down}`;
    const is_near = (other) => Math.abs(t[place] - t[other]) <= gap_s;
    path += before === place - 1 && place > 0 && is_near(before) ? onwards : `M${across} ${down}`;
    if (![place - 1, place + 1].every((other) => t[other] === undefined || is_near(other))) {
      points += `M${across} ${down}h0`;
    }
    before = place;
  });
  return [path, points];
}

/**
 * @param {import("./protocol.js").Signal} signal
 * @param {import("./protocol.js").Series} series
 * @param {number} cursor_s
 * @param {number} width
 * @returns {Element[]} a picture for each axis
 */
export function plots(signal, series, cursor_s, width) {
  return axes(signal.components).map((parts) => {
    const lines = parts.map((part) => series.lines[part.place] ?? []);
    const picture = draw(parts, lines, series, cursor_s, width);
    const is_turn = signal.kind === "pose" && parts[0].name === "rx";
    return html("div", { class: "plot" }, picture, legend(parts, is_turn ? " axis·angle" : ""));
  });
}

function legend(parts, more) {
  if (parts.length < 2) {
    return null;
  }
  const items = parts.map((part, at) =>
    html("span", { class: `key line-${at % 6}` }, part.name.replace(/^\[(.*)\]$/, "$1")),
  );
  return html("div", { class: "legend" }, ...items, html("span", {}, parts[0].unit + more));
}

function draw(parts, lines, series, cursor_s, width) {
  const range = extent(lines);
  const [words] = parts.map((part) => part.words);
  const picture = svg("svg", { width, height: HEIGHT, role: "img", "aria-hidden": "true" });
  const { begin_s, end_s } = series;
  const across = width - LEFT - RIGHT;
  const x = (time_s) => ((time_s - begin_s) / (end_s - begin_s)) * across;
  const area = svg("svg", { x: LEFT, width: across, height: HEIGHT });
  area.append(svg("rect", { class: "area", y: TOP, width: across, height: HEIGHT - 2 * TOP }));
  picture.append(area);
  if (range) {
    const [least, greatest] = words.length ? [0, words.length - 1] : range;
    const pad = greatest === least ? Math.max(Math.abs(least) * 0.05, 1e-9) : 0;
    const [low, high] = [least - pad, greatest + pad];
    const down = HEIGHT - 2 * (TOP + PAD);
    const y = (value) => TOP + PAD + ((high - value) / (high - low)) * down;
    for (const [at, line] of lines.entries()) {
      const [path, points] = pathsOf(series.t, line, x, y, words.length > 0);
      area.append(svg("path", { class: `line line-${at % 6}`, d: path }));
      if (points) {
        const title = svg("title", {}, SPARSE);
        area.append(svg("path", { class: `line points line-${at % 6}`, d: points }, title));
      }
    }
    const ends = greatest === least ? [least] : [least, greatest];
    for (const value of words.length > 2 ? words.keys() : ends) {
      picture.append(label(words.length ? words[value] : number(value, 3), y(value)));
    }
  }
  if (cursor_s >= begin_s && cursor_s <= end_s + 1e-9) {
    const at = x(cursor_s).toFixed(1);
    area.append(svg("path", { class: "cursor", d: `M${at} ${TOP}V${HEIGHT - TOP}` }));
  }
  return picture;
}

function label(text, y) {
  const short = text.length > 10 ? `${text.slice(0, 9)}…` : text;
  return svg("text", { x: LEFT - 4, y: y + 3.5, "text-anchor": "end" }, short);
}
