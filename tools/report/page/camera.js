"use strict";
// camera.js: a camera that turns round a point, and the matrices that it needs.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const times = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const inner = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const outer = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => times(a, 1 / Math.max(1e-12, Math.hypot(...a)));

class Camera {
  constructor(low, high) {
    this.low = low;
    this.high = high;
    this.reset();
  }

  reset() {
    const size = minus(this.high, this.low);
    this.target = times(add(this.low, this.high), 0.5);
    this.extent = Math.max(0.5, Math.hypot(...size));
    this.distance = 1.5 * this.extent;
    // Looks along the shorter side, so that the longer one lies across.
    this.turn = size[0] >= size[2] ? 0.5 : 0.5 + Math.PI / 2;
    this.tilt = 0.75;
  }

  // The least distance from which all corners are in view.
  fit(aspect) {
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((axis) => (k >> axis & 1 ? this.high : this.low)[axis]));
    for (this.distance = 4 * this.extent; this.distance > 0.5 * this.extent; this.distance *= 0.97)
      if (corners.some((corner) => this.project(corner, aspect).some((x) => Math.abs(x) > 0.93))) break;
  }

  eye() {
    const flat = Math.cos(this.tilt);
    return add(this.target, times([flat * Math.sin(this.turn), Math.sin(this.tilt), flat * Math.cos(this.turn)], this.distance));
  }

  axes() {
    const back = unit(minus(this.eye(), this.target)), right = unit(outer([0, 1, 0], back));
    return {back, right, up: outer(back, right)};
  }

  orbit(turn, tilt) {
    this.turn += turn;
    this.tilt = Math.min(1.55, Math.max(-1.2, this.tilt + tilt));
  }

  pan(x, y) {
    const {right, up} = this.axes();
    this.target = add(this.target, add(times(right, -x * this.distance), times(up, y * this.distance)));
  }

  zoom(factor) { this.distance = Math.min(20 * this.extent, Math.max(0.02 * this.extent, this.distance * factor)); }

  lookAt(place, size) {
    this.target = place;
    this.distance = Math.max(4, 3 * size, 0.12 * this.extent);
  }

  // Column-major projection times view.
  matrix(aspect) {
    const {back, right, up} = this.axes(), eye = this.eye();
    const near = this.extent / 500, far = 40 * this.extent, f = 1 / Math.tan(0.35);
    const sx = aspect < 1 ? f : f / aspect, sy = aspect < 1 ? f * aspect : f;
    const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    const view = [right, up, back], move = [-inner(right, eye), -inner(up, eye), -inner(back, eye)];
    const out = new Float32Array(16);
    for (let c = 0; c < 3; ++c) {
      out[4 * c] = sx * view[0][c];
      out[4 * c + 1] = sy * view[1][c];
      out[4 * c + 2] = a * view[2][c];
      out[4 * c + 3] = -view[2][c];
    }
    out[12] = sx * move[0];
    out[13] = sy * move[1];
    out[14] = a * move[2] + b;
    out[15] = -move[2];
    return out;
  }

  // Where a place is seen, in shares of the view from its middle (up to 1), or null behind the eye.
  project(place, aspect) {
    const m = this.matrix(aspect), p = [0, 0, 0, 0];
    for (let r = 0; r < 4; ++r) p[r] = m[r] * place[0] + m[4 + r] * place[1] + m[8 + r] * place[2] + m[12 + r];
    return p[3] > 0 ? [p[0] / p[3], p[1] / p[3]] : null;
  }

  // The place at the height of `place` that is seen at (x, y).
  onPlane(x, y, aspect, place) {
    const {back, right, up} = this.axes(), f = 1 / Math.tan(0.35), eye = this.eye();
    const sx = aspect < 1 ? f : f / aspect, sy = aspect < 1 ? f * aspect : f;
    const way = minus(add(times(right, x / sx), times(up, y / sy)), back);
    if (Math.abs(way[1]) < 1e-6) return null;
    const t = (place[1] - eye[1]) / way[1];
    return t > 0 ? add(eye, times(way, t)) : null;
  }
}
