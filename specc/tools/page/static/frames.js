/**
 * Chooses which poses are drawn as coordinate frames, and which body carries the frame that a pose
 * is measured in.
 *
 * A specification does not say where its frames are in a model, so people do: once for each base
 * frame, remembered by the browser.
 */
import { html, recall, remember } from "./dom.js";
import { checkedPose, composePose, IDENTITY_POSE } from "./geometry.js";

export const WORLD = "world";

/**
 * @typedef {{name: string, base: string, end: string}} PoseSignal
 * @typedef {object} Settings
 * @property {PoseSignal[]} poses the signals that are poses
 * @property {string[]} bodies names, in the order of the poses of bodies
 * @property {Object<string, string>} [carriers] bodies that are known to carry a frame
 * @property {string} [system] name of the system: what is remembered is of it alone
 * @property {() => void} changed called when the choice has changed
 */

/** The pose of a position (m) and an axis times an angle (rad), as signals have it; or null. */
export function poseOfNumbers(numbers) {
  if (numbers?.length !== 6 || !numbers.every(Number.isFinite)) return null;
  const [x, y, z, ...axis] = numbers;
  const angle = Math.hypot(...axis);
  const share = angle > 1e-9 ? Math.sin(angle / 2) / angle : 0.5;
  return checkedPose([x, y, z, Math.cos(angle / 2), ...axis.map((value) => value * share)]);
}

/** The chooser: a list of the poses, and for each base frame a body. */
export class FrameChooser {
  /** @param {HTMLElement} parent what it is put into @param {Settings} settings */
  constructor(parent, settings) {
    this.settings = { carriers: {}, system: "", ...settings };
    const saved = recall(this.key, {});
    const names = new Set(this.settings.poses.map(({ name }) => name));
    this.shown = new Set(texts(saved.shown).filter((name) => names.has(name)));
    const bodies = Object.entries(saved.bodies ?? {});
    this.chosen = new Map(bodies.filter(([, body]) => this.hasBody(body)));
    this.element = document.createElement("div");
    this.element.className = "frame-chooser";
    this.carrierBox = document.createElement("div");
    this.carrierBox.className = "frame-carriers";
    this.element.append(this.signalBox(), this.carrierBox);
    this.showCarriers();
    parent.append(this.element);
  }

  get key() {
    return `frames of ${this.settings.system}`;
  }

  /** The names of the signals whose values are needed. */
  get wanted() {
    return [...this.shown];
  }

  /** The body that carries a frame. */
  carrier(frame) {
    const known = this.settings.carriers[frame];
    return this.chosen.get(frame) ?? (this.hasBody(known) ? known : WORLD);
  }

  hasBody(name) {
    return name === WORLD || this.settings.bodies.includes(name);
  }

  /**
   * The frames to draw, in the world.
   * @param {Map<string, number[]>|Object<string, number[]>} values by signal: a pose of seven
   *   numbers, or a position and an axis times an angle
   * @param {number[][]|null} bodyPoses in the order of the bodies
   * @returns {{name: string, pose: number[]}[]}
   */
  frames(values, bodyPoses) {
    const found = [];
    for (const { name, base, end } of this.settings.poses) {
      if (!this.shown.has(name)) continue;
      const value = values instanceof Map ? values.get(name) : values[name];
      const pose = value?.length === 6 ? poseOfNumbers(value) : checkedPose(value);
      const carrier = this.poseOf(this.carrier(base), bodyPoses);
      if (pose && carrier) {
        found.push({ name: `${name} (${end})`, pose: composePose(carrier, pose) });
      }
    }
    return found;
  }

  poseOf(body, bodyPoses) {
    if (body === WORLD) return IDENTITY_POSE;
    return checkedPose(bodyPoses?.[this.settings.bodies.indexOf(body)]);
  }

  signalBox() {
    const box = document.createElement("fieldset");
    box.append(html("legend", {}, "Frames of poses"));
    for (const { name, base, end } of this.settings.poses) {
      const input = document.createElement("input");
      input.type = "checkbox";
      input.checked = this.shown.has(name);
      input.addEventListener("change", () => {
        if (input.checked) this.shown.add(name);
        else this.shown.delete(name);
        this.keep();
        this.showCarriers();
      });
      const label = document.createElement("label");
      label.append(input, html("span", {}, name), html("small", {}, `${end} in ${base}`));
      box.append(label);
    }
    if (!this.settings.poses.length) box.append(html("p", {}, "This system has no poses."));
    return box;
  }

  /** Where the base frames of the shown poses are. */
  showCarriers() {
    const shown = this.settings.poses.filter(({ name }) => this.shown.has(name));
    const bases = [...new Set(shown.map(({ base }) => base))];
    this.carrierBox.replaceChildren(
      ...bases.map((base) => {
        const select = document.createElement("select");
        for (const body of [WORLD, ...this.settings.bodies]) {
          const option = html("option", {}, body === WORLD ? "the world" : body);
          option.value = body;
          select.append(option);
        }
        select.value = this.carrier(base);
        select.addEventListener("change", () => {
          this.chosen.set(base, select.value);
          this.keep();
        });
        const label = document.createElement("label");
        label.append(html("span", {}, `Frame ${base} is at`), select);
        return label;
      }),
    );
  }

  keep() {
    remember(this.key, { shown: [...this.shown], bodies: Object.fromEntries(this.chosen) });
    this.settings.changed();
  }
}

const texts = (values) =>
  Array.isArray(values) ? values.filter((value) => typeof value === "string") : [];
