/**
 * The scene of a plant in 3D: bodies where they are, coordinate frames, a ground grid.
 *
 * It draws only when something has changed, at most 20 times a second and less often where drawing
 * takes long. Where the browser has no WebGL2, `available` is false and all calls do nothing.
 */
import {
  along,
  checkedPose,
  composePose,
  difference,
  IDENTITY_POSE,
  lookAt,
  multiplied,
  perspective,
  transformed,
} from "./geometry.js";
import { control, Orbit, scrolls } from "./orbit.js";
import { lightMatrix, Painter } from "./painter.js";
import { makers, partsOf } from "./parts.js";

export { composePose } from "./geometry.js";

const PERIOD_MS = 50;
const SLOW_MS = 40;
const MOST_PIXELS = 2048;
const MANY_PARTS = 500;
const MOST_FRAMES = 50;
const TRIAD_PIXELS = 56;
const AXES = [
  { colour: [0.84, 0.27, 0.24, 1], turn: [Math.SQRT1_2, 0, Math.SQRT1_2, 0] },
  { colour: [0.24, 0.62, 0.3, 1], turn: [Math.SQRT1_2, -Math.SQRT1_2, 0, 0] },
  { colour: [0.22, 0.45, 0.85, 1], turn: [1, 0, 0, 0] },
];
const THEMES = {
  light: { background: [0.953, 0.961, 0.969], line: [0.3, 0.34, 0.4] },
  dark: { background: [0.086, 0.098, 0.118], line: [0.6, 0.65, 0.72] },
};

/**
 * @typedef {object} Options
 * @property {boolean} [dark]
 * @property {(text: string) => void} [onNotice] gets what of a scene cannot be shown
 * @property {() => void} [onReady] called once a scene has been drawn for the first time
 */

/**
 * A view of a scene in a canvas. The canvas needs an element around it with `position: relative`,
 * which the labels of frames are put in; it gets the class `scene-label`.
 * @param {HTMLCanvasElement} canvas @param {Options} [options]
 */
export function createScene(canvas, options = {}) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
  if (!gl) return withoutScene();
  try {
    return new Scene(canvas, gl, options).handle();
  } catch {
    return withoutScene();
  }
}

function withoutScene() {
  const nothing = () => {};
  const calls = ["load", "poses", "frames", "resize", "reset", "setTheme", "destroy"];
  return {
    available: false,
    text: "This browser has no WebGL2, so there is no view in 3D.",
    ...Object.fromEntries(calls.map((name) => [name, nothing])),
    state: () => ({ draws: 0, parts: 0, triangles: 0, frames: 0, level: 0 }),
  };
}

class Scene {
  constructor(canvas, gl, options) {
    this.canvas = canvas;
    this.gl = gl;
    this.options = options;
    this.theme = options.dark ? THEMES.dark : THEMES.light;
    this.painter = new Painter(gl);
    this.orbit = new Orbit();
    this.bodies = [];
    this.places = new Map();
    this.parts = [];
    this.cameras = new Map();
    this.shownFrames = [];
    this.level = 0; // 0: all; 1: coarse pixels; 2: no shadows either
    this.cost = 0;
    this.draws = 0;
    this.loads = 0;
    this.drawnAt = -Infinity;
    this.timer = 0;
    this.request = 0;
    this.isVisible = true;
    this.upload([]);
    this.labels = document.createElement("div");
    Object.assign(this.labels.style, {
      position: "absolute",
      inset: "0",
      overflow: "hidden",
      pointerEvents: "none",
    });
    this.labels.setAttribute("aria-hidden", "true");
    canvas.after(this.labels);
    this.listen();
    this.resize();
  }

  /** What the page gets. */
  handle() {
    return {
      available: true,
      text: "",
      load: (message, bodies) => this.load(message, bodies),
      poses: (list) => this.poses(list),
      frames: (list) => this.frames(list),
      resize: () => this.resize(),
      reset: () => this.reset(),
      setTheme: (dark) => this.setTheme(dark),
      destroy: () => this.destroy(),
      state: () => ({
        draws: this.draws,
        parts: this.parts.length,
        triangles: this.parts.reduce((sum, part) => sum + part.uploaded.count / 3, 0),
        frames: this.shownFrames.length,
        level: this.level,
        yaw: this.orbit.yaw,
        pitch: this.orbit.pitch,
        distance: this.orbit.distance,
      }),
    };
  }

