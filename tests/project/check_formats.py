#!/usr/bin/env python3
"""check_formats.py PROGRAM FOLDER: the JSON that Clamor reads and writes is what the pages say.

Scripts (formats/scripts.md) are valid by their schemas where the program accepts them, and only there.
Each key that a command writes with --json is documented in tools/README.md.
"""
import copy
import json
import re
import subprocess
import sys
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
try:
    import jsonschema
except ImportError:
    print("skipped: python3-jsonschema is not installed")
    sys.exit(77)

PROGRAM, FOLDER = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
FOLDER.mkdir(parents=True, exist_ok=True)
failures = []


def expect(true, what):
    if not true:
        failures.append(what)


def clamor(*words):
    return subprocess.run([PROGRAM, *words], cwd=FOLDER, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE)


def read_json(path):
    return json.loads((SOURCE / path).read_text())


# --- Scripts ----------------------------------------------------------------------------------------
SCHEMAS = {name: read_json(f"formats/{name}.schema.json") for name in ("walk", "moving", "acoustics", "room")}
STORE = {f"{name}.schema.json": schema for name, schema in SCHEMAS.items()}


def is_valid(name, document):
    jsonschema.Draft202012Validator.check_schema(SCHEMAS[name])
    resolver = jsonschema.RefResolver(f"{name}.schema.json", SCHEMAS[name], store=STORE)
    return jsonschema.Draft202012Validator(SCHEMAS[name], resolver=resolver).is_valid(document)


def is_accepted(name, document):
    (FOLDER / "script.json").write_text(json.dumps(document))
    place = () if name == "walk" else ("--listener", "1,1.7,1")
    done = clamor("render", "level.clamor", "-o", "heard.wav", "--seconds", "0.04", "--voices", "8",
                  "--receivers", "omni", *place, f"--{name}", "script.json")
    expect(done.returncode in (0, 1), done.stderr)
    return done.returncode == 0


def compare(name, document, what):
    valid, accepted = is_valid(name, document), is_accepted(name, document)
    expect(valid == accepted, f"{name}: {what}: valid by the schema: {valid}, accepted: {accepted}")
    return accepted


# Each value in turn becomes something else, and each key is left out, added or misspelt.
def mutations(document):
    def places(node, path):
        for key in node if isinstance(node, dict) else range(len(node)):
            yield path + [key]
            if isinstance(node[key], (dict, list)):
                yield from places(node[key], path + [key])

    for path in places(document, []):
        for kind in ("removed", "misspelt", -1, 1e9, "text"):
            changed = copy.deepcopy(document)
            node = changed
            for key in path[:-1]:
                node = node[key]
            if kind == "removed":
                del node[path[-1]]
            elif kind == "misspelt":
                if not isinstance(node, dict):
                    continue
                node[path[-1] + "x"] = node.pop(path[-1])
            elif path[-1] in ("name", "signal") and kind == "text":
                continue  # a name of nothing in the level, which no schema knows
            else:
                node[path[-1]] = kind
            yield path, kind, changed


def examples_of_page():
    text = (SOURCE / "formats/scripts.md").read_text()
    return [json.loads(block) for block in re.findall(r"^```json\n(.*?)^```$", text, re.M | re.S)]


