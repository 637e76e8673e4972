/** What cameras saw when machines changed their states; a picture leads to its moment. */

import { run } from "./answers.js";
import { byId, html, seconds } from "./dom.js";
import { on, page } from "./state.js";

const MOST_NAMED = 3;
/** Moments below a picture. */

function figureOf({ camera, time_s, at, src }) {
  const words = `${camera} at ${seconds(time_s, page.digits)}`;
  const picture = html("img", { src, alt: words, loading: "lazy" });
  const moments = at.slice(0, MOST_NAMED).map((one) => {
    const text = `${seconds(one.time_s, page.digits)} ${one.text}`;
    const onclick = () => page.look(one.time_s);
    return html("button", { type: "button", title: "Look at this time", onclick }, text);
  });
  const more = at.length > MOST_NAMED ? [html("p", {}, `and ${at.length - MOST_NAMED} more`)] : [];
  return html("figure", {}, picture, html("figcaption", {}, words, ...moments, ...more));
}

on("hello", () => {
  byId("pictures").hidden = !run.data.pictures.length;
  byId("frames").replaceChildren(...run.data.pictures.map(figureOf));
});
