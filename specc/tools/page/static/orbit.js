/**
 * A camera that goes around a point, and the pointers, wheel and keys that move it.
 */
import { along, checkedPose, cross, difference, dot, lookAt, rotated, unit } from "./geometry.js";

const TURN_PER_PIXEL = 0.008;
const TURN_PER_KEY = Math.PI / 24;
const ZOOM_PER_KEY = 1.15;
const STEEPEST = (Math.PI / 2) * 0.995;
const USUAL_FOVY = 0.7;
const USUAL_ASPECT = 4 / 3;

export class Orbit {
  constructor() {
    this.yaw = -0.9;
    this.pitch = 0.45;
    this.distance = 3;
    this.target = [0, 0, 0];
    this.fovy = USUAL_FOVY;
    this.home = null;
  }

  /**
   * Looks at a ball so that all of it is seen, and takes this as the view to come back to.
   * @param {{centre: number[], radius: number}} bounds
   */
  fit({ centre, radius }) {
    this.yaw = -0.9;
    this.pitch = 0.45;
    this.fovy = USUAL_FOVY;
    this.target = [...centre];
    this.distance = (1.05 * radius) / Math.sin(this.fovy / 2);
    this.settle(radius);
  }

  /**
   * Looks as a camera of the model does, which sees along its -z, and turns around what is there.
   * @param {number[]} pose @param {number} fovy @param {{centre: number[], radius: number}} bounds
   */
  follow(pose, fovy, { centre, radius }) {
    const eye = pose.slice(0, 3);
    const forward = rotated(pose.slice(3), [0, 0, -1]);
    const ahead = dot(difference(centre, eye), forward);
    this.distance = ahead > radius / 10 ? ahead : radius;
    this.target = along(eye, this.distance, forward);
    this.yaw = Math.atan2(-forward[1], -forward[0]);
    this.pitch = Math.asin(Math.min(1, Math.max(-1, -forward[2])));
    this.fovy = Math.min(2, Math.max(0.1, fovy));
    this.settle(radius);
  }

  settle(radius) {
    this.radius = radius;
    this.turn(0, 0);
    this.home = { ...this, home: null, target: [...this.target] };
  }

  /** Back to the first view. */
  reset() {
    const { home } = this;
    if (home) Object.assign(this, { ...home, home, target: [...home.target] });
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(STEEPEST, Math.max(-STEEPEST, this.pitch + pitch));
  }

  zoom(factor) {
    const [least, greatest] = [this.radius / 100, this.radius * 30];
    this.distance = Math.min(greatest, Math.max(least, this.distance * factor));
  }

  /** Moves the target in the plane of the picture, by parts of its height. */
  pan(right, up) {
    const back = this.back();
    const sideways = unit(cross([0, 0, 1], back));
    const height = 2 * this.distance * Math.tan(this.fovy / 2);
    this.target = along(this.target, right * height, sideways);
    this.target = along(this.target, up * height, cross(back, sideways));
  }

  /** The direction from the target to the eye. */
  back() {
    const level = Math.cos(this.pitch);
    return [level * Math.cos(this.yaw), level * Math.sin(this.yaw), Math.sin(this.pitch)];
  }

  eye() {
    return along(this.target, this.distance, this.back());
  }

  matrix() {
    return lookAt(this.eye(), this.target);
  }

  /** The vertical angle of view; a picture narrower than usual still shows all of the width. */
  angle(aspect) {
    return 2 * Math.atan(Math.tan(this.fovy / 2) * Math.max(1, USUAL_ASPECT / aspect));
  }
}

/** The camera of this name in a text of seven numbers of a pose and an angle of view in rad. */
export function cameraOfText(text) {
  const values = String(text).trim().split(/\s+/).map(Number);
  const pose = values.length === 8 ? checkedPose(values.slice(0, 7)) : null;
  return pose && values[7] > 0 && values[7] < Math.PI ? { pose, fovy: values[7] } : null;
}

/**
 * Lets a canvas move an orbit: drag turns, drag with the right button or Shift moves, the wheel and
 * two fingers zoom, arrows turn (with Shift: move), + and - zoom, Home goes back to the first view.
 * @param {HTMLCanvasElement} canvas @param {Orbit} orbit @param {() => void} changed
 * @returns {() => void} what ends it
 */
export function control(canvas, orbit, changed) {
  const pointers = new Map();
  const ended = new AbortController();
  const on = (kind, handler, options = {}) =>
    canvas.addEventListener(kind, handler, { signal: ended.signal, ...options });

  on("pointerdown", (event) => {
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.setPointerCapture(event.pointerId);
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    on(kind, (event) => pointers.delete(event.pointerId));
  }
  on("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    const height = canvas.clientHeight || 1;
    if (pointers.size === 2) {
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const gap = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      orbit.zoom(gap(before) / gap(now));
      orbit.pan(-dx / height / 2, dy / height / 2);
    } else if (event.shiftKey || (event.buttons & 6) !== 0) {
      orbit.pan(-dx / height, dy / height);
    } else {
      orbit.turn(-dx * TURN_PER_PIXEL, dy * TURN_PER_PIXEL);
    }
    pointers.set(event.pointerId, now);
    changed();
  });
  on("contextmenu", (event) => event.preventDefault());
  on("dblclick", () => {
    orbit.reset();
    changed();
  });
  on(
    "wheel",
    (event) => {
      if (scrolls() && document.activeElement !== canvas) return; // the wheel moves the page
      event.preventDefault();
      const lines = event.deltaMode === 1 ? event.deltaY * 16 : event.deltaY;
      orbit.zoom(Math.exp(Math.min(300, Math.max(-300, lines)) * 0.0015));
      changed();
    },
    { passive: false },
  );
  on("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || !moved(orbit, event)) return;
    event.preventDefault();
    event.stopPropagation();
    changed();
  });
  return () => ended.abort();
}

/** Whether the page is higher than its window. */
export function scrolls() {
  const page = document.scrollingElement;
  return page !== null && page.scrollHeight > page.clientHeight + 1;
}

/** Moves an orbit as a key says; whether the key says anything. */
function moved(orbit, { key, shiftKey }) {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  if (key in arrows) {
    const [x, y] = arrows[key];
    if (shiftKey) orbit.pan(x / 16, y / 16);
    else orbit.turn(x * TURN_PER_KEY, y * TURN_PER_KEY);
  } else if (key === "+" || key === "=") {
    orbit.zoom(1 / ZOOM_PER_KEY);
  } else if (key === "-" || key === "_") {
    orbit.zoom(ZOOM_PER_KEY);
  } else if (key === "Home" || key === "0") {
    orbit.reset();
  } else {
    return false;
  }
  return true;
}
