"use strict";
// occlusion.js: whether a straight line between two places meets a surface, with a bounding volume
// hierarchy of the triangles that the page has. There is no diffraction.

class Occluders {
  constructor(mesh) {
    const count = mesh.corners.length / 3;
    this.at = new Float32Array(9 * count);
    const middles = new Float32Array(3 * count);
    for (let t = 0; t < count; ++t)
      for (let c = 0; c < 3; ++c)
        for (let axis = 0; axis < 3; ++axis) {
          const value = mesh.positions[3 * mesh.corners[3 * t + c] + axis];
          this.at[9 * t + 3 * c + axis] = value;
          middles[3 * t + axis] += value / 3;
        }
    this.order = new Uint32Array(count).map((_, i) => i);
    this.boxes = [];   // six numbers a node
    this.links = [];   // first triangle and count of a leaf; -(second child) and 0 of others
    if (count > 0) this.build(middles, 0, count);
    this.boxes = Float32Array.from(this.boxes);
    this.links = Int32Array.from(this.links);
  }

  build(middles, first, last) {
    const node = this.links.length / 2, low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const from = [Infinity, Infinity, Infinity], to = [-Infinity, -Infinity, -Infinity];
    for (let i = first; i < last; ++i) {
      const t = this.order[i];
      for (let axis = 0; axis < 3; ++axis) {
        for (let c = 0; c < 3; ++c) {
          const value = this.at[9 * t + 3 * c + axis];
          if (value < low[axis]) low[axis] = value;
          if (value > high[axis]) high[axis] = value;
        }
        const middle = middles[3 * t + axis];
        if (middle < from[axis]) from[axis] = middle;
        if (middle > to[axis]) to[axis] = middle;
      }
    }
    this.boxes.push(...low, ...high);
    this.links.push(first, last - first);
    if (last - first <= 6) return;
    let axis = 0;
    for (let a = 1; a < 3; ++a) if (to[a] - from[a] > to[axis] - from[axis]) axis = a;
    const middle = (from[axis] + to[axis]) / 2;
    let i = first, j = last - 1;
    while (i <= j) {
      if (middles[3 * this.order[i] + axis] < middle) ++i;
      else [this.order[i], this.order[j--]] = [this.order[j], this.order[i]];
    }
    if (i === first || i === last) i = (first + last) >> 1;
    this.build(middles, first, i);
    this.links[2 * node] = -(this.links.length / 2);
    this.links[2 * node + 1] = 0;
    this.build(middles, i, last);
  }

  // Whether the segment is free from `start` to `end`, as shares of its length. `frontOnly`: of faces
  // that are turned to `a`.
  isFree(a, b, start, end, frontOnly = false) {
    if (this.links.length === 0) return true;
    const d = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], stack = [0];
    while (stack.length > 0) {
      const node = stack.pop();
      let near = start, far = end;
      for (let axis = 0; axis < 3; ++axis) {
        const low = this.boxes[6 * node + axis] - 1e-4, high = this.boxes[6 * node + 3 + axis] + 1e-4;
        if (Math.abs(d[axis]) < 1e-12) {
          if (a[axis] < low || a[axis] > high) far = -1;
          continue;
        }
        const t1 = (low - a[axis]) / d[axis], t2 = (high - a[axis]) / d[axis];
        near = Math.max(near, Math.min(t1, t2));
        far = Math.min(far, Math.max(t1, t2));
      }
      if (near > far) continue;
      const count = this.links[2 * node + 1];
      if (count === 0) {
        stack.push(-this.links[2 * node], node + 1);
        continue;
      }
      const first = this.links[2 * node];
      for (let i = first; i < first + count; ++i) if (this.hits(this.order[i], a, d, start, end, frontOnly)) return false;
    }
    return true;
  }

  // T. Moeller, B. Trumbore. Fast, Minimum Storage Ray-Triangle Intersection. 1997.
  hits(t, a, d, start, end, frontOnly) {
    const p = this.at, o = 9 * t;
    const ux = p[o + 3] - p[o], uy = p[o + 4] - p[o + 1], uz = p[o + 5] - p[o + 2];
    const vx = p[o + 6] - p[o], vy = p[o + 7] - p[o + 1], vz = p[o + 8] - p[o + 2];
    const hx = d[1] * vz - d[2] * vy, hy = d[2] * vx - d[0] * vz, hz = d[0] * vy - d[1] * vx;
    const det = ux * hx + uy * hy + uz * hz;
    if (Math.abs(det) < 1e-12 || (frontOnly && det < 0)) return false;
    const sx = a[0] - p[o], sy = a[1] - p[o + 1], sz = a[2] - p[o + 2];
    const u = (sx * hx + sy * hy + sz * hz) / det;
    if (u < 0 || u > 1) return false;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const v = (d[0] * qx + d[1] * qy + d[2] * qz) / det;
    if (v < 0 || u + v > 1) return false;
    const where = (vx * qx + vy * qy + vz * qz) / det;
    return where > start && where < end;
  }
}

// A function that tells whether a held source is in sight of the place. Rays start a centimetre in
// front of the source's wall, because the page stores corners in 1/65535 of the level.
function sightTo(level, occluders, place) {
  const at = level.sources.places, off = Math.max(0.01, 2 * Math.max(...level.mesh.size) / 65535);
  return (i) => {
    const o = 9 * i;
    const from = [at[o] + off * at[o + 3], at[o + 1] + off * at[o + 4], at[o + 2] + off * at[o + 5]];
    return occluders.isFree((level.sources.flags[i] & kEmitter) !== 0 ? [at[o], at[o + 1], at[o + 2]] : from, place, 1e-6, 1 - 1e-6);
  };
}
