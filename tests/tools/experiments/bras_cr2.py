#!/usr/bin/env python3
"""bras_cr2.py DATA FOLDER: writes the seminar room CR2 of BRAS as cr2.gltf and cr2.room.json; and, to start
from names of materials alone, cr2.named.room.json, cr2.start.json (a sidecar) and cr2.measured.json.

DATA holds the room's files: the geometry (AC3D text, a surface's first line is SURF), absorption and
scattering in third octaves, and the measured means over all pairs. BRAS - Benchmark for Room Acoustical
Simulation, DOI 10.14279/depositonce-6726.3, CC BY-SA 4.0; scene9.ac: CC BY-NC-SA 4.0.
"""
import base64
import json
import struct
import sys
from pathlib import Path

DATA, FOLDER = Path(sys.argv[1]), Path(sys.argv[2])
NAMES = ("concrete", "windows", "ceiling", "plaster", "floor")  # by number of an AC3D material


def rows_of(path):
    return [[float(x) for x in line.split(",")] for line in path.read_text().splitlines() if line]


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def triangles_of(polygon):
    """Cuts off ears, since some polygons are concave."""
    normal = [0, 0, 0]
    for a, b in zip(polygon, polygon[1:] + polygon[:1]):
        normal = [n + c for n, c in zip(normal, cross(a, b))]
    corners = list(polygon)
    while len(corners) > 3:
        for i, b in enumerate(corners):
            a, c = corners[i - 1], corners[(i + 1) % len(corners)]
            if dot(cross(minus(b, a), minus(c, b)), normal) <= 0:
                continue
            edges = ((a, b), (b, c), (c, a))
            if any(all(dot(cross(minus(y, x), minus(p, x)), normal) >= 0 for x, y in edges)
                   for p in corners if p not in (a, b, c)):
                continue
            break
        yield corners[i - 1], corners[i], corners[(i + 1) % len(corners)]
        del corners[i]
    yield tuple(corners)


def triangles_by_material():
    found = {name: [] for name in NAMES}
    vertices, polygon, left = [], [], 0
    for words in filter(None, map(str.split, (DATA / "scene9.ac").read_text().splitlines())):
        if words[0] == "OBJECT":
            vertices = []
        elif words[0] == "mat":
            name = NAMES[int(words[1])]
        elif words[0] == "refs":
            polygon, left = [], int(words[1])
        elif left:
            polygon.append(vertices[int(words[0])])
            left -= 1
            if left == 0:
                found[name] += triangles_of(polygon)
        elif words[0][0] in "-0123456789":
            vertices.append([float(x) for x in words])
    return found


def gltf(found):
    data, views, accessors, primitives = b"", [], [], []
    for number, triangles in enumerate(found.values()):
        corners = [corner for triangle in triangles for corner in triangle]
        packed = b"".join(struct.pack("<3f", *corner) for corner in corners)
        columns = list(zip(*(struct.unpack("<3f", struct.pack("<3f", *c)) for c in corners)))
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
        accessors.append({"bufferView": number, "componentType": 5126, "type": "VEC3", "count": len(corners),
                          "min": [min(c) for c in columns], "max": [max(c) for c in columns]})
        primitives.append({"attributes": {"POSITION": number}, "material": number})
        data += packed
    return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": primitives}], "materials": [{"name": name} for name in found],
            "accessors": accessors, "bufferViews": views,
            "buffers": [{"byteLength": len(data),
                         "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]}


def material(name):
    hz, absorption, scattering = rows_of(DATA / f"mat_CR2_{name}.csv")
    return {"bandsHz": hz, "absorption": absorption, "scattering": scattering}


def measured():
    of = {key: rows_of(DATA / f"Evaluation_CR2_{key}.txt") for key in ("EDT", "T20", "C80", "D50")}
    return {"bandsHz": of["EDT"][0], "edt_s": of["EDT"][1], "t20_s": of["T20"][1], "c80_db": of["C80"][1],
            "d50": [percent / 100 for percent in of["D50"][1]]}


ROOM = {
    "name": "CR2, a seminar room",
    "source": "BRAS - Benchmark for Room Acoustical Simulation, DOI 10.14279/depositonce-6726.3, CC BY-SA 4.0",
    "level": "cr2.gltf",
    "air": {"temperature_c": 19.5, "humidity_percent": 41.7},
    "materials": {name: material(name) for name in NAMES},
    "sources": [{"name": "LS01", "at": [0.931, 0.723, 2.547], "facing": [-1, 0, 0]},
                {"name": "LS02", "at": [0.119, 0.723, -2.880], "facing": [0, 0, 1]}],
    "receivers": [{"name": name, "at": at} for name, at in (
        ("MP01", [-0.993, 1.230, -1.426]), ("MP02", [0.439, 1.230, 0.147]), ("MP03", [1.361, 1.230, 0.603]),
        ("MP04", [-1.110, 1.230, 0.256]), ("MP05", [-0.998, 1.230, 1.409]))],
    "measured": [measured()],
}
(FOLDER / "cr2.gltf").write_text(json.dumps(gltf(triangles_by_material())))
(FOLDER / "cr2.room.json").write_text(json.dumps(ROOM, indent=1))
NAMED = {key: value for key, value in ROOM.items() if key != "materials"}
START = {"emitters": [{"name": one["name"], "signal": "impulse", "at": one["at"]} for one in ROOM["sources"]],
         "settings": {"air": ROOM["air"]}}
for name, value in (("cr2.named.room", NAMED), ("cr2.start", START), ("cr2.measured", measured())):
    (FOLDER / f"{name}.json").write_text(json.dumps(value))
