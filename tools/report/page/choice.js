"use strict";
// choice.js: which sources a listener hears, by the priority sampling of runtime/sampling/sampler.h.
//
// A source's weight is w = sum_b weight_b I_b, its priority w f / u with f the boost of late
// reflections. The k sources of highest priority are chosen, and their power is scaled by
// max(1, tau / (w f)), tau being the next priority. The page holds the sources of highest P / u only;
// a source is held with probability min(1, P / m), m the highest key that is missing, so the scale is
// max(1, tau / (w f), m / P). A test compares this with the sampler in C++.

const kEmitter = 1, kImage = 2, kEmitterRadius_m = 0.1, kFullVoices = 2000;

function albedoOf(lobe, cosine) {
  const cells = lobe.albedo.length - 1, x = Math.sqrt(Math.min(Math.max(cosine, 0), 1)) * cells;
  const k = Math.min(Math.floor(x), cells - 1);
  return lobe.albedo[k] + (x - k) * (lobe.albedo[k + 1] - lobe.albedo[k]);
}

// Density of a lobe per steradian (common/reflection.h).
function lobeDensity(lobe, cosIn, cosOut, cosAxis) {
  const p = lobe.exponent;
  const specular = cosAxis > 0
    ? (p + 1) / (2 * Math.PI) * Math.pow(cosAxis, p) * Math.min(1, cosOut / Math.max(cosIn, 1e-9)) : 0;
  return specular +
    (1 - albedoOf(lobe, cosIn)) * (1 - albedoOf(lobe, cosOut)) / (Math.PI * (1 - lobe.mean)) * cosOut;
}

// Intensities per band of source i at a place (runtime/propagation/received_intensity.h), into `out`;
// returns whether anything is heard.
function intensityAt(level, i, place, out) {
  const s = level.sources, at = s.places, o = 9 * i;
  const dx = place[0] - at[o], dy = place[1] - at[o + 1], dz = place[2] - at[o + 2];
  const r = Math.sqrt(dx * dx + dy * dy + dz * dz);
  const cosNormal = r > 0 ? (dx * at[o + 3] + dy * at[o + 4] + dz * at[o + 5]) / r : 1;
  let radius = kEmitterRadius_m;
  if ((s.flags[i] & kEmitter) !== 0) {
    const kind = level.kinds[s.kinds[i]], base = (1 + Math.min(Math.max(cosNormal, -1), 1)) / 2;
    for (let b = 0; b < 8; ++b) {
      const p = kind.directivity[b];
      out[b] = s.powers[8 * i + b] * (p + 1) / (4 * Math.PI) * (p === 0 ? 1 : Math.pow(base, p));
    }
  } else {
    if (cosNormal <= 0) return false;
    const cosIn = at[o + 3] * at[o + 6] + at[o + 4] * at[o + 7] + at[o + 5] * at[o + 8];
    const cosAxis = Math.min(1, r > 0 ? (dx * at[o + 6] + dy * at[o + 7] + dz * at[o + 8]) / r : cosIn);
    const law = level.laws.materials[s.materials[i]];
    let last = null, density = 0;
    for (let b = 0; b < 8; ++b) {
      const lobe = law.lobes[b];
      if (lobe !== null && lobe !== last) density = lobeDensity(last = lobe, cosIn, cosNormal, cosAxis);
      out[b] = s.powers[8 * i + b] *
        (law.scattering[b] * cosNormal / Math.PI + (lobe !== null ? (1 - law.scattering[b]) * density : 0));
    }
    radius = Math.max(radius, s.radii[i]);
  }
  const near = Math.max(r, radius), spread = 1 / (near * near);
  for (let b = 0; b < 8; ++b) out[b] *= spread * Math.exp(-level.airLoss[b] * r);
  return true;
}

function boostOf(level, i, voices) {
  const share = voices / kFullVoices, strength = share > 1 ? 1 / share : share;
  const ms = Math.min(Math.max(Math.floor(Math.fround(level.sources.delays[i] * 1000)), 0), 300);
  return 1 + strength * level.lateBoost[ms];
}

// The k sources of highest priority, best first, of those that isVisible(i) confirms, with tau.
// Images are left out: whether they are heard depends on the mirrors on their way.
function choose(level, place, voices, isVisible) {
  const s = level.sources, bands = new Float64Array(8), found = [];
  for (let i = 0; i < s.held; ++i) {
    if ((s.flags[i] & kImage) !== 0 || !intensityAt(level, i, place, bands)) continue;
    const weights = level.weights[level.kinds[s.kinds[i]].signal];
    let weight = 0;
    for (let b = 0; b < 8; ++b) weight += weights[b] * bands[b];
    if (!(weight > 0)) continue;
    const boosted = weight * boostOf(level, i, voices);
    found.push({index: i, weight, boosted, priority: boosted / Math.max(s.us[i], 2 ** -64)});
  }
  found.sort((a, b) => b.priority - a.priority || a.index - b.index);
  const chosen = [];
  let tau = 0, hidden = 0;
  for (const one of found) {
    if (isVisible !== null && !isVisible(one.index)) {
      ++hidden;
      continue;
    }
    if (chosen.length === voices) {
      tau = one.priority;
      break;
    }
    chosen.push(one);
  }
  for (const one of chosen) {
    let power = 0;
    for (let b = 0; b < 8; ++b) power += s.powers[8 * one.index + b];
    one.scale = Math.max(1, tau / one.boosted, s.missingKey / power);
  }
  return {chosen, tau, hidden, audible: found.length};
}
