"""Runs the scenes of tools/price under Callgrind and compares their cost with table.md.

Counts depend neither on the processor nor on what else runs: valgrind shows every program the same
processor, a Haswell with AVX2, by which Highway, Embree and glibc choose their code; each run has one
CPU to itself as far as TBB sees, one environment and one layout of memory. CPU time and peak memory
are those of a run without valgrind.
"""
import argparse
import concurrent.futures
import hashlib
import os
import pathlib
import queue
import re
import statistics
import subprocess
import sys

from scenes import INPUTS, SCENES

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLE = ROOT / "tests/price/table.md"
TOLERANCE = 0.05  # of instructions
PAIRS = 5         # of native runs, beside another revision
# What runs in the scenes or makes their code.
PACKAGES = """g++-12 libc6 libembree-dev libflac12 libfmt-dev libglm-dev libhwy-dev libopenmesh-dev
    libsamplerate0-dev libsndfile1-dev libsoxr-dev libstdc++6 libtbb-dev libtinygltf-dev libxxhash-dev
    libzstd-dev nlohmann-json3-dev valgrind""".split()


# Reads in pieces: Linux counts the memory of this process as that of the programs that it starts.
def file_hash(path):
    if not path.exists():
        return ""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def fail(message):
    sys.exit(f"tools/price: {message}")


class Build:
    """A built tree, and a folder in which its scenes run."""

    def __init__(self, tree, folder):
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        for name, target in (("clamor", tree / "build/release/clamor"),
                             ("price_scenes", tree / "build/release/tests/price_scenes"),
                             ("levels", ROOT / "assets/levels"),
                             ("shared", ROOT.parent / "shared/levels")):
            (folder / name).unlink(missing_ok=True)
            if target.exists():
                (folder / name).symlink_to(target)

    def run(self, command, cpu, log, prefix=()):
        """CPU seconds and peak MB of a command on one CPU; its words go to the file `log`."""
        words = ["taskset", "-c", str(cpu), *prefix, *("./" + command).split()]
        with open(self.folder / log, "wb") as output:
            process = subprocess.Popen(words, cwd=self.folder, stdout=output, stderr=output,
                                       stdin=subprocess.DEVNULL,
                                       env={"LC_ALL": "C.UTF-8", "PATH": os.defpath})
            _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            fail(f"'{command}' failed in {self.folder}:\n{(self.folder / log).read_text()}")
        return usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024 / 1e6

    def inputs_of(self, scene):
        return [word for word in SCENES[scene].split() if word in INPUTS]

    def lacks(self, scene):
        """The first file that a scene needs and that cannot be made, or None."""
        commands = [SCENES[scene]] + [INPUTS[name] for name in self.inputs_of(scene)]
        for word in (word for command in commands for word in command.split()):
            if word in ("clamor", "price_scenes") or word.startswith("shared/"):
                if not (self.folder / word).exists():
                    return word
        return None

    def make_inputs(self, scenes, cpus):
        """Bakes what the scenes play, unless this program has already."""
        program = [file_hash(self.folder / name) for name in ("clamor", "price_scenes")]

        def make(name):
            mark = self.folder / f"{name}.made"
            made = f"{program} {INPUTS[name]}"
            if not mark.exists() or mark.read_text() != made:
                on_a_cpu(cpus, lambda cpu: self.run(INPUTS[name], cpu, f"{name}.log"))
                mark.write_text(made)

        wanted = sorted({name for scene in scenes for name in self.inputs_of(scene)})
        for _ in in_parallel(make, wanted, cpus):
            pass

    def count(self, scene, cpu):
        """Instructions of a scene, in millions."""
        callgrind = ["setarch", "-R", "valgrind", "--tool=callgrind", "--read-inline-info=no",
                     f"--callgrind-out-file={scene}.callgrind"]
        if SCENES[scene].startswith("price_scenes"):
            callgrind.append("--instr-atstart=no")
        self.run(SCENES[scene], cpu, f"{scene}.log", callgrind)
        collected = re.search(r"Collected : (\d+)", (self.folder / f"{scene}.log").read_text())
        if int(collected[1]) == 0:
            fail("price_scenes was built without <valgrind/callgrind.h>. Install valgrind, then "
                 "touch tests/price/price_scenes.cpp and try again")
        return int(collected[1]) / 1e6


