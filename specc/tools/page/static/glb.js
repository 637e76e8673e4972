/**
 * Reads a mesh from a binary glTF 2.0 file (GLB), as recordings have them.
 *
 * Files may come from strangers: every number is checked before it is used, and a file that asks
 * for more than the limits, or for parts of glTF that recordings do not use, raises an Error with a
 * text for people.
 */

export const LIMITS = {
  bytes: 64 << 20,
  triangles: 100_000,
  points: 300_000,
  texels: 1024,
  nodes: 64,
  metres: 1e6,
};

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3 };
const KINDS = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };

/**
 * @typedef {object} Part
 * @property {Float32Array} points three numbers each, with z of the scene upwards
 * @property {Uint32Array} indices three a triangle
 * @property {Float32Array|null} uv two numbers a point
 * @property {number[]} colour red, green, blue, opacity, from 0 to 1
 * @property {Uint8Array|null} png the texture's file
 */

/** The bytes of a base64 text. */
export function bytesOf(text) {
  if (typeof text !== "string" || text.length > (LIMITS.bytes * 4) / 3) {
    throw new Error("a model is larger than 64 MB");
  }
  let binary;
  try {
    binary = atob(text);
  } catch {
    throw new Error("a model is not base64");
  }
  const bytes = new Uint8Array(binary.length);
  for (let n = 0; n < bytes.length; n += 1) bytes[n] = binary.charCodeAt(n);
  return bytes;
}

/**
 * The parts of a file.
 * @param {Uint8Array} bytes @returns {Part[]}
 */
export function parseGlb(bytes) {
  const file = chunksOf(bytes);
  const parts = [];
  for (const node of list(file.gltf.nodes).slice(0, LIMITS.nodes)) {
    if (node?.mesh === undefined) continue;
    if (node.matrix || node.children) throw new Error("a model has nodes that are not supported");
    for (const primitive of list(item(file.gltf.meshes, node.mesh, "mesh").primitives)) {
      if (parts.length >= LIMITS.nodes) throw new Error("a model has too many parts");
      parts.push(partOf(file, primitive ?? {}, node));
    }
  }
  return parts;
}

/** The JSON document and the binary chunk. */
function chunksOf(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 20 || view.getUint32(0, true) !== MAGIC || view.getUint32(4, true) !== 2) {
    throw new Error("a model is no binary glTF 2.0 file");
  }
  const size = view.getUint32(12, true);
  if (view.getUint32(16, true) !== JSON_CHUNK || 20 + size > bytes.length) {
    throw new Error("a model is cut");
  }
  let gltf;
  try {
    gltf = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + size)));
  } catch {
    throw new Error("a model has a damaged description");
  }
  const begin = 28 + size;
  let binary = new Uint8Array(0);
  if (begin <= bytes.length && view.getUint32(24 + size, true) === BINARY_CHUNK) {
    binary = bytes.subarray(begin, begin + view.getUint32(20 + size, true));
  }
  return { gltf: gltf ?? {}, binary };
}

const isNear = (value) => Math.abs(value) <= LIMITS.metres;
const list = (value) => (Array.isArray(value) ? value : []);

function item(values, number, kind) {
  const found = Number.isInteger(number) ? list(values)[number] : undefined;
  if (found === undefined || found === null) {
    throw new Error(`a model lacks a ${kind} that it names`);
  }
  return found;
}

/** The bytes of a buffer view. */
function viewOf({ gltf, binary }, number) {
  const view = item(gltf.bufferViews, number, "part of its buffer");
  const begin = view.byteOffset ?? 0;
  const end = begin + view.byteLength;
  const isWithin = Number.isInteger(begin) && Number.isInteger(end) && begin >= 0 && end >= begin;
  if (!isWithin || end > binary.length || view.byteStride) throw new Error("a model is cut");
  return binary.subarray(begin, end);
}

