/** The page of a run: connects to the server, and hands its messages to the cards. */

import { button, byId, icon } from "./dom.js";
import { Connection } from "./protocol.js";
import { emit, on, page, take } from "./state.js";
import "./notices.js";
import "./machine.js";
import "./structure.js";
import "./why.js";
import "./signals.js";
import "./requirements.js";
import "./timeline.js";
import "./control.js";
import "./panel.js";
import { showPicture } from "./view.js";

// One card may fill the place of all.

const CORNERS = "M10 3H13V6M13 3L9.5 6.5M6 13H3V10M3 13L6.5 9.5";

function enlarge(card, is_large) {
  for (const other of document.querySelectorAll(".card.large")) {
    other.classList.remove("large");
  }
  card?.classList.toggle("large", is_large);
  byId("cards").classList.toggle("has-large", is_large);
}

for (const card of document.querySelectorAll(".card")) {
  const title = card.querySelector("h2").textContent;
  const words = `Enlarge ${title}, or leave it`;
  const action = () => enlarge(card, !card.matches(".large"));
  const toggle = button(icon(CORNERS), words, action, { class: "enlarge", "aria-label": words });
  card.querySelector("header .tools").append(toggle);
}
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    enlarge(null, false);
  }
});

// The moment that is looked at stands in the address, so that it can be found again.

function fromAddress() {
  const words = new URLSearchParams(location.hash.slice(1));
  if (words.has("machine")) {
    page.choose(words.get("machine"));
  }
  const time_s = Number(words.get("t") ?? NaN);
  return Number.isFinite(time_s) ? time_s : null;
}

let timer = 0;
function toAddress() {
  clearTimeout(timer);
  timer = setTimeout(() => {
    const time = page.cursor === null ? {} : { t: page.cursor.toFixed(page.digits) };
    const words = new URLSearchParams({ machine: page.machine, ...time });
    history.replaceState(null, "", `#${words}`);
  }, 300);
}

/** A recording opens where it went wrong, if it did. */
function firstLook(marks) {
  const all = marks.filter((mark) => mark.kind === "fault" || mark.kind === "violation");
  const bad = all.find((mark) => mark.time_s > page.hello.begin_s) ?? all[0];
  if (bad && page.isFile && page.cursor === null) {
    page.look(bad.time_s);
  }
}

/** Whether a time was chosen. While a recording is read, what went wrong may be still to come. */
let has_looked = false;
on("hello", () => {
  has_looked &&= page.cursor === null; // a moment that was shown is asked for again
});
on("now", () => {
  if (has_looked) {
    return;
  }
  const time_s = fromAddress();
  has_looked = !page.isFile;
  if (time_s === null) {
    firstLook(page.marks);
  } else {
    page.look(time_s);
  }
});
on("cursor", () => {
  has_looked = true;
});
on("cursor machine", toAddress);

const connection = new Connection(
  take,
  showPicture,
  (is_open) => {
    page.connected = is_open;
    emit("connection");
  },
);
page.send = (message) => connection.send(message);