def on_a_cpu(cpus, work):
    cpu = cpus.get()
    try:
        return work(cpu)
    finally:
        cpus.put(cpu)


def in_parallel(work, items, cpus):
    """Results in the order of the items, each as soon as it and those before it are there."""
    with concurrent.futures.ThreadPoolExecutor(cpus.qsize()) as executor:
        yield from executor.map(work, items)


class Table:
    """The committed table: instructions in millions and peak MB of scenes, and package versions."""

    def __init__(self, text):
        rows = re.findall(r"^\| (\w+) \| ([\d.]+) \| (\d+) \|", text, re.MULTILINE)
        self.scenes = {name: (float(count), int(peak)) for name, count, peak in rows}
        self.packages = dict(re.findall(r"^\| (\S+) \| (\S*\d\S*) \|$", text, re.MULTILINE))

    def text(self):
        lines = ["# Cost of the scenes of tools/price", "",
                 "`tools/price --renew` writes this table. How it is judged: [tests](../README.md#cost).", "",
                 "| scene | instructions / 10^6 | peak memory / MB | command |", "|---|---|---|---|"]
        lines += [f"| {name} | {self.scenes[name][0]:.1f} | {self.scenes[name][1]} | `{SCENES[name]}` |"
                  for name in SCENES if name in self.scenes]
        lines += ["", "It holds for these packages of Debian 12:", "", "| package | version |", "|---|---|"]
        lines += [f"| {name} | {version} |" for name, version in self.packages.items()]
        return "\n".join(lines) + "\n"

    def verdict(self, scene, count):
        """What is to be done about a scene, and whether that is an error."""
        if scene not in self.scenes:
            return f"is not in {TABLE.name} yet: tools/price --renew --only {scene}", False
        change = count / self.scenes[scene][0] - 1
        if change > TOLERANCE:
            return (f"takes {100 * change:.1f} % more instructions. callgrind_annotate tells where; if it is "
                    f"on purpose, tools/price --renew --only {scene}, and say why in the commit"), True
        if change < -TOLERANCE:
            return f"takes {-100 * change:.1f} % fewer instructions: tools/price --renew --only {scene}", False
        return "", False


def installed_packages():
    try:
        listing = subprocess.run(["dpkg-query", "-W", "-f", "${Package} ${Version}\n", *PACKAGES],
                                 capture_output=True, text=True, check=False).stdout
    except FileNotFoundError:
        return {}
    return dict(line.split() for line in listing.splitlines())


def not_run_because(processor):
    """Why valgrind runs no program here, or an empty text."""
    flags = re.search(r"^flags\b.*", processor, re.MULTILINE)
    if flags and " rdtscp" not in flags[0]:  # as some virtual machines hide it
        return "libhwy reads RDTSCP when it is loaded, which valgrind knows where the processor tells of it"
    return ""


def not_judged_because(table, packages, processor):
    """Why the table does not hold here, or an empty text."""
    if not re.search(r"^flags\b.* avx2\b", processor, re.MULTILINE):
        return "this processor has no AVX2"
    for name, version in table.packages.items():
        if packages.get(name) != version:
            return f"{name} is {packages.get(name, 'not installed')} here and {version} in {TABLE.name}"
    return ""


def chosen_scenes(only, build):
    """The scenes to run; says which cannot be."""
    for scene in only:
        if scene not in SCENES:
            fail(f"there is no scene '{scene}'; there are {', '.join(SCENES)}")
    scenes = []
    for scene in only or SCENES:
        lacking = build.lacks(scene)
        if lacking:
            print(f"  {scene:<20} skipped: {build.folder.name} has no {lacking}")
        else:
            scenes.append(scene)
    return scenes


