/**
 * Poses, matrices and solids for the view in 3D.
 *
 * A pose is [x, y, z, w, i, j, k]: metres, then a unit quaternion. A matrix is 4 by 4, column by
 * column, as WebGL takes it.
 */

/** @typedef {number[]} Pose */
/** @typedef {{positions: Float32Array, normals: Float32Array, uvs: Float32Array}} Solid */

export const IDENTITY_POSE = [0, 0, 0, 1, 0, 0, 0];

/** A pose of seven finite numbers with a quaternion of length one, or null. */
export function checkedPose(values) {
  if (!Array.isArray(values) || values.length < 7) return null;
  const pose = values.slice(0, 7).map(Number);
  if (!pose.every(Number.isFinite)) return null;
  const length = Math.hypot(pose[3], pose[4], pose[5], pose[6]);
  if (!(length > 1e-9)) return null;
  for (let i = 3; i < 7; i += 1) pose[i] /= length;
  return pose;
}

/** The vector (3) that a quaternion w, i, j, k turns another one into. */
export function rotated([w, i, j, k], [x, y, z]) {
  const tx = 2 * (j * z - k * y);
  const ty = 2 * (k * x - i * z);
  const tz = 2 * (i * y - j * x);
  return [
    x + w * tx + j * tz - k * ty,
    y + w * ty + k * tx - i * tz,
    z + w * tz + i * ty - j * tx,
  ];
}

/**
 * The pose in the world of what has the pose `pose` in a body.
 * @param {Pose} bodyPose @param {Pose} pose @returns {Pose}
 */
export function composePose(bodyPose, pose) {
  const [w, i, j, k] = bodyPose.slice(3);
  const [a, b, c, d] = pose.slice(3);
  const [x, y, z] = rotated([w, i, j, k], pose.slice(0, 3));
  return [
    bodyPose[0] + x,
    bodyPose[1] + y,
    bodyPose[2] + z,
    w * a - i * b - j * c - k * d,
    w * b + i * a + j * d - k * c,
    w * c - i * d + j * a + k * b,
    w * d + i * c - j * b + k * a,
  ];
}

/** The matrix of a pose, with lengths along its own axes multiplied by `scale`. */
export function poseMatrix([x, y, z, w, i, j, k], [sx, sy, sz] = [1, 1, 1]) {
  return new Float32Array([
    sx * (1 - 2 * (j * j + k * k)), sx * 2 * (i * j + w * k), sx * 2 * (i * k - w * j), 0,
    sy * 2 * (i * j - w * k), sy * (1 - 2 * (i * i + k * k)), sy * 2 * (j * k + w * i), 0,
    sz * 2 * (i * k + w * j), sz * 2 * (j * k - w * i), sz * (1 - 2 * (i * i + j * j)), 0,
    x, y, z, 1,
  ]);
}

/** The matrix (9) that turns normals of a solid that `poseMatrix(pose, scale)` places. */
export function normalMatrix(pose, [sx, sy, sz]) {
  const m = poseMatrix([0, 0, 0, ...pose.slice(3)], [1 / sx, 1 / sy, 1 / sz]);
  return new Float32Array([m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]]);
}

/** The product a b of two matrices. */
export function multiplied(a, b) {
  const product = new Float32Array(16);
  for (let column = 0; column < 4; column += 1) {
    for (let row = 0; row < 4; row += 1) {
      let sum = 0;
      for (let n = 0; n < 4; n += 1) sum += a[4 * n + row] * b[4 * column + n];
      product[4 * column + row] = sum;
    }
  }
  return product;
}

