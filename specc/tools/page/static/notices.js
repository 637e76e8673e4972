/** What is wrong with the recording, lost connections, stops, and commands that were refused. */

import { button, byId, html, seconds } from "./dom.js";
import { on, page } from "./state.js";

const SHOWN_MS = 7000;
const MOST = 4;

/** Say something that goes away by itself, unless the pointer is on it. */
export function say(text, is_bad = false) {
  const toasts = byId("toasts");
  for (const other of toasts.children) {
    if (other.firstChild.textContent === text) {
      other.remove();
    }
  }
  const toast = html("div", { class: is_bad ? "toast bad" : "toast" }, html("span", {}, text));
  let timer = 0;
  const wait = () => {
    timer = setTimeout(() => toast.remove(), SHOWN_MS);
  };
  toast.append(button("×", "Dismiss", () => toast.remove(), { "aria-label": "Dismiss" }));
  toast.addEventListener("pointerenter", () => clearTimeout(timer));
  toast.addEventListener("pointerleave", wait);
  toasts.append(toast);
  while (toasts.children.length > MOST) {
    toasts.firstChild.remove();
  }
  wait();
}

function showNotices() {
  const texts = page.connected
    ? (page.hello?.notice ?? [])
    : ["The connection is lost; what is shown is the last that came. Trying again…"];
  byId("notices").replaceChildren(
    ...texts.map((text) => {
      const notice = html("p", { class: "notice", role: "status" }, html("span", {}, text));
      notice.append(button("×", "Dismiss", () => notice.remove(), { "aria-label": "Dismiss" }));
      return notice;
    }),
  );
}

on("hello connection", showNotices);
on("end", ({ ended, exit_code }) => {
  const words = `The run has ended: ${ended}, exit code ${exit_code}.`;
  say(page.restarting ? "The run is started again…" : words);
});
on("hello refused", () => {
  page.restarting = false;
  page.starting = "";
});
on("refused", (message) => say(message.text, true));

/** Why the run stopped; it is said with the time, which comes next. */
let reason = "";
on("stopped", (message) => {
  reason = page.stepping ? "" : message.why;
  page.stop_reason = "";
  page.stepping = false;
});
on("now", (message) => {
  if (reason && message.status === "paused") {
    say(`Stopped at ${seconds(message.time_s, page.digits)}: ${reason}`);
    page.stop_reason = reason;
    reason = "";
  } else if (message.status === "running") {
    page.stop_reason = "";
  }
});
