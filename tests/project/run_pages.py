#!/usr/bin/env python3
"""run_pages.py PROGRAM FOLDER [--with NEED,NEED...] [PAGE...]: runs the command lines of the pages.

Each page's `sh` blocks run in order, in one shell and as they stand, in FOLDER/root, which looks like
the repository but for small levels. Files that a page shows lie there, or in game if the page goes
there. A line that ends in `# needs NEED, NEED` waits for --with, and so does the rest of a block after
a line that says only that. What waits is printed and is no failure.
Then each `clamor ...` within a text is checked: its options exist.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
# What a line may need, and where it is tried instead.
NEEDS = {
    "minutes": "tools/packaging/try_pages",
    "a quarter of an hour": "CI",
    "a sound device": "tests/player",
    "a screen": "tests/tools/view, and tools/packaging/try_pages",
    "the benchmarks": "by hand",
    "BRAS": "tests/tools/experiments/room_experiment_test.cpp",
    "Ctrl-C to end": "tests/tools/view/progressive_bake_test.cpp, and tools/packaging/try_pages",
    "~/clamor": "tests/library, and tools/packaging/try_pages",
    "root": "tools/packaging", "the player for the web": "tests/web/run, and tests/tools/report/page",
    "debootstrap": "before a release",
    "Blender": "tests/formats/blender",
    "Mono": "tests/library/csharp_binding_test.cpp, and tools/packaging/try_pages",
    "Node 20": "by hand", "npm": "by hand", "xvfb": "by hand", "libstk-dev": "tests of make_assets",
    "Flamenco": "not tried", "vcpkg": "not tried", "Conan": "not tried",
}
MARK = re.compile(r"\s*# needs ([^:]+)(?::.*)?$")
BLOCK = re.compile(r"^```([a-z-]*)\n(.*?)^```$", re.M | re.S)
# Few photons, and a room without furniture: a report of all of it takes half a minute.
SMALL = {"settings": {"photons": 30},
         "ignored": ["chair_*", "furniture_*", "piano_*", "metal", "curtains", "cloth_*", "door*",
                     "window_*", "wall_panelling", "ceiling_frame", "ceiling_lights", "projector_*"]}


def pages():
    found = [path for path in SOURCE.rglob("*.md")
             if not re.match(r"build|\.|CHANGELOG|tests/price|demo", str(path.relative_to(SOURCE)))]
    return sorted(found)


def is_complete(text):
    return subprocess.run(["bash", "-n", "-c", text], stderr=subprocess.DEVNULL).returncode == 0


def statements(block):
    """The statements of a block with what each needs."""
    found, lines, for_all = [], [], set()
    for line in block.splitlines():
        mark = MARK.match(line)
        if mark and not lines:  # a line of its own
            for_all |= needs_of(line)
            continue
        lines.append(line)
        text = "\n".join(lines)
        if text.strip() and not line.endswith(("\\", "|")) and is_complete(text):
            found.append((text, for_all | needs_of(text)))
            lines = []
    if "".join(lines).strip():
        raise ValueError("a command without an end: " + "\n".join(lines))
    return found


def needs_of(text):
    named = set()
    for line in text.splitlines():
        mark = re.search(r"# needs ([^:]+)", line)
        if mark:
            named |= {need.strip() for need in mark[1].split(",")}
    return named


def files_of(text):
    """Files that a page shows: a block in a language, after a line that names it last."""
    for before, language, content in re.findall(r"([^\n]*)\n+```([a-z]+)\n(.*?)^```$", text, re.M | re.S):
        names = re.findall(r"`(\w+\.(?:c|cpp|py|cs|txt))`", before)
        if language not in ("sh", "text") and names:
            yield names[0], content


def make_root(root, program):
    """The repository as symbolic links, but for what commands write into or what is made small."""
    shutil.rmtree(root, ignore_errors=True)
    root.mkdir(parents=True)
    for entry in SOURCE.iterdir():
        if entry.is_file():
            shutil.copy(entry, root)
        elif entry.name not in ("build", ".git", ".cache", "assets"):
            (root / entry.name).symlink_to(entry)
    shutil.copytree(SOURCE / "assets", root / "assets")
    for level in (root / "assets/levels").glob("*.glb"):
        level.with_suffix(".acoustics.json").write_text(json.dumps(SMALL))
    (root / "build").mkdir()
    (root / "build/release").symlink_to(program.parent)
    (root / "home").mkdir()


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def run_page(page, root, program, met):
    """Runs a page and returns what failed and what waits."""
    text = page.read_text()
    script, waiting, count, files = [], [], 0, list(files_of(text))
    for language, content in BLOCK.findall(text):
        if not language:
            return [f"a code block without a language: {content.splitlines()[0]}"], []
        if language != "sh":
            continue
        for statement, needs in statements(content):
            for need in sorted(needs - NEEDS.keys()):
                return [f"'{need}' is none of the needs in run_pages.py: {statement}"], []
            if needs - met:
                waiting.append((statement, sorted(needs - met)))
                continue
            count += 1
            shown = statement
            if needs & {"a screen", "Ctrl-C to end"}:  # it goes on until it is stopped
                statement = "timeout --preserve-status -s INT 60 bash -c " + quoted(statement)
            # Like that of diff, an exit code of 1 tells a difference.
            allowed = 1 if statement.startswith("clamor diff ") else 0
            script += [f"echo {quoted('$ ' + shown)}", statement, f"(($? <= {allowed})) || exit 1"]
    if not count:
        return [], waiting
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    if (root / "home").exists():
        environment["HOME"] = str(root / "home")
    if "export PATH=" not in text:
        environment["PATH"] = f"{program.parent}:{environment['PATH']}"
    for name, content in files:
        folder = root / ("game" if "cd game" in text else ".")
        folder.mkdir(exist_ok=True)
        (folder / name).write_text(content)
    done = subprocess.run(["bash", "-c", "\n".join(script)], cwd=root, env=environment, text=True,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return ([] if done.returncode == 0 else ["\n".join(done.stdout.splitlines()[-25:])]), waiting


def wrong_spans(page, folder, program):
    """Commands within a text that the program does not understand: it says so with exit code 2. Some name
    an option alone, without the files that the command takes."""
    text = BLOCK.sub("", page.read_text())
    for span in dict.fromkeys(re.findall(r"`(clamor [a-z]+ [^`]*)`", text)):
        if "..." in span or "X,Y,Z" in span or span.startswith(("clamor bench", "clamor manual")):
            continue
        done = subprocess.run(["bash", "-c", f"PATH={program.parent}:$PATH; {span}"], cwd=folder, text=True,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        if done.returncode not in (0, 1) and " is required;" not in done.stderr:
            yield f"`{span}`: {done.stderr}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("pages", nargs="*", type=Path)
    parser.add_argument("--with", dest="met", default="", help="needs that are met here")
    parser.add_argument("--root", type=Path, help="run in this repository instead of a small copy")
    arguments = parser.parse_intermixed_args()  # pages may follow options
    program = arguments.program.resolve()
    met = {need.strip() for need in arguments.met.split(",")}
    failed = False
    for page in [path.resolve() for path in arguments.pages] or pages():
        name = page.relative_to(SOURCE)
        root = arguments.root or arguments.folder.resolve() / "root"
        if not arguments.root:
            make_root(root, program)
        root = root.resolve()
        began = os.times()
        failures, waiting = run_page(page, root, program, met)
        empty = arguments.folder.resolve() / "empty"
        shutil.rmtree(empty, ignore_errors=True)
        empty.mkdir(parents=True)
        failures += wrong_spans(page, empty, program)
        ended = os.times()
        seconds = sum(ended[2:4]) - sum(began[2:4])
        print(f"{name}: {'FAILED' if failures else 'works'}, {seconds:.1f} core-seconds", flush=True)
        for failure in failures:
            print("  " + failure.replace("\n", "\n  "))
        for statement, needs in waiting:
            lines = statement.splitlines()
            where = "; ".join(dict.fromkeys(NEEDS[need] for need in needs))
            print(f"  not run, needs {', '.join(needs)} ({where}): {lines[0]}")
        failed = failed or bool(failures)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