  listen() {
    const { canvas } = this;
    if (canvas.tabIndex < 0) canvas.tabIndex = 0;
    this.uncontrol = control(canvas, this.orbit, () => this.changed());
    this.lost = (event) => {
      event.preventDefault();
      this.isLost = true;
      this.fence = null;
    };
    this.restored = () => {
      this.isLost = false;
      this.painter = new Painter(this.gl);
      this.uploads = null; // gone with the old context
      this.upload(this.parts);
      this.changed();
    };
    canvas.addEventListener("webglcontextlost", this.lost);
    canvas.addEventListener("webglcontextrestored", this.restored);
    this.observers = [new ResizeObserver(() => this.resize())];
    this.observers[0].observe(canvas);
    this.observers.push(
      new IntersectionObserver((entries) => {
        this.isVisible = entries[entries.length - 1].isIntersecting;
        if (this.isVisible) this.changed();
      }),
    );
    this.observers[1].observe(canvas);
  }

  /**
   * Shows the content of a message `/scene`.
   * @param {object} message @param {string[]} bodies names, in the order of `poses`
   * @returns {string[]} what of it cannot be shown
   */
  load(message, bodies = []) {
    const { parts, cameras, notices } = partsOf(message);
    this.loads += 1;
    this.bodies = bodies.map(String);
    this.places.clear();
    this.cameras = cameras;
    this.upload(parts);
    this.isFitted = false;
    this.level = parts.length > MANY_PARTS ? 2 : 0;
    this.cost = 0;
    for (const text of notices) this.options.onNotice?.(text);
    this.changed();
    return notices;
  }

  upload(parts) {
    const { painter } = this;
    if (this.uploads && !this.isLost) painter.discard(this.uploads.solids, this.uploads.textures);
    const usual = Object.fromEntries(
      Object.entries(makers).map(([name, make]) => [name, painter.upload(make())]),
    );
    this.usual = usual;
    this.uploads = { solids: Object.values(usual), textures: [] };
    this.parts = parts.map((part) => {
      const uploaded = usual[part.solid] ?? painter.upload(part.solid);
      if (!usual[part.solid]) this.uploads.solids.push(uploaded);
      return { ...part, uploaded, texture: null };
    });
    const { uploads } = this;
    for (const part of this.parts) if (part.png) this.addTexture(part, uploads);
  }

  async addTexture(part, uploads) {
    try {
      const bitmap = await createImageBitmap(new Blob([part.png], { type: "image/png" }));
      if (this.uploads === uploads && !this.isLost) {
        part.texture = this.painter.image(bitmap);
        uploads.textures.push(part.texture);
        this.changed();
      }
      bitmap.close();
    } catch {
      this.options.onNotice?.("A texture cannot be read.");
    }
  }

  /** Puts the bodies somewhere. @param {number[][]|null} list in the order of the names */
  poses(list) {
    if (!Array.isArray(list)) return;
    list.slice(0, this.bodies.length).forEach((values, n) => {
      const pose = checkedPose(values);
      if (pose) this.places.set(this.bodies[n], pose);
    });
    this.changed();
  }

  /** Shows coordinate frames, and no others. @param {{name: string, pose: number[]}[]} list */
  frames(list) {
    const shown = (Array.isArray(list) ? list : []).slice(0, MOST_FRAMES);
    this.shownFrames = shown
      .map(({ name, pose }) => ({ name: String(name), pose: checkedPose(pose) }))
      .filter(({ pose }) => pose !== null);
    const isSame = (label, n) => label.textContent === this.shownFrames[n]?.name;
    const labels = [...this.labels.children];
    if (labels.length !== this.shownFrames.length || !labels.every(isSame)) this.addLabels();
    this.changed();
  }

