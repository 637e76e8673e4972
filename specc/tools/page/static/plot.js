/** The plot of a signal in a window of time: lines of numbers, steps of words, the cursor. */

import { html, number, svg } from "./dom.js";

const HEIGHT = 54;
const TOP = 4;
const LEFT = 52;
const RIGHT = 6;
const PAD = 3;
/** Between lines and the edge of their area. */

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

/** The path of a line; steps where values are words, gaps where there is none. */
function pathOf(t, line, x, y, is_stepped) {
  let path = "";
  let is_inside = false;
  line.forEach((value, place) => {
    if (value === null) {
      is_inside = false;
      return;
    }
    const [across, down] = [x(t[place]).toFixed(1), y(value).toFixed(1)];
    const onwards = is_stepped ? `H${across}V${down}` : `L${across} ${down}`;
    path += is_inside ? onwards : `M${across} ${down}`;
    is_inside = true;
  });
  return path;
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
      const path = pathOf(series.t, line, x, y, words.length > 0);
      area.append(svg("path", { class: `line line-${at % 6}`, d: path }));
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
  const short = text.length > 9 ? `${text.slice(0, 8)}…` : text;
  return svg("text", { x: LEFT - 4, y: y + 3.5, "text-anchor": "end" }, short);
}
