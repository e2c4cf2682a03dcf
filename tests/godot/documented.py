"""documented.py FOLDER: fails if something public in the XML of `godot --doctool --gdscript-docs` has no text."""
import pathlib
import sys
import xml.etree.ElementTree as xml

missing, seen = [], 0
for path in sorted(pathlib.Path(sys.argv[1]).glob("**/*.xml")):
    root = xml.parse(path).getroot()
    if not root.get("name").startswith("Clamor"):
        continue
    texts = [("", root.find("brief_description").text)]
    for kind in ("method", "signal"):
        texts += [(item.get("name"), item.find("description").text) for item in root.iter(kind)]
    for kind in ("member", "constant"):
        texts += [(item.get("name"), item.text) for item in root.iter(kind)]
    for name, text in texts:
        if not name.startswith("_"):
            seen += 1
            if not (text or "").strip():
                missing.append(f"{root.get('name')}.{name}")
print(f"{seen} descriptions in Godot's help, {len(missing)} missing", *missing)
sys.exit(bool(missing) or seen < 50)