/** What a matrix makes of a point (3): x, y, z and w. */
export function transformed(m, [x, y, z]) {
  return [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
}

/** A perspective projection with the vertical angle of view `fovy` in rad. */
export function perspective(fovy, aspect, near, far) {
  const f = 1 / Math.tan(fovy / 2);
  const depth = near - far;
  return new Float32Array([
    f / aspect, 0, 0, 0,
    0, f, 0, 0,
    0, 0, (far + near) / depth, -1,
    0, 0, (2 * far * near) / depth, 0,
  ]);
}

/** A parallel projection of a cube with half edges `radius` around the origin. */
export function parallel(radius) {
  const s = 1 / radius;
  return new Float32Array([s, 0, 0, 0, 0, s, 0, 0, 0, 0, -s, 0, 0, 0, 0, 1]);
}

/** The matrix of what looks from `eye` to `target`, with z of the world upwards. */
export function lookAt(eye, target) {
  const back = unit(difference(eye, target));
  const sideways = cross([0, 0, 1], back);
  const right = Math.hypot(...sideways) > 1e-6 ? unit(sideways) : [1, 0, 0];
  const up = cross(back, right);
  return new Float32Array([
    right[0], up[0], back[0], 0,
    right[1], up[1], back[1], 0,
    right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
}

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const difference = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** a + s b */
export const along = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];

export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function unit(a) {
  const length = Math.sqrt(dot(a, a)) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
}

/** @param {number[][]} corners three for a triangle @param {number[][]} normals @returns {Solid} */
function solidOf(corners, normals) {
  return {
    positions: new Float32Array(corners.flat()),
    normals: new Float32Array(normals.flat()),
    uvs: new Float32Array(2 * corners.length),
  };
}

/** A cube with edges of length 1 around the origin. */
export function cube() {
  const corners = [];
  const normals = [];
  for (const axis of [0, 1, 2]) {
    for (const side of [-1, 1]) {
      const place = (u, v) => {
        const corner = [0, 0, 0];
        corner[axis] = side / 2;
        corner[(axis + 1) % 3] = (side * u) / 2;
        corner[(axis + 2) % 3] = v / 2;
        return corner;
      };
      const normal = [0, 0, 0];
      normal[axis] = side;
      corners.push(place(-1, -1), place(1, -1), place(1, 1));
      corners.push(place(-1, -1), place(1, 1), place(-1, 1));
      for (let n = 0; n < 6; n += 1) normals.push(normal);
    }
  }
  return solidOf(corners, normals);
}

/** A sphere with diameter 1 around the origin. */
export function sphere(parts = 24) {
  const corners = [];
  const normals = [];
  const point = (row, column) => {
    const [latitude, longitude] = [(Math.PI * row) / parts, (2 * Math.PI * column) / parts];
    const around = Math.sin(latitude);
    return [around * Math.cos(longitude), around * Math.sin(longitude), Math.cos(latitude)];
  };
  for (let row = 0; row < parts; row += 1) {
    for (let column = 0; column < parts; column += 1) {
      const [a, b] = [point(row, column), point(row + 1, column)];
      const [c, d] = [point(row + 1, column + 1), point(row, column + 1)];
      normals.push(a, b, c, a, c, d);
    }
  }
  for (const normal of normals) corners.push(normal.map((value) => value / 2));
  return solidOf(corners, normals);
}

/** A cylinder with diameter and length 1 along z around the origin. */
export function cylinder(parts = 32) {
  const corners = [];
  const normals = [];
  const up = [0, 0, 1];
  const down = [0, 0, -1];
  for (let part = 0; part < parts; part += 1) {
    const [a, b] = [part, part + 1].map((n) => {
      const angle = (2 * Math.PI * n) / parts;
      return [Math.cos(angle), Math.sin(angle), 0];
    });
    const at = ([x, y], z) => [x / 2, y / 2, z];
    corners.push(at(a, -0.5), at(b, -0.5), at(b, 0.5), at(a, -0.5), at(b, 0.5), at(a, 0.5));
    normals.push(a, b, b, a, b, a);
    corners.push([0, 0, 0.5], at(a, 0.5), at(b, 0.5), [0, 0, -0.5], at(b, -0.5), at(a, -0.5));
    normals.push(up, up, up, down, down, down);
  }
  return solidOf(corners, normals);
}

const SMOOTH = Math.cos((40 * Math.PI) / 180);
const MOST_AROUND = 24;
/** Triangles at a point; with more, each has its own normal there. */

/**
 * Triangles, three corners each, with normals that are smooth but for edges sharper than 40°.
 * @param {Float32Array} points three numbers a point @param {Uint32Array} indices
 * @param {Float32Array|null} uv two numbers a point @returns {Solid}
 */
export function smoothSolid(points, indices, uv) {
  const count = indices.length / 3;
  const of = samePlaces(points);
  const faces = faceNormals(points, indices);
  const directions = faces.map(unit);
  const around = Array.from({ length: points.length / 3 }, () => []);
  for (let n = 0; n < indices.length; n += 1) around[of[indices[n]]].push(Math.floor(n / 3));
  const solid = {
    positions: new Float32Array(9 * count),
    normals: new Float32Array(9 * count),
    uvs: new Float32Array(6 * count),
  };
  for (let n = 0; n < indices.length; n += 1) {
    const point = indices[n];
    solid.positions.set(points.subarray(3 * point, 3 * point + 3), 3 * n);
    if (uv) solid.uvs.set(uv.subarray(2 * point, 2 * point + 2), 2 * n);
    const others = around[of[point]];
    solid.normals.set(cornerNormal(faces, directions, Math.floor(n / 3), others), 3 * n);
  }
  return solid;
}

/** For each point the number of the first one at the same place. */
function samePlaces(points) {
  const first = new Map();
  const of = new Uint32Array(points.length / 3);
  for (let n = 0; n < of.length; n += 1) {
    const key = `${points[3 * n]} ${points[3 * n + 1]} ${points[3 * n + 2]}`;
    if (!first.has(key)) first.set(key, n);
    of[n] = first.get(key);
  }
  return of;
}

/** The normals of triangles, as long as the triangles are large. */
function faceNormals(points, indices) {
  const corner = (n) => points.subarray(3 * indices[n], 3 * indices[n] + 3);
  const normals = [];
  for (let n = 0; n < indices.length; n += 3) {
    const a = corner(n);
    normals.push(cross(difference(corner(n + 1), a), difference(corner(n + 2), a)));
  }
  return normals;
}

/** The mean of the normals around a point that differ little from that of one of its triangles. */
function cornerNormal(faces, directions, own, around) {
  let sum = [0, 0, 0];
  for (const other of around.length > MOST_AROUND ? [own] : around) {
    if (dot(directions[own], directions[other]) > SMOOTH) sum = along(sum, 1, faces[other]);
  }
  return dot(sum, sum) > 0 ? unit(sum) : directions[own];
}
