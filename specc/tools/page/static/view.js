/** What is seen of the plant: the scene in 3D, or the picture of a camera. */

import { byId, button, html, setText } from "./dom.js";
import { on, page } from "./state.js";

const SCENE = "3D";

/** The 3D view, once it is loaded; null where there is none. */
let scene = null;
let shown = "";
let drawn = null;
let address = "";

async function loadScene() {
  try {
    const { createScene } = await import("./scene.js");
    scene ??= createScene(byId("canvas"));
  } catch {
    return "The view in 3D could not be loaded.";
  }
  if (!scene.available) {
    return "This browser has no WebGL, so there is no view in 3D.";
  }
  const answer = await fetch(page.hello.scene);
  if (!answer.ok) {
    return "The scene could not be loaded.";
  }
  scene.load(await answer.json());
  drawn = null;
  drawScene();
  return "";
}

function views() {
  const { scene: url, cameras } = page.hello;
  return [...(url ? [SCENE] : []), ...cameras];
}

function choose(name) {
  shown = name;
  byId("canvas").hidden = name !== SCENE;
  byId("picture").hidden = name === SCENE || !address;
  for (const item of byId("views").querySelectorAll("[data-view]")) {
    item.setAttribute("aria-pressed", String(item.dataset.view === name));
  }
  page.watching = {
    ...page.watching, camera: name === SCENE || !name ? null : name, scene: name === SCENE,
  };
  page.send({ type: "watch", ...page.watching, machine: page.machine });
  say("");
}

function say(text) {
  byId("no-view").hidden = !text;
  setText(byId("no-view"), text);
}

async function build() {
  const names = views();
  byId("cards").classList.toggle("no-scene", names.length === 0);
  byId("scene").hidden = names.length === 0;
  const items = names.length < 2 ? [] : names.map((name) =>
    button(name, `Show ${name}`, () => choose(name), { "data-view": name }));
  byId("views").querySelectorAll("[data-view]").forEach((item) => item.remove());
  byId("views").prepend(...items);
  if (!names.length) {
    choose("");
    return;
  }
  choose(names.includes(shown) ? shown : names[0]);
  if (page.hello.scene) {
    const words = await loadScene();
    if (shown === SCENE) {
      byId("canvas").hidden = Boolean(words);
      say(words);
    }
  }
}

function drawScene() {
  const { poses, frames } = page.shown;
  if (scene?.available && poses && poses !== drawn) {
    drawn = poses;
    scene.poses(poses);
    if (frames) {
      scene.frames(frames);
    }
  }
}

/** Show a picture that came from a camera. */
export function showPicture(blob, { camera, time_s }) {
  if (camera !== shown) {
    return;
  }
  const picture = byId("picture");
  const before = address;
  address = URL.createObjectURL(blob);
  picture.src = address;
  picture.alt = `Camera ${camera} at ${time_s.toFixed(2)} s`;
  picture.hidden = false;
  picture.onload = () => URL.revokeObjectURL(before);
}

on("hello", build);
on("shown", drawScene);
new ResizeObserver(() => scene?.resize?.()).observe(byId("canvas"));
