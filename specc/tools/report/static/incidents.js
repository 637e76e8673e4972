/** Faults and violations, each with the ten seconds around it, and why. */

import { reasonsAt, run } from "./answers.js";
import { AXIS, drawAxis, drawBands, layoutOf } from "./bands.js";
import { button, byId, dotted, html, seconds, svg } from "./dom.js";
import { plots } from "./plot.js";
import { on, page } from "./state.js";
import { listOf } from "./why.js";

const MOST_BANDS = 8;
const MOST_OPEN = 3;
/** That are open from the beginning. */
const NARROW = 600;
const WORDS = { fault: "Fault", violation: "Violated" };

let drawn = [];

function build() {
  const { incidents, more_incidents: more } = run.data;
  drawn = incidents.map(articleOf);
  const others = more ? [html("p", { class: "empty" }, `and ${more} more, not shown here`)] : [];
  byId("wrong").hidden = !incidents.length;
  byId("incidents").replaceChildren(...drawn.map(({ element }) => element), ...others);
}

function articleOf(incident, place) {
  const { time_s, kind, text } = incident;
  const stretch = html("div", { class: "stretch" });
  const lines = html("div", { class: "stretch-signals" });
  const words = `${seconds(time_s, page.digits)} ${WORDS[kind] ?? kind}`;
  const look = button("Look at it", `Show ${seconds(time_s, page.digits)} everywhere`, () => {
    page.look(time_s);
    if (incident.machines[0]) {
      page.choose(incident.machines[0]);
    }
  });
  const element = html(
    "details",
    { class: "incident", open: place < MOST_OPEN, ontoggle: drawAll },
    html("summary", {}, html("b", { class: "when" }, words), html("span", { class: "what" }, text)),
    stretch,
    html("div", { class: "halves" }, whyOf(incident), html("div", {}, look, lines, pictureOf(time_s))),
  );
  return { element, incident, stretch, lines };
}

/** What a requirement asked for and what came of it, and what the machines waited for. */
function whyOf({ time_s, requirement, machines }) {
  const words = requirement ? [
    html("p", { class: "because" }, requirement.because),
    ...(requirement.reasons ?? []).map((reason) => html("p", {}, reason)),
  ] : [];
  const lists = machines.map((machine) => reasonsAt(machine, time_s)).filter(Boolean);
  return html("div", { class: "reasons" }, ...words,
    ...lists.map((message) => html("div", { class: "why" }, ...listOf(message))));
}

/** The last picture until then. */
function pictureOf(time_s) {
  const before = run.data.pictures.filter((one) => one.time_s <= time_s + 1e-6);
  const last = before[before.length - 1];
  const words = last && `${last.camera} at ${seconds(last.time_s, page.digits)}`;
  return last
    ? html("figure", {}, html("img", { src: last.src, alt: words }), html("figcaption", {}, words))
    : null;
}

// The ten seconds around.

function drawAll() {
  drawn.filter(({ element }) => element.open).forEach(draw);
}

function draw({ incident, stretch, lines }) {
  const width = stretch.clientWidth;
  if (width < 100) {
    return;
  }
  const { time_s, series } = incident;
  const begin_s = Math.max(page.hello.begin_s, time_s - 5);
  const end_s = Math.max(begin_s + 0.1, Math.min(page.end_s, time_s + 5));
  const place = layoutOf(width, width < NARROW ? 92 : 204, [begin_s, end_s], true);
  const axis = svg("svg", { class: "axis", height: AXIS });
  const bands = svg("svg", { class: "bands" });
  drawAxis(axis, place, time_s);
  drawBands(bands, place, machinesOf(incident, begin_s, end_s), time_s);
  stretch.replaceChildren(axis, bands);
  lines.replaceChildren(...Object.entries(series).flatMap(([name, own]) => {
    const signal = page.hello.signals.find((one) => one.name === name);
    if (!own.lines.some((line) => line.some((value) => value !== null))) {
      return [];
    }
    const cut = { ...own, begin_s, end_s };
    const shown = signal?.components.length ? plots(signal, cut, time_s, lines.clientWidth) : [];
    return shown.length ? [html("p", { class: "name" }, ...dotted(name)), ...shown] : [];
  }));
}

/** The machines that it is about, and those that change their states then. */
function machinesOf({ machines }, begin_s, end_s) {
  const isMoving = ({ name }) =>
    (page.spans[name] ?? []).filter((one) => one[0] < end_s && one[1] > begin_s).length > 1;
  const isAbout = ({ name }) => machines.includes(name);
  return page.hello.machines.filter((one) => isAbout(one) || isMoving(one)).slice(0, MOST_BANDS);
}

on("now", () => {
  build();
  drawAll();
});
new ResizeObserver(drawAll).observe(byId("incidents"));
