"use strict";
// drawing.js: draws triangles, points and lines with plain WebGL2.
//
// A scene graph such as three.js would bring half a megabyte and a version to follow; the view needs
// three small shaders and no textures.

const kTriangleShader = [`#version 300 es
uniform mat4 camera; in vec3 place; in vec3 shade; out vec3 at; flat out vec3 colour;
void main() { at = place; colour = shade; gl_Position = camera * vec4(place, 1.0); }`,
`#version 300 es
precision highp float; uniform float cut; uniform vec3 eye; uniform vec2 heights; in vec3 at; flat in vec3 colour;
out vec4 ink;
void main() {
  if (at.y > cut) discard;
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
  if (dot(normal, eye - at) < 0.0) normal = -normal;
  float light = 0.78 + 0.22 * dot(normal, vec3(0.36, 0.80, 0.48)) + 0.10 * (at.y - heights.x) / (heights.y - heights.x);
  ink = vec4(colour * light, 1.0);
}`];
const kPointShader = [`#version 300 es
uniform mat4 camera; uniform float scale; uniform vec3 eye; in vec3 place; in vec4 shade; in float size;
out vec4 colour; out float height;
void main() {
  colour = shade;
  height = place.y;
  // A little nearer on the same line of sight, so that its wall does not hide half of a dot.
  gl_Position = camera * vec4(mix(eye, place, 0.995), 1.0);
  gl_PointSize = size * scale;
}`,
`#version 300 es
precision highp float; uniform float ring; uniform float cut; in vec4 colour; in float height; out vec4 ink;
void main() {
  if (height > cut) discard;
  float r = length(gl_PointCoord - 0.5) * 2.0;
  if (r > 1.0 || r < ring) discard;
  ink = vec4(colour.rgb, colour.a * (1.0 - smoothstep(0.85, 1.0, r)));
}`];
const kLineShader = [`#version 300 es
uniform mat4 camera; in vec3 place; in vec4 shade; out vec4 colour;
void main() { colour = shade; gl_Position = camera * vec4(place, 1.0); }`,
`#version 300 es
precision highp float; in vec4 colour; out vec4 ink; void main() { ink = colour; }`];

// A circle across a direction.
function circle(middle, across, radius, colour) {
  const n = unit(Math.hypot(...across) > 0.05 ? across : [0, 1, 0]), u = unit(outer(Math.abs(n[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0], n)), v = outer(n, u), list = [];
  const at = (k) => add(middle, add(times(u, radius * Math.cos(k * Math.PI / 24)), times(v, radius * Math.sin(k * Math.PI / 24))));
  for (let k = 0; k < 48; ++k) list.push({from: at(k), to: at(k + 1), colour});
  return list;
}

// The edges of a box with eight corners.
function boxEdges(corner, colour, alpha) {
  return [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]]
    .map(([from, to]) => ({from: corner(from), to: corner(to), colour, alpha}));
}

class Drawing {
  // Throws if the browser has no WebGL2.
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
    if (this.gl === null) throw new Error("no WebGL2");
    this.programs = {triangles: this.program(kTriangleShader), points: this.program(kPointShader), lines: this.program(kLineShader)};
    this.batches = new Map();
  }

  program([vertex, fragment]) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    return program;
  }

  // Replaces what is drawn under a name. `columns`: attribute -> [numbers a vertex, values].
  set(name, kind, columns, options = {}) {
    const gl = this.gl, old = this.batches.get(name);
    if (old !== undefined) {
      for (const buffer of old.buffers) gl.deleteBuffer(buffer);
      gl.deleteVertexArray(old.array);
    }
    const array = gl.createVertexArray(), buffers = [], program = this.programs[kind];
    gl.bindVertexArray(array);
    let count = 0;
    for (const [attribute, [size, values]] of Object.entries(columns)) {
      const where = gl.getAttribLocation(program, attribute), buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(where);
      gl.vertexAttribPointer(where, size, values instanceof Uint8Array ? gl.UNSIGNED_BYTE : gl.FLOAT, values instanceof Uint8Array, 0, 0);
      buffers.push(buffer);
      count = values.length / size;
    }
    this.batches.set(name, {kind, array, buffers, count, ...options});
  }

  points(name, list, options = {}) {
    this.set(name, "points", {
      place: [3, Float32Array.from(list.flatMap((p) => [...p.place]))],
      shade: [4, Uint8Array.from(list.flatMap((p) => [...p.colour, p.alpha ?? 255]))],
      size: [1, Float32Array.from(list.map((p) => p.size))]}, {onTop: true, ...options});
  }

  lines(name, list, options = {}) {
    this.set(name, "lines", {
      place: [3, Float32Array.from(list.flatMap((l) => [...l.from, ...l.to]))],
      shade: [4, Uint8Array.from(list.flatMap((l) => [...l.colour, l.alpha ?? 255, ...l.colour, l.alpha ?? 255]))]}, options);
  }

  draw(camera, {paper, cut, heights, names}) {
    const gl = this.gl, canvas = this.canvas, density = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(canvas.clientWidth * density)), height = Math.max(1, Math.round(canvas.clientHeight * density));
    if (canvas.width !== width || canvas.height !== height) canvas.width = width, canvas.height = height;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const matrix = camera.matrix(width / height), eye = camera.eye();
    for (const name of names) {
      const batch = this.batches.get(name);
      if (batch === undefined || batch.count === 0) continue;
      const program = this.programs[batch.kind], where = (uniform) => gl.getUniformLocation(program, uniform);
      gl.useProgram(program);
      gl.uniformMatrix4fv(where("camera"), false, matrix);
      if (batch.onTop === true) gl.disable(gl.DEPTH_TEST);
      else gl.enable(gl.DEPTH_TEST);
      gl.depthMask(batch.kind === "triangles");
      gl.bindVertexArray(batch.array);
      if (batch.kind === "triangles") {
        gl.uniform1f(where("cut"), cut);
        gl.uniform3fv(where("eye"), eye);
        gl.uniform2fv(where("heights"), heights);
        // Faces that are turned away are left out, which opens the near walls of a room.
        if (batch.bothSides === true) gl.disable(gl.CULL_FACE);
        else gl.enable(gl.CULL_FACE);
        gl.drawArrays(gl.TRIANGLES, 0, batch.count);
      } else if (batch.kind === "points") {
        gl.disable(gl.CULL_FACE);
        gl.uniform1f(where("scale"), density);
        gl.uniform1f(where("ring"), batch.ring ?? 0);
        gl.uniform1f(where("cut"), batch.onTop === true ? 1e9 : cut);
        gl.uniform3fv(where("eye"), eye);
        gl.drawArrays(gl.POINTS, 0, batch.count);
      } else {
        gl.drawArrays(gl.LINES, 0, batch.count);
      }
    }
    gl.depthMask(true);
  }
}
