/**
 * The parts of a scene: the entities of a message `foxglove.SceneUpdate`, checked and bounded.
 */
import { checkedPose, cube, cylinder, IDENTITY_POSE, smoothSolid, sphere } from "./geometry.js";
import { bytesOf, colourOf, LIMITS, parseGlb } from "./glb.js";
import { cameraOfText } from "./orbit.js";

const MOST_PARTS = 2000;
const MOST_TRIANGLES = 250_000;
const MOST_TEXTURES = 64;
const FLAT_M = 0.002;
const KINDS = { cubes: "cube", spheres: "sphere", cylinders: "cylinder" };

/**
 * @typedef {object} Part
 * @property {string} body
 * @property {string|import("./geometry.js").Solid} solid a name of `makers`, or own triangles
 * @property {number[]} pose in the body
 * @property {number[]} scale
 * @property {number[]} colour
 * @property {Uint8Array|null} png of its texture
 * @property {boolean} isFloor whether it is a plane
 * @property {{centre: number[], radius: number}} ball around it, in its own axes, before the scale
 */
/** @typedef {{body: string, pose: number[], fovy: number}} Camera */

export const makers = { cube, sphere, cylinder };

/**
 * What is in a message.
 * @returns {{parts: Part[], cameras: Map<string, Camera>, notices: string[]}}
 */
export function partsOf(message) {
  const found = { parts: [], cameras: new Map(), notices: new Set(), triangles: 0, textures: 0 };
  for (const entity of list(message?.entities)) {
    const body = String(entity?.frame_id ?? "");
    for (const entry of list(entity?.metadata).slice(0, 100)) {
      const key = String(entry?.key);
      const camera = key.startsWith("camera ") ? cameraOfText(entry.value) : null;
      if (camera) found.cameras.set(key.slice(7), { body, ...camera });
    }
    for (const [field, solid] of Object.entries(KINDS)) {
      for (const shape of list(entity?.[field])) addShape(found, body, solid, shape);
    }
    for (const model of list(entity?.models)) addModel(found, body, model);
  }
  return { parts: found.parts, cameras: found.cameras, notices: [...found.notices] };
}

const list = (value) => (Array.isArray(value) ? value : []);

function isFull(found) {
  if (found.parts.length < MOST_PARTS) return false;
  found.notices.add(`The scene shows ${MOST_PARTS} parts; the others are left out.`);
  return true;
}

function addShape(found, body, solid, shape) {
  if (isFull(found)) return;
  const pose = poseOf(shape?.pose);
  const scale = ["x", "y", "z"].map((axis) => Number(shape?.size?.[axis]));
  if (!pose || !scale.every((edge) => edge > 0 && edge <= LIMITS.metres)) {
    found.notices.add("A part without a proper place or size is left out.");
    return;
  }
  const isFlat = scale[2] <= FLAT_M && Math.min(scale[0], scale[1]) > 100 * scale[2];
  const isFloor = solid === "cube" && isFlat;
  const colour = colour4(shape.color);
  const ball = { centre: [0, 0, 0], radius: Math.hypot(...scale) / 2 };
  found.parts.push({ body, solid, pose, scale, colour, png: null, isFloor, ball });
}

function addModel(found, body, model) {
  if (isFull(found)) return;
  try {
    const pose = poseOf(model?.pose);
    const scale = ["x", "y", "z"].map((axis) => Number(model?.scale?.[axis] ?? 1));
    if (!pose || !scale.every((edge) => Math.abs(edge) > 0 && Math.abs(edge) <= LIMITS.metres)) {
      throw new Error("a model has no proper place or size");
    }
    for (const part of parseGlb(bytesOf(model.data))) {
      found.triangles += part.indices.length / 3;
      if (found.triangles > MOST_TRIANGLES) {
        throw new Error(`the scene has more than ${MOST_TRIANGLES} triangles`);
      }
      found.textures += part.png ? 1 : 0;
      const png = found.textures <= MOST_TEXTURES ? part.png : null;
      const colour = model.override_color ? colour4(model.color) : part.colour;
      const solid = smoothSolid(part.points, part.indices, part.uv);
      const ball = ballAround(part.points, scale);
      found.parts.push({ body, solid, pose, scale, colour, png, isFloor: false, ball });
    }
  } catch (error) {
    found.notices.add(`A mesh is left out: ${error.message}.`);
  }
}

/** The colour of a message with r, g, b and a. */
function colour4(colour) {
  return colourOf(["r", "g", "b", "a"].map((name) => colour?.[name]));
}

/** The pose of a message with a position and an orientation, or null. */
function poseOf(pose) {
  if (!pose) return IDENTITY_POSE;
  const { x = 0, y = 0, z = 0 } = pose.position ?? {};
  const { w = 1, x: i = 0, y: j = 0, z: k = 0 } = pose.orientation ?? {};
  const found = checkedPose([x, y, z, w, i, j, k]);
  return found?.every((value) => Math.abs(value) <= LIMITS.metres) ? found : null;
}

/** A ball around scaled points, in the axes of the part. */
function ballAround(points, scale) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let n = 0; n < points.length; n += 1) {
    const value = points[n] * scale[n % 3];
    low[n % 3] = Math.min(low[n % 3], value);
    high[n % 3] = Math.max(high[n % 3], value);
  }
  if (!points.length) return { centre: [0, 0, 0], radius: 0 };
  const centre = low.map((value, axis) => (value + high[axis]) / 2);
  return { centre, radius: Math.hypot(...high.map((value, axis) => value - low[axis])) / 2 };
}
