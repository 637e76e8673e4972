/** Requirements: the verdict and the margin at the moment that is shown. */

import { breakpointButton } from "./breakpoints.js";
import { byId, html, number, placeOf, seconds, setText } from "./dom.js";
import { on, page } from "./state.js";

const SIGNS = { holds: "●", violated: "✕", open: "○", unknown: "–" };
const WORDS = { holds: "holds", violated: "violated", open: "open so far", unknown: "not known" };

let rows = [];

function build() {
  rows = page.hello.requirements.map((requirement) => {
    const sign = html("span", { class: "sign", "aria-hidden": "true" });
    const verdict = html("button", { type: "button", class: "verdict" });
    const margin = html("span", { class: "margin" });
    const { place } = requirement; // none where the specification cannot be read
    const constants = Object.entries(requirement.constants ?? {});
    const where = constants.map(([name, text]) => `${name} = ${text}`).join(", ");
    const reasons = html(
      "div",
      { class: "because reasons" },
      ...(requirement.reasons ?? []).map((reason) => html("div", {}, reason)),
    );
    const element = html(
      "article",
      { class: "requirement" },
      sign,
      html("div", { class: "that" }, requirement.that),
      where ? html("div", { class: "because where" }, `where ${where}`) : null,
      html("div", { class: "judged" }, verdict, margin, place ? placeOf(place) : null),
      requirement.because ? html("div", { class: "because" }, requirement.because) : null,
      reasons,
    );
    if (!page.isFile) {
      element.append(breakpointButton({ kind: "requirement", that: requirement.that }));
    }
    return { element, sign, verdict, margin, reasons };
  });
  byId("requirements").hidden = rows.length === 0;
  byId("cards").classList.toggle("no-requirements", rows.length === 0);
  byId("verdict-list").replaceChildren(...rows.map((row) => row.element));
  show();
}

/**
 * The verdict at the moment that is shown. A run knows of a violation some time after it; where its
 * mark is, the page says so already.
 */
function verdictOf({ that }, place) {
  const known = page.shown.requirements?.[place] ?? { verdict: "unknown", margin: null };
  const mark = page.marks.find(
    ({ kind, text, time_s }) =>
      kind === "violation" && text === that && time_s <= page.time_s + 1e-9,
  );
  const is_late = mark && known.verdict !== "violated";
  return is_late ? { verdict: "violated", margin: null, time_s: mark.time_s } : known;
}

function show() {
  let violated = 0;
  rows.forEach(({ element, sign, verdict, margin, reasons }, place) => {
    const found = verdictOf(page.hello.requirements[place], place);
    violated += found.verdict === "violated" ? 1 : 0;
    element.className = `requirement is-${found.verdict}`;
    reasons.hidden = found.verdict !== "violated" || !reasons.hasChildNodes();
    setText(sign, SIGNS[found.verdict]);
    const at_s = found.time_s ?? null;
    const is_dated = found.verdict === "violated" && at_s !== null;
    const at = is_dated ? ` at ${seconds(at_s, page.digits)}` : "";
    setText(verdict, WORDS[found.verdict] + at);
    verdict.disabled = !is_dated;
    verdict.title = is_dated ? "Look at this time" : "";
    verdict.onclick = () => page.look(at_s);
    setText(margin, found.margin === null ? "" : `margin ${number(found.margin)}`);
  });
  const words = violated ? `${violated} of ${rows.length} violated` : "";
  setText(byId("verdicts"), words);
}

on("hello breakpoints", () => page.hello && build());
on("shown marks", show);
