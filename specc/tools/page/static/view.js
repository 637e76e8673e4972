/** What is seen of the plant: the scene in 3D, or the picture of a camera. */

import { button, byId, html, setText } from "./dom.js";
import { FrameChooser } from "./frames.js";
import { createScene } from "./scene.js";
import { askValues, on, page } from "./state.js";

const SCENE = "3D";
const BETWEEN_MS = 100;
/** Between two questions for poses, while the page follows a run. */

const dark = matchMedia("(prefers-color-scheme: dark)");
/** The 3D view, once there has been a scene. */
let scene = null;
/** @type {FrameChooser|null} */
let chooser = null;
let shown = "";
let drawn = { poses: null, frames: null };
let address = "";
let asked_ms = 0;
let troubles = [];

const view = document.querySelector("#scene .view");
const select = html("select", {
  "aria-label": "What is shown",
  onchange: () => choose(select.value),
});
const frames = html("div", { class: "frames-box", id: "frames-box", hidden: true });
const notice = html("p", { class: "scene-notice", role: "status", hidden: true });
const toggle = button("Frames", "Show poses as coordinate frames", openFrames, {
  "aria-expanded": "false",
  "aria-controls": "frames-box",
});
const home = button("⌂", "Back to the first view (Home)", () => scene?.reset(), {
  "aria-label": "Back to the first view",
});
byId("views").prepend(select, toggle, home);
view.append(frames, notice);

function openFrames() {
  showFrames(frames.hidden);
}

function showFrames(is_open) {
  frames.hidden = !is_open;
  toggle.setAttribute("aria-expanded", String(is_open));
}

/** Load the scene of a run; what is to be said instead, if it cannot be shown. */
async function loadScene() {
  scene ??= createScene(byId("canvas"), { dark: dark.matches, onNotice: (text) => trouble(text) });
  if (!scene.available) {
    return scene.text;
  }
  const hello = page.hello;
  const answer = await fetch(hello.scene).catch(() => null);
  if (page.hello !== hello) {
    return "";
  }
  if (!answer?.ok) {
    return "The scene could not be loaded.";
  }
  troubles = [];
  notice.hidden = true;
  try {
    scene.load(await answer.json(), hello.bodies);
  } catch {
    return "The scene cannot be read.";
  }
  drawn = { poses: null, frames: null };
  drawScene();
  return "";
}

/** Say what of a scene cannot be shown. */
function trouble(text) {
  if (!troubles.includes(text)) {
    troubles.push(text);
  }
  setText(notice, troubles.slice(0, 4).join(" "));
  notice.hidden = false;
}

function choose(name) {
  shown = name;
  const is_scene = name === SCENE;
  select.value = name;
  byId("canvas").hidden = !is_scene;
  forgetPicture();
  toggle.hidden = !is_scene || !page.hello.poses.length;
  home.hidden = !is_scene;
  showFrames(is_scene && !frames.hidden);
  tellServer();
  say(is_scene || !name ? "" : "There is no picture yet.");
}

function tellServer() {
  const is_scene = shown === SCENE;
  const camera = is_scene || !shown ? null : shown;
  const poses = is_scene ? (chooser?.wanted ?? []) : [];
  page.watching = { ...page.watching, camera, scene: is_scene, frames: poses };
  page.send({ type: "watch", ...page.watching, machine: page.machine });
  askValues();
}

function say(text) {
  byId("no-view").hidden = !text;
  setText(byId("no-view"), text);
}

async function build() {
  const { scene: url, cameras, poses, bodies, carriers = {}, system } = page.hello;
  const names = [...(url ? [SCENE] : []), ...cameras];
  byId("cards").classList.toggle("no-scene", names.length === 0);
  byId("scene").hidden = names.length === 0;
  select.hidden = names.length < 2;
  select.replaceChildren(...names.map((name) => html("option", { value: name }, name)));
  frames.replaceChildren();
  const changed = () => {
    drawn.frames = null;
    tellServer();
    drawScene();
  };
  chooser = new FrameChooser(frames, { poses, bodies, carriers, system, changed });
  choose(names.includes(shown) ? shown : (names[0] ?? ""));
  if (url) {
    const words = await loadScene();
    if (shown === SCENE) {
      byId("canvas").hidden = Boolean(words);
      say(words);
    }
  }
}

function drawScene() {
  const { poses, frames: values } = page.shown;
  if (!scene?.available || shown !== SCENE) {
    return;
  }
  if (poses && poses !== drawn.poses) {
    scene.poses(poses);
  }
  if (poses !== drawn.poses || values !== drawn.frames) {
    scene.frames(chooser?.frames(values ?? {}, poses) ?? []);
  }
  drawn = { poses, frames: values };
}

/** While the page follows a run, ask for the poses that are drawn. */
function follow() {
  const now_ms = performance.now();
  if (page.cursor === null && page.watching.frames?.length && now_ms - asked_ms > BETWEEN_MS) {
    asked_ms = now_ms;
    askValues();
  }
}

function forgetPicture() {
  byId("picture").hidden = true;
  byId("picture").removeAttribute("src");
  URL.revokeObjectURL(address);
  address = "";
}

/** Show a picture that came from a camera. */
export function showPicture(blob, { camera, time_s }) {
  if (camera !== shown) {
    return;
  }
  const picture = byId("picture");
  const before = address;
  address = URL.createObjectURL(blob);
  picture.onload = () => URL.revokeObjectURL(before);
  picture.onerror = () => {
    forgetPicture();
    say("This picture cannot be shown.");
  };
  picture.src = address;
  picture.alt = `Camera ${camera} at ${time_s.toFixed(2)} s`;
  picture.hidden = false;
  say("");
}

document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    showFrames(false);
  }
});
on("hello", build);
on("shown", drawScene);
on("now", follow);
dark.addEventListener("change", () => scene?.setTheme(dark.matches));
