/** A report: shows the run, the machine and the moment that its address names. */

import { open, run } from "./answers.js";
import { byId } from "./dom.js";
import "./runs.js";
import "./notices.js";
import "./requirements.js";
import "./why.js";
import "./signals.js";
import "./margins.js";
import "./incidents.js";
import "./pictures.js";
import { jumpMark, jumpTransition, showAll, zoom } from "./timeline.js";
import { page } from "./state.js";

/** What the address says: a run, and perhaps a machine and a time. */
function follow() {
  const words = new URLSearchParams(location.hash.slice(1));
  const number = Number(words.get("run") ?? 0);
  if (!byId(`run-${number}`)) {
    return;
  }
  const is_new = number !== run.number;
  if (is_new) {
    open(number);
  }
  const [first] = run.data.incidents;
  if (words.has("machine")) {
    page.choose(words.get("machine"));
  } else if (is_new && first?.machines.length) {
    page.choose(first.machines[0]);
  }
  if (words.has("t")) {
    page.look(Number(words.get("t")) || 0);
  } else if (is_new) {
    page.look(first?.time_s ?? page.end_s);
  }
  if (words.has("run")) {
    byId("cards").scrollIntoView({ behavior: "instant" });
  }
}

const KEYS = {
  ArrowLeft: ({ shiftKey }) => (shiftKey ? jumpMark(-1) : jumpTransition(-1)),
  ArrowRight: ({ shiftKey }) => (shiftKey ? jumpMark(1) : jumpTransition(1)),
  "+": () => zoom(0.5),
  "-": () => zoom(2),
  0: showAll,
};

document.addEventListener("keydown", (event) => {
  const action = KEYS[event.key];
  const is_modified = event.ctrlKey || event.altKey || event.metaKey;
  if (action && page.hello && !is_modified && !event.target.closest("input, select")) {
    event.preventDefault();
    action(event);
  }
});

addEventListener("hashchange", follow);
follow();
