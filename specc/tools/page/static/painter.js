/**
 * Draws solids with WebGL2: one directional light with a shadow, light of the sky, a grid on the
 * ground.
 */
import { multiplied, normalMatrix, parallel, poseMatrix } from "./geometry.js";

const SHADOW_TEXELS = 1024;

const SOLID_VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
uniform mat4 placing, view, light;
uniform mat3 turning;
out vec3 spot, facing;
out vec2 texel;
out vec4 lit;
void main() {
  vec4 world = placing * vec4(position, 1.0);
  spot = world.xyz;
  facing = turning * normal;
  texel = uv;
  lit = light * vec4(world.xyz + 0.004 * normalize(facing), 1.0);
  gl_Position = view * world;
}`;

const SOLID_FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
in vec3 spot, facing;
in vec2 texel;
in vec4 lit;
uniform vec4 colour;
uniform vec3 sun, eye;
uniform sampler2D surface;
uniform sampler2DShadow shadow;
uniform bool hasSurface, hasShadow;
uniform float flatness;
out vec4 seen;

float sunlight() {
  vec3 at = lit.xyz / lit.w * 0.5 + 0.5;
  if (!hasShadow || any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  float step = 0.7 / float(textureSize(shadow, 0).x);
  for (int x = -1; x <= 1; x += 2) {
    for (int y = -1; y <= 1; y += 2) {
      sum += texture(shadow, vec3(at.xy + step * vec2(x, y), at.z - 0.0015));
    }
  }
  return sum / 4.0;
}

void main() {
  vec3 toEye = normalize(eye - spot);
  vec3 n = normalize(facing);
  if (dot(n, toEye) < 0.0) n = -n;
  vec4 base = colour;
  if (hasSurface) base *= texture(surface, texel);
  float direct = max(dot(n, sun), 0.0);
  direct *= direct > 0.0 ? sunlight() : 1.0;
  float sky = 0.5 + 0.5 * n.z;
  float head = max(dot(n, toEye), 0.0);
  vec3 light = vec3(0.34, 0.36, 0.40) * (0.55 + 0.45 * sky) + vec3(0.16) * head;
  light += vec3(0.62, 0.60, 0.56) * direct;
  float shine = 0.12 * pow(max(dot(n, normalize(sun + toEye)), 0.0), 32.0) * step(0.001, direct);
  seen = vec4(mix(base.rgb * light + shine * direct, base.rgb, flatness), base.a);
}`;

const SHADOW_VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
uniform mat4 placing, light;
void main() { gl_Position = light * placing * vec4(position, 1.0); }`;

const SHADOW_FRAGMENT = `#version 300 es
precision mediump float;
void main() {}`;

const GRID_VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
uniform mat4 view;
uniform vec3 centre;
uniform float reach;
out vec2 ground;
void main() {
  ground = centre.xy + position.xy * 2.0 * reach;
  gl_Position = view * vec4(ground, centre.z, 1.0);
}`;

const GRID_FRAGMENT = `#version 300 es
precision highp float;
in vec2 ground;
uniform vec3 centre, line;
uniform float reach, cell;
out vec4 seen;

float lines(float size) {
  vec2 at = ground / size;
  vec2 width = fwidth(at);
  vec2 near = abs(fract(at - 0.5) - 0.5) / max(width, 1e-6);
  float there = 1.0 - min(min(near.x, near.y), 1.0);
  return there * clamp(0.5 / max(width.x, width.y) - 0.5, 0.0, 1.0);
}

void main() {
  float strength = max(0.45 * lines(cell), 0.9 * lines(10.0 * cell));
  float fade = 1.0 - smoothstep(0.35, 1.0, length(ground - centre.xy) / reach);
  seen = vec4(line, 0.4 * strength * fade);
}`;

/** @typedef {{array: WebGLVertexArrayObject, count: number, buffers: WebGLBuffer[]}} Uploaded */
/**
 * @typedef {object} Drawn
 * @property {Uploaded} solid
 * @property {number[]} pose in the world
 * @property {number[]} scale
 * @property {number[]} colour
 * @property {WebGLTexture|null} texture
 * @property {boolean} [isFloor] whether it throws no shadow
 */