  addLabels() {
    this.labels.replaceChildren(
      ...this.shownFrames.map(({ name }) => {
        const label = document.createElement("span");
        label.className = "scene-label";
        label.hidden = true; // until it has a place
        label.textContent = name;
        Object.assign(label.style, { position: "absolute", left: "0", top: "0" });
        return label;
      }),
    );
  }

  setTheme(dark) {
    this.theme = dark ? THEMES.dark : THEMES.light;
    this.changed();
  }

  /** Back to the first view. */
  reset() {
    this.orbit.reset();
    this.changed();
  }

  resize() {
    this.canvas.style.touchAction = scrolls() ? "pan-y" : "none";
    this.changed();
  }

  /** Gives the canvas as many pixels as it covers on the screen, which empties it. */
  setPixels() {
    const { canvas } = this;
    const density = this.level > 0 ? 1 : Math.min(2, window.devicePixelRatio || 1);
    const edge = (length) => Math.max(1, Math.min(MOST_PIXELS, Math.round(length * density)));
    const [width, height] = [edge(canvas.clientWidth), edge(canvas.clientHeight)];
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
  }

  destroy() {
    clearTimeout(this.timer);
    cancelAnimationFrame(this.request);
    this.isLost = true;
    this.uncontrol();
    for (const observer of this.observers) observer.disconnect();
    this.canvas.removeEventListener("webglcontextlost", this.lost);
    this.canvas.removeEventListener("webglcontextrestored", this.restored);
    this.labels.remove();
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  /** Has the scene drawn soon. */
  changed() {
    this.isChanged = true;
    if (this.timer || this.request || this.isLost || !this.isVisible) return;
    const period = Math.max(PERIOD_MS, 2.5 * this.cost);
    const wait = Math.max(0, this.drawnAt + period - performance.now());
    const ask = () => {
      this.timer = 0;
      this.request = requestAnimationFrame(() => {
        this.request = 0;
        if (this.isChanged && !this.isLost) this.draw();
      });
    };
    if (wait > 0) this.timer = setTimeout(ask, wait);
    else ask();
  }

  draw() {
    if (!this.canvas.clientWidth || !this.canvas.clientHeight) return;
    this.isChanged = false;
    this.setPixels();
    const begin = performance.now();
    const drawn = this.parts.map((part) => this.drawnPart(part));
    const bounds = this.bounds(drawn);
    if (!this.isFitted && this.parts.length) this.fit(bounds);
    const { orbit, canvas } = this;
    const aspect = canvas.width / canvas.height;
    const eye = orbit.eye();
    const far = 60 * Math.max(bounds.radius, orbit.distance);
    const near = Math.max(orbit.distance, bounds.radius / 20) / 60;
    const view = multiplied(perspective(orbit.angle(aspect), aspect, near, far), orbit.matrix());
    const sun = this.sun ?? [0.4, -0.4, 0.82];
    const light = lightMatrix(lookAt(bounds.centre, along(bounds.centre, -1, sun)), bounds.radius);
    this.painter.draw(drawn, this.triads(view, aspect), {
      view,
      eye,
      sun,
      light: this.level < 2 ? light : null,
      ground: groundOf(drawn, bounds, orbit.distance),
      ...this.theme,
    });
    this.placeLabels(view);
    this.draws += 1;
    this.drawnAt = begin;
    this.measure(begin);
    if (this.draws === 1) this.options.onReady?.();
  }

  /** Learns now and then how long drawing takes, and draws less where it is slow. */
  measure(begin) {
    const { gl } = this;
    if (this.fence || (this.draws > 6 && this.cost < SLOW_MS && this.draws % 50)) return;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const look = () => {
      if (this.isLost || !this.fence) return;
      if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) {
        setTimeout(look, 4);
        return;
      }
      gl.deleteSync(this.fence);
      this.fence = null;
      this.learn(performance.now() - begin);
    };
    setTimeout(look, 0);
  }

  learn(cost) {
    if (this.draws < 2) return; // the first picture compiles shaders
    this.cost = this.cost ? (this.cost + cost) / 2 : cost;
    if (this.cost > SLOW_MS && this.level < 2 && this.draws > 3) {
      this.level += 1;
      this.cost = 0;
      this.changed();
    }
  }

