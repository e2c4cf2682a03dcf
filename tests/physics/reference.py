#!/usr/bin/env python3
"""Independent reference for tests/physics: small, slow, and without code from Clamor.

  reference.py albedo          share of a Phong lobe that survives above the surface, by quadrature
  reference.py room NAME...    T30 and level of rooms, by a Monte Carlo tracer of boxes (or: all)
  reference.py listener NAME   reflected intensity at one place while the source plays on, by the same tracer
  reference.py images          first-order images of the shoebox of first_order_test.cpp

Needs numpy and scipy. Rooms are boxes with walls -x +x -y +y -z +z, intersected in closed form. Photons lose
weight by absorption without Russian roulette, so the only bias is the time step of 1 ms. Errors are standard
errors of the mean over independent batches.
"""
import sys

import numpy as np

SPEED = 343.2  # m/s, at 20 C; there is no air absorption

# boxes: low corner, size, absorption of the six walls. portal: an opening in the wall that two boxes share.
# law: scattering share and Phong exponent of all walls; without one they are Lambert's.
ROOMS = {
    "uniform": dict(boxes=[((0, 0, 0), (6, 8, 3), (0.2,) * 6)], source=(2, 3, 1.2), seconds=0.75),
    "live": dict(boxes=[((0, 0, 0), (6, 8, 3), (0.05,) * 6)], source=(2, 3, 1.2), seconds=3.0),
    "uneven": dict(boxes=[((0, 0, 0), (10, 8, 3.5), (0.1, 0.1, 0.1, 0.1, 0.3, 0.6))], source=(3, 2.5, 1.5), seconds=0.65),
    "flat": dict(boxes=[((0, 0, 0), (20, 15, 2.5), (0.1, 0.1, 0.1, 0.1, 0.2, 0.4))], source=(5, 6, 1.2), seconds=0.55),
    "long": dict(boxes=[((0, 0, 0), (30, 3, 3), (0.2, 0.2, 0.1, 0.1, 0.1, 0.1))], source=(4, 1.2, 1.4), seconds=1.3),
    "glossy": dict(boxes=[((0, 0, 0), (5, 4, 3), (0.1, 0.3, 0.1, 0.1, 0.2, 0.4))], source=(1.3, 1.7, 1.1), seconds=0.55, law=(0.3, 20)),
    "coupled": dict(boxes=[((0, 0, 0), (6, 5, 3), (0.3,) * 6), ((6, 0, 0), (5, 5, 3), (0.3,) + (0.1,) * 5)], source=(2, 3, 1.2),
                    seconds=1.6, portal=((6, 1.5, 0), (6, 3, 2.2))),
    "dry": dict(boxes=[((0, 0, 0), (6, 5, 3), (0.4, 0.5, 0.3, 0.5, 0.6, 0.7))], source=(2, 3, 1.2), listener=(4.2, 1.3, 1.6), seconds=1),
}


def ring_share(a, cos_i, p):
    """Density in the angle a to the mirror direction of what a lobe cos^p(a) min(1, cos o / cos i) keeps."""
    up, swing = np.cos(a) * cos_i, np.sin(a) * np.sqrt(1 - cos_i**2)
    turn = lambda cos_o: np.arccos(np.clip((cos_o - up) / max(swing, 1e-300), -1, 1))
    full, empty = turn(cos_i), turn(0)
    mean = full + (up * (empty - full) + swing * (np.sin(empty) - np.sin(full))) / cos_i
    return mean / np.pi * (p + 1) * np.cos(a) ** p * np.sin(a)


def albedo(p, cos_i):
    from scipy.integrate import quad

    width = 1 / np.sqrt(p + 1)
    ends = [x for x in (0, 0.5 * width, width, 2 * width, 4 * width, 8 * width) if x < np.pi / 2] + [np.pi / 2]
    return sum(quad(ring_share, a, b, (cos_i, p), epsabs=1e-11, epsrel=1e-10, limit=400)[0] for a, b in zip(ends, ends[1:]))


def around(axis, cos_a, rng):
    """Unit vectors at a given angle to unit axes, turned at random."""
    helper = np.where(np.abs(axis[:, :1]) < 0.6, [[1.0, 0, 0]], [[0, 1.0, 0]])
    tangent = np.cross(axis, helper)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    turn = 2 * np.pi * rng.random(len(axis))
    sin_a = np.sqrt(np.maximum(0, 1 - cos_a**2))
    return axis * cos_a[:, None] + tangent * (sin_a * np.cos(turn))[:, None] + np.cross(axis, tangent) * (sin_a * np.sin(turn))[:, None]


class Law:
    def __init__(self, scattering=1.0, p=0.0):
        self.s, self.p = scattering, p
        if scattering < 1:
            mu = np.linspace(0, 1, 401)
            lost = np.array([1 - albedo(p, max(m, 1e-6)) for m in mu]) * mu
            share = np.concatenate(([0], np.cumsum((lost[1:] + lost[:-1]) / 2)))
            self.mu, self.share = mu, share / share[-1]

    def draw(self, arrival, normal, rng):
        out = around(normal, np.sqrt(rng.random(len(arrival))), rng)
        if self.s >= 1:
            return out
        cos_i = -(arrival * normal).sum(1)
        lobe = around(arrival + 2 * cos_i[:, None] * normal, rng.random(len(arrival)) ** (1 / (self.p + 1)), rng)
        cos_o = (lobe * normal).sum(1)
        taken = (cos_o > 0) & (rng.random(len(arrival)) * cos_i < cos_o)
        diffuse = around(normal, np.interp(rng.random(len(arrival)), self.share, self.mu), rng)
        lobe = np.where(taken[:, None], lobe, diffuse)
        return np.where((rng.random(len(arrival)) < self.s)[:, None], out, lobe)