export class Painter {
  /** Raises an Error where a shader is not taken. */
  constructor(gl) {
    this.gl = gl;
    this.solids = new Program(gl, SOLID_VERTEX, SOLID_FRAGMENT);
    this.shadows = new Program(gl, SHADOW_VERTEX, SHADOW_FRAGMENT);
    this.grid = new Program(gl, GRID_VERTEX, GRID_FRAGMENT);
    const white = new Uint8Array(4).fill(255);
    this.blank = this.texture(1, (target) =>
      gl.texImage2D(target, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, white),
    );
    this.shadowMap = this.depthTexture();
    this.shadowBuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowBuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadowMap, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  depthTexture() {
    const { gl } = this;
    const size = SHADOW_TEXELS;
    const found = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, found);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, size, size);
    const settings = {
      TEXTURE_MIN_FILTER: gl.LINEAR,
      TEXTURE_MAG_FILTER: gl.LINEAR,
      TEXTURE_WRAP_S: gl.CLAMP_TO_EDGE,
      TEXTURE_WRAP_T: gl.CLAMP_TO_EDGE,
      TEXTURE_COMPARE_MODE: gl.COMPARE_REF_TO_TEXTURE,
      TEXTURE_COMPARE_FUNC: gl.LEQUAL,
    };
    for (const [name, value] of Object.entries(settings)) {
      gl.texParameteri(gl.TEXTURE_2D, gl[name], value);
    }
    return found;
  }

  /** A texture with smaller copies of itself, filled by `fill(target)`. */
  texture(edge, fill) {
    const { gl } = this;
    const found = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, found);
    fill(gl.TEXTURE_2D);
    if (edge > 1) {
      gl.generateMipmap(gl.TEXTURE_2D);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    } else {
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    }
    return found;
  }

  /** A texture of an image. */
  image(bitmap) {
    const { gl } = this;
    return this.texture(Math.max(bitmap.width, bitmap.height), (target) =>
      gl.texImage2D(target, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap),
    );
  }

  /** @param {import("./geometry.js").Solid} solid @returns {Uploaded} */
  upload(solid) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffers = [
      [solid.positions, 3],
      [solid.normals, 3],
      [solid.uvs, 2],
    ].map(([numbers, width], place) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, width, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    gl.bindVertexArray(null);
    return { array, count: solid.positions.length / 3, buffers };
  }

  /** Gives up what was uploaded. */
  discard(solids, textures) {
    for (const { array, buffers } of solids) {
      this.gl.deleteVertexArray(array);
      for (const buffer of buffers) this.gl.deleteBuffer(buffer);
    }
    for (const texture of textures) this.gl.deleteTexture(texture);
  }

  /**
   * Draws a picture.
   * @param {Drawn[]} parts
   * @param {Drawn[]} onTop what is seen through all parts, in full light
   * @param {object} how view: matrix to the window; eye; sun: direction to it; light: matrix to the
   *   shadow map, or null; background, line: three numbers each; ground: {centre, reach, cell}
   */
  draw(parts, onTop, how) {
    const { gl } = this;
    const distance = ({ pose }) => Math.hypot(...how.eye.map((value, n) => value - pose[n]));
    const ranked = parts.map((part) => ({ part, far: part.isFloor ? Infinity : distance(part) }));
    ranked.sort((a, b) => a.far - b.far || 0);
    const nearFirst = ranked.map(({ part }) => part); // what is hidden is not shaded then
    const solid = nearFirst.filter((part) => part.colour[3] >= 1);
    const clear = nearFirst.filter((part) => part.colour[3] < 1).reverse();
    if (how.light) this.drawShadows(solid, how.light);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(...how.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.drawSolids(solid, how);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    this.drawGrid(how);
    this.drawSolids(clear, how);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.drawSolids(onTop, how, 0.8);
  }

  drawShadows(parts, light) {
    const { gl, shadows } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowBuffer);
    gl.viewport(0, 0, SHADOW_TEXELS, SHADOW_TEXELS);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 2);
    shadows.use();
    gl.uniformMatrix4fv(shadows.at("light"), false, light);
    for (const part of parts) {
      if (part.isFloor) continue;
      gl.uniformMatrix4fv(shadows.at("placing"), false, poseMatrix(part.pose, part.scale));
      this.triangles(part.solid);
    }
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  drawSolids(parts, how, flatness = 0) {
    const { gl, solids } = this;
    solids.use();
    gl.uniformMatrix4fv(solids.at("view"), false, how.view);
    gl.uniformMatrix4fv(solids.at("light"), false, how.light ?? parallel(1));
    gl.uniform3fv(solids.at("sun"), how.sun);
    gl.uniform3fv(solids.at("eye"), how.eye);
    gl.uniform1i(solids.at("hasShadow"), how.light ? 1 : 0);
    gl.uniform1f(solids.at("flatness"), flatness);
    gl.uniform1i(solids.at("surface"), 0);
    gl.uniform1i(solids.at("shadow"), 1);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.shadowMap);
    gl.activeTexture(gl.TEXTURE0);
    for (const part of parts) {
      gl.uniformMatrix4fv(solids.at("placing"), false, poseMatrix(part.pose, part.scale));
      gl.uniformMatrix3fv(solids.at("turning"), false, normalMatrix(part.pose, part.scale));
      gl.uniform4fv(solids.at("colour"), part.colour);
      gl.uniform1i(solids.at("hasSurface"), part.texture ? 1 : 0);
        gl.bindTexture(gl.TEXTURE_2D, part.texture ?? this.blank);
      this.triangles(part.solid);
    }
  }

  drawGrid({ view, ground, line }) {
    const { gl, grid } = this;
    this.square ??= this.upload({
      positions: new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, -1, 0, 1, 1, 0, -1, 1, 0]),
      normals: new Float32Array(18),
      uvs: new Float32Array(12),
    });
    grid.use();
    gl.uniformMatrix4fv(grid.at("view"), false, view);
    gl.uniform3fv(grid.at("centre"), ground.centre);
    gl.uniform3fv(grid.at("line"), line);
    gl.uniform1f(grid.at("reach"), ground.reach);
    gl.uniform1f(grid.at("cell"), ground.cell);
    this.triangles(this.square);
  }

  triangles({ array, count }) {
    this.gl.bindVertexArray(array);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, count);
  }
}

/** The matrix from the world to the shadow map of a light in direction `sun`, around a ball. */
export function lightMatrix(looking, radius) {
  return multiplied(parallel(radius), looking);
}

class Program {
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.program = gl.createProgram();
    for (const [kind, text] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getProgramInfoLog(this.program) || "a shader does not compile");
    }
    this.places = new Map();
  }

  use() {
    this.gl.useProgram(this.program);
  }

  /** The place of a uniform. */
  at(name) {
    if (!this.places.has(name)) {
      this.places.set(name, this.gl.getUniformLocation(this.program, name));
    }
    return this.places.get(name);
  }
}