def make_level():
    """A box with a movable door and a portal, both named as in the page's example."""
    box = [[x, y, z] for x in (-5, 5) for y in (0, 3) for z in (-5, 5)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    door = [[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]]
    data, views, accessors = b"", [], []

    def add(rows, form, kind, component):
        nonlocal data
        import struct
        packed = b"".join(struct.pack("<" + form * len(row), *row) for row in rows)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
        accessor = {"bufferView": len(views) - 1, "componentType": component, "type": kind,
                    "count": len(rows)}
        if kind == "VEC3":
            accessor |= {"min": [min(c) for c in zip(*rows)], "max": [max(c) for c in zip(*rows)]}
        accessors.append(accessor)
        data += packed
        return len(accessors) - 1

    meshes = []
    for corners, quads in ((box, faces), (door, [[0, 1, 2, 3]])):
        indices = [[i] for a, b, c, d in quads for i in (a, b, c, a, c, d)]
        meshes.append({"primitives": [{
            "attributes": {"POSITION": add([list(map(float, c)) for c in corners], "f", "VEC3", 5126)},
            "indices": add(indices, "I", "SCALAR", 5125)}]})
    import base64
    level = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}], "meshes": meshes,
             "nodes": [{"mesh": 0, "name": "Room"},
                       {"mesh": 1, "name": "Door", "translation": [2, 0, -2]}],
             "accessors": accessors, "bufferViews": views, "buffers": [{
                 "byteLength": len(data),
                 "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]}
    sidecar = {"movable": ["Door"], "materials": {"*": {"absorption": 0.9}},
               "emitters": [{"name": "click", "signal": "impulse", "at": [1, 1.2, 1]}],
               "portals": [{"name": "Door", "at": [2.5, 1, -2], "size": [1, 2], "facing": [0, 0, 1]}]}
    (FOLDER / "level.gltf").write_text(json.dumps(level))
    (FOLDER / "level.acoustics.json").write_text(json.dumps(sidecar))
    done = clamor("bake", "level.gltf", "-o", "level.clamor", "--photons", "10", "--no-journal")
    expect(done.returncode == 0, done.stderr)


make_level()
walk, script = examples_of_page()
expect(compare("walk", read_json("assets/levels/stadium_walk.json"), "the stadium's walk"), "stadium_walk.json")
tried = 0
for name, example in (("walk", walk), ("moving", script)):
    expect(compare(name, example, "the page's example"), f"the example of a {name} file is refused")
    for path, kind, changed in mutations(example):
        compare(name, changed, f"{path}: {kind}")
        tried += 1

room = re.search(r"^```json\n(.*?)^```$", (SOURCE / "bake/README.md").read_text(), re.M | re.S)
expect(is_valid("room", json.loads(room[1])), "the page's example of a measured room is not valid by the schema")

# --- Output -----------------------------------------------------------------------------------------
PAGE = (SOURCE / "tools/README.md").read_text()
DOCUMENTED = {}  # a command may have several rows
for command, keys in re.findall(r"^\| `(\w+) --json`[^|]* \| (.*) \|$", PAGE, re.M):
    DOCUMENTED[command] = DOCUMENTED.get(command, "") + keys


def keys_of(value):
    if isinstance(value, dict):
        for key, member in value.items():
            yield key
            yield from keys_of(member)
    elif isinstance(value, list):
        for member in value:
            yield from keys_of(member)


def check_keys(command, keys):
    keys = set(keys)
    expect(keys, f"{command} --json wrote nothing")
    for key in sorted(keys):
        expect(f"`{key}`" in DOCUMENTED.get(command, ""), f"tools/README.md documents no `{key}` of {command} --json")
    for key in re.findall(r"`(\w+)`", DOCUMENTED.get(command, "")):
        expect(key in keys, f"tools/README.md documents `{key}`, which {command} --json does not write")


def written(*words):
    done = clamor(*words, "--json")
    expect(done.returncode == 0, done.stderr)
    return keys_of(json.loads(done.stdout or "{}"))


# Devices, a benchmark of minutes and comparisons of all kinds: the keys that their source names.
def in_source(command):
    text = (SOURCE / f"tools/commands/{command}_command.cpp").read_text()
    text = re.sub(r"parser\.choice\(.*?\);", "", text[re.search(r"\bOrderedJson\b", text).end():], flags=re.DOTALL)
    return re.findall(r'\{"([a-z]\w*)",(?! ")|(?:json|one)\["(\w+)"\]', text)


at = ("--listener", "-1,1.7,1")
check_keys("impulse", [*written("impulse", "level.clamor", "-o", "ir.wav", *at),
                       *written("impulse", "level.clamor", "-o", "irs.wav", *at, *at)])
check_keys("materials", written("materials"))
for command in ("compare", "devices", "bench"):
    check_keys(command, {first or second for first, second in in_source(command)})
print(f"{tried} changed scripts")
for failure in failures[:40]:
    print(failure)
sys.exit(1 if failures else 0)