def measure(build, scenes, cpus):
    """Yields each scene with its instructions / 10^6, CPU seconds and peak MB."""
    build.make_inputs(scenes, cpus)

    def run(scene):
        return on_a_cpu(cpus, lambda cpu: (build.count(scene, cpu),
                                           *build.run(SCENES[scene], cpu, f"{scene}.native.log")))

    yield from zip(scenes, in_parallel(run, scenes, cpus))


def percent(ratio):
    return f"{100 * (ratio - 1):+.1f} %"


def compare_with_table(build, only, renew, cpus):
    table = Table(TABLE.read_text() if TABLE.exists() else "")
    print(f"  {'scene':<20} {'10^6 instructions':>17} {'change':>8} {'CPU':>8} {'peak':>8}")
    verdicts = []
    measured = {}
    for scene, (count, cpu_s, peak_mb) in measure(build, chosen_scenes(only, build), cpus):
        stored = table.scenes.get(scene)
        change = percent(count / stored[0]) if stored else "new"
        print(f"  {scene:<20} {count:17.1f} {change:>8} {cpu_s:6.2f} s {peak_mb:5.0f} MB", flush=True)
        measured[scene] = count, round(peak_mb)
        verdicts.append((scene, *table.verdict(scene, count)))
    if renew:
        packages = installed_packages()
        if only and table.packages not in ({}, packages):
            fail(f"packages have changed since {TABLE.name} was written: renew all of it, without --only")
        table.scenes.update(measured)
        table.packages = packages
        TABLE.write_text(table.text())
        print(f"  price              {TABLE.relative_to(ROOT)} is written")
        return
    reason = not_judged_because(table, installed_packages(), pathlib.Path("/proc/cpuinfo").read_text())
    if reason:
        print(f"  price              not judged, because {reason}")
        return
    for scene, text, _ in verdicts:
        if text:
            print(f"  price              {scene} {text}")
    if any(is_error for _, _, is_error in verdicts):
        sys.exit(1)


def compare_with_build(build, other, only, cpus):
    there = chosen_scenes(only, other)
    scenes = [scene for scene in chosen_scenes(only, build) if scene in there]
    print(f"  {'':<20} {'10^6 instructions':>28} {'':>8} {f'CPU, median of {PAIRS}':>18}")
    print(f"  {'scene':<20} {'here':>10} {other.folder.name:>17} {'change':>8} {'here':>8} {'there':>9} {'change':>8}")
    there = dict(measure(other, scenes, cpus))
    counts = list(measure(build, scenes, cpus))
    cpu = cpus.get()
    for scene, (count, _, _) in counts:
        pairs = []
        for pair in range(PAIRS):
            order = (build, other) if pair % 2 == 0 else (other, build)
            times = {one: one.run(SCENES[scene], cpu, f"{scene}.native.log")[0] for one in order}
            pairs.append((times[build], times[other]))
        here_s, there_s = (statistics.median(times) for times in zip(*pairs))
        ratio = statistics.median(first / second for first, second in pairs)
        print(f"  {scene:<20} {count:10.1f} {there[scene][0]:17.1f} {percent(count / there[scene][0]):>8} "
              f"{here_s:6.2f} s {there_s:7.2f} s {percent(ratio):>8}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--only", metavar="NAME", action="append", default=[])
    parser.add_argument("--renew", action="store_true")
    parser.add_argument("--against", metavar="TREE", type=pathlib.Path)
    arguments = parser.parse_args()
    reason = not_run_because(pathlib.Path("/proc/cpuinfo").read_text())
    if reason:
        print(f"  price              not run, because {reason}")
        return
    cpus = queue.Queue()
    for cpu in sorted(os.sched_getaffinity(0)):
        cpus.put(cpu)
    build = Build(ROOT, ROOT / "build/price/here")
    if arguments.against:
        other = Build(arguments.against, ROOT / "build/price" / arguments.against.name[len("tree_"):])
        compare_with_build(build, other, arguments.only, cpus)
    else:
        compare_with_table(build, arguments.only, arguments.renew, cpus)


if __name__ == "__main__":
    main()