  drawnPart(part) {
    const { scale, colour, texture, uploaded, isFloor, ball } = part;
    const pose = composePose(this.places.get(part.body) ?? IDENTITY_POSE, part.pose);
    const middle = composePose(pose, [...ball.centre, 1, 0, 0, 0]).slice(0, 3);
    const { radius } = ball;
    return { solid: uploaded, pose, scale, colour, texture, isFloor, middle, radius };
  }

  /** A ball around all parts but floors. */
  bounds(drawn) {
    const things = drawn.filter((part) => !part.isFloor);
    const counted = things.length ? things : drawn;
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const { middle, radius } of counted) {
      for (const axis of [0, 1, 2]) {
        low[axis] = Math.min(low[axis], middle[axis] - radius);
        high[axis] = Math.max(high[axis], middle[axis] + radius);
      }
    }
    if (!counted.length) return { centre: [0, 0, 0], radius: 1, low: [0, 0, 0] };
    const centre = low.map((value, axis) => (value + high[axis]) / 2);
    const corner = Math.hypot(...high.map((value, axis) => value - centre[axis]));
    const farthest = counted.reduce(
      (most, part) => Math.max(most, part.radius + Math.hypot(...difference(part.middle, centre))),
      0,
    );
    return { centre, radius: Math.max(0.01, Math.min(corner, farthest)), low };
  }

  /** The first view: that of the camera `overview`, or one of all that there is. */
  fit(bounds) {
    const camera = this.cameras.get("overview");
    if (camera) {
      const body = this.places.get(camera.body) ?? IDENTITY_POSE;
      this.orbit.follow(composePose(body, camera.pose), camera.fovy, bounds);
    } else {
      this.orbit.fit(bounds);
    }
    this.isFitted = true;
    const yaw = this.orbit.yaw + 0.7; // the light comes over the left shoulder
    this.sun = [0.5 * Math.cos(yaw), 0.5 * Math.sin(yaw), Math.sqrt(0.75)];
  }

  /** The arrows of the shown frames, as large on the screen wherever they are. */
  triads(view, aspect) {
    const half = Math.tan(this.orbit.angle(aspect) / 2) / (this.canvas.clientHeight / 2);
    return this.shownFrames.flatMap(({ pose }) => {
      const depth = transformed(view, pose)[3];
      const pixels = Math.min(TRIAD_PIXELS, this.canvas.clientHeight / 6);
      const length = pixels * Math.max(depth, 1e-3) * half;
      return AXES.map(({ colour, turn }) => ({
        solid: this.usual.cylinder,
        pose: composePose(composePose(pose, [0, 0, 0, ...turn]), [0, 0, length / 2, 1, 0, 0, 0]),
        scale: [length / 14, length / 14, length],
        colour,
        texture: null,
      }));
    });
  }

  placeLabels(view) {
    const { clientWidth, clientHeight } = this.canvas;
    this.shownFrames.forEach(({ pose }, n) => {
      const [x, y, , w] = transformed(view, pose);
      const label = this.labels.children[n];
      label.hidden = w <= 0;
      const right = clientWidth - label.offsetWidth - 2;
      const left = Math.max(2, Math.min(right, ((x / w + 1) / 2) * clientWidth + 6));
      const top = ((1 - y / w) / 2) * clientHeight + 4;
      label.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
    });
  }
}

/** Where the grid is (a little above the floor), its reach and the size of a cell. */
function groundOf(drawn, bounds, distance) {
  const floors = drawn.filter((part) => part.isFloor && Math.abs(part.pose[3]) > 0.9999);
  floors.sort((a, b) => b.scale[0] * b.scale[1] - a.scale[0] * a.scale[1]);
  const height = floors.length ? floors[0].pose[2] + floors[0].scale[2] / 2 : bounds.low[2];
  const cell = 10 ** Math.round(Math.log10(bounds.radius / 8));
  const above = height + 5e-4 * distance;
  return { centre: [bounds.centre[0], bounds.centre[1], above], reach: 6 * bounds.radius, cell };
}