def trace(room, photons, rng, law):
    """Reflected energy in each box at 0, 1, 2 ... ms, and its integral over time, as shares of what was emitted;
    and, of Lambert's walls, the reflected intensity at the listener, 1 being the source's own at 1 m."""
    low = np.array([b[0] for b in room["boxes"]], float)
    high = low + np.array([b[1] for b in room["boxes"]], float)
    alpha = np.array([b[2] for b in room["boxes"]], float)
    portal = np.array(room["portal"], float) if "portal" in room else None
    steps = int(room["seconds"] * 1000)
    energy = np.zeros((len(low), steps + 2))
    integral = np.zeros(len(low))
    heard = 0
    p = np.tile(np.array(room["source"], float), (photons, 1))
    z = 1 - 2 * rng.random(photons)
    turn = 2 * np.pi * rng.random(photons)
    r = np.sqrt(1 - z * z)
    d = np.stack((r * np.cos(turn), r * np.sin(turn), z), 1)
    t, w = np.zeros(photons), np.full(photons, 1 / photons)
    box, bounced = np.zeros(photons, int), np.zeros(photons, bool)
    while len(p):
        n = np.arange(len(p))
        wall = np.where(d > 0, high[box], low[box])
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = np.where(d == 0, np.inf, (wall - p) / d)
        axis = reach.argmin(1)
        length = np.maximum(reach[n, axis], 0)
        until = t + length / SPEED
        share = np.where(bounced, w, 0)
        first = np.minimum(np.ceil(t * 1000), steps).astype(int)
        last = np.minimum(np.ceil(until * 1000), steps).astype(int)
        for k in range(len(low)):
            here = np.where(box == k, share, 0)
            energy[k] += np.bincount(first, here, steps + 2) - np.bincount(last, here, steps + 2)
            integral[k] += (here * length).sum() / SPEED
        p = p + d * length[:, None]
        p[n, axis] = wall[n, axis]
        t = until
        through = np.zeros(len(p), bool)
        if portal is not None:
            inner = axis == 0
            through = inner & (np.abs(p[:, 0] - portal[0, 0]) < 1e-12) & (p[:, 1:] > portal[0, 1:]).all(1) & (p[:, 1:] < portal[1, 1:]).all(1)
        box = np.where(through, 1 - box, box)
        side = (d[n, axis] > 0).astype(int)
        normal = np.zeros_like(p)
        normal[n, axis] = 1 - 2 * side
        w = np.where(through, w, w * (1 - alpha[box, 2 * axis + side]))
        if "listener" in room:
            path = room["listener"] - p
            r2 = (path**2).sum(1)
            heard += (4 * np.pi * w * (path * normal).sum(1) / np.sqrt(r2) / np.pi / r2).sum()
        d = np.where(through[:, None], d, law.draw(d, normal, rng))
        d /= np.linalg.norm(d, axis=1)[:, None]
        bounced |= ~through
        on = t < room["seconds"]
        p, d, t, w, box, bounced = p[on], d[on], t[on], w[on], box[on], bounced[on]
    return np.cumsum(energy, 1)[:, :steps], integral, heard


def t30(energy):
    """Least squares from -5 to -35 dB of the backward integral (ISO 3382-1)."""
    left = np.cumsum(energy[::-1])[::-1]
    level = 10 * np.log10(np.maximum(left, 1e-300) / left[0])
    fit = (level <= -5) & (level >= -35)
    return -60 / np.polyfit(np.arange(len(level))[fit] * 1e-3, level[fit], 1)[0]


def rooms(names, photons=100000, batches=10):
    for name in ROOMS if names == ["all"] else names:
        room = ROOMS[name]
        law = Law(*room.get("law", (1, 0)))
        traced = [trace(room, photons, np.random.default_rng([5, k]), law) for k in range(batches)]
        for k in range(len(room["boxes"])):
            times = np.array([t30(energy[k]) for energy, _, _ in traced])
            levels = np.array([integral[k] for _, integral, _ in traced])
            mean = t30(np.mean([energy[k] for energy, _, _ in traced], 0))
            print(f"{name}, box {k}: T30 {mean:.5f} s +- {times.std(ddof=1) / batches**0.5:.5f}, "
                  f"reflected energy x time {levels.mean():.6f} s +- {levels.std(ddof=1) / batches**0.5:.6f}", flush=True)


def listener(name, photons=200000, batches=40):
    heard = np.array([trace(ROOMS[name], photons, np.random.default_rng([6, k]), Law())[2] for k in range(batches)])
    print(f"{name}: reflected intensity {heard.mean():.6f} +- {heard.std(ddof=1) / batches**0.5:.6f} at {ROOMS[name]['listener']}")


def images(size=(5, 4, 3), alpha=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6), source=(1.3, 1.7, 1.1), ear=(3.9, 2.4, 1.6)):
    for wall in range(6):
        image = np.array(source)
        image[wall // 2] = 2 * size[wall // 2] * (wall % 2) - image[wall // 2]
        r = np.linalg.norm(np.array(ear) - image)
        print(f"wall {wall}: {r / SPEED:.9f} s, {(1 - alpha[wall]) / r**2:.8f} of the source at 1 m")


if __name__ == "__main__":
    what, rest = (sys.argv[1:2] or [""])[0], sys.argv[2:]
    if what == "albedo":
        for p in (0.01, 1, 10, 100, 1000):
            print(p, ["%.7f" % albedo(p, np.cos(np.radians(i))) for i in (0, 30, 60, 80, 85, 88, 89)])
    elif what == "room":
        rooms(rest)
    elif what == "listener":
        listener(*rest)
    elif what == "images":
        images()
    else:
        sys.exit(__doc__)