/** The numbers of an accessor, copied: they need not be aligned in the file. */
function numbersOf(file, number, form, most) {
  const accessor = item(file.gltf.accessors, number, "list of numbers");
  const Kind = KINDS[accessor.componentType];
  const count = accessor.count;
  if (!Kind || accessor.type !== form || accessor.sparse || !Number.isInteger(count) || count < 0) {
    throw new Error("a model has numbers of a kind that is not supported");
  }
  if (count > most) throw new Error(`a model has more than ${most} points or corners`);
  const begin = accessor.byteOffset ?? 0;
  const size = count * WIDTHS[form] * Kind.BYTES_PER_ELEMENT;
  const bytes = viewOf(file, accessor.bufferView);
  if (!Number.isInteger(begin) || begin < 0 || begin + size > bytes.length) {
    throw new Error("a model is cut");
  }
  return new Kind(bytes.slice(begin, begin + size).buffer);
}

/** @returns {Part} */
function partOf(file, primitive, node) {
  if ((primitive.mode ?? 4) !== 4) throw new Error("a model has parts that are no triangles");
  const attributes = primitive.attributes ?? {};
  const points = numbersOf(file, attributes.POSITION, "VEC3", LIMITS.points);
  const count = points.length / 3;
  const indices =
    primitive.indices === undefined
      ? Uint32Array.from({ length: count }, (_, n) => n)
      : Uint32Array.from(numbersOf(file, primitive.indices, "SCALAR", 3 * LIMITS.triangles));
  if (!(points instanceof Float32Array) || !points.every(isNear)) {
    throw new Error("a model has points that are no numbers, or too far away");
  }
  if (indices.length % 3 || indices.some((index) => index >= count)) {
    throw new Error("a model has triangles without corners");
  }
  const { material: number } = primitive;
  const material = number === undefined ? {} : item(file.gltf.materials, number, "material");
  const look = material.pbrMetallicRoughness ?? {};
  const at = attributes.TEXCOORD_0;
  const uv = at === undefined ? null : numbersOf(file, at, "VEC2", LIMITS.points);
  const hasUv = uv instanceof Float32Array && uv.length === 2 * count;
  return {
    points: placed(points, node),
    indices,
    uv: hasUv ? uv : null,
    colour: colourOf(look.baseColorFactor),
    png: hasUv && look.baseColorTexture ? pngOf(file, look.baseColorTexture) : null,
  };
}

/** Four numbers from 0 to 1; white for what is none. */
export function colourOf(values) {
  const isColour = Array.isArray(values) && values.length === 4 && values.every(Number.isFinite);
  return isColour ? values.map((value) => Math.min(1, Math.max(0, value))) : [1, 1, 1, 1];
}

/** The PNG of a texture; the sizes in its header are within the limits. */
function pngOf(file, texture) {
  const source = item(file.gltf.textures, texture.index, "texture").source;
  const image = item(file.gltf.images, source, "image");
  if (image.mimeType !== "image/png") throw new Error("a model has a texture that is no PNG");
  const bytes = viewOf(file, image.bufferView);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 33 || view.getUint32(0) !== 0x89504e47 || view.getUint32(12) !== 0x49484452) {
    throw new Error("a model has a texture that is no PNG");
  }
  if (Math.max(view.getUint32(16), view.getUint32(20)) > LIMITS.texels) {
    throw new Error(`a model has a texture of more than ${LIMITS.texels} texels along an edge`);
  }
  return bytes.slice();
}

/** The points where their node puts them; in glTF y points up, in a scene z. */
function placed(points, node) {
  const [i, j, k, w] = numbers(node.rotation, [0, 0, 0, 1]);
  const [sx, sy, sz] = numbers(node.scale, [1, 1, 1]);
  const [dx, dy, dz] = numbers(node.translation, [0, 0, 0]);
  const found = new Float32Array(points.length);
  for (let n = 0; n < points.length; n += 3) {
    const [x, y, z] = [sx * points[n], sy * points[n + 1], sz * points[n + 2]];
    const tx = 2 * (j * z - k * y);
    const ty = 2 * (k * x - i * z);
    const tz = 2 * (i * y - j * x);
    found[n] = x + w * tx + j * tz - k * ty + dx;
    found[n + 1] = -(z + w * tz + i * ty - j * tx + dz);
    found[n + 2] = y + w * ty + k * tx - i * tz + dy;
  }
  return found;
}

function numbers(values, usual) {
  if (values === undefined) return usual;
  if (!Array.isArray(values) || values.length !== usual.length || !values.every(Number.isFinite)) {
    throw new Error("a model has a node with no proper place");
  }
  return values;
}
