"""Runs `clamor bake` in the background. This module knows nothing of Blender."""

import json
import queue
import shutil
import subprocess
import threading
import time
from pathlib import Path

_GRACE_S = 10.0  # `clamor bake` keeps its traced paths when it is asked to stop


class ClamorError(Exception):
    """A sentence for the user."""


def find_program(name: str) -> str:
    """The path of the program `clamor`, whose name or path the preferences hold."""
    found = shutil.which(name)
    if found is None:
        raise ClamorError(
            f"The program '{name}' was not found. Set its path in Preferences > Add-ons > Clamor."
        )
    return found


def run_inspect(program: str, bake: Path) -> dict:
    """The contents of a bake file, as `clamor inspect --json` prints them."""
    done = subprocess.run(
        [program, "inspect", "--json", str(bake)],
        capture_output=True,
        check=False,
        encoding="utf-8",
        errors="replace",
    )
    if done.returncode != 0:
        raise ClamorError(_without_prefix(done.stderr.strip()) or f"{bake} cannot be read.")
    return json.loads(done.stdout)


def _without_prefix(line: str) -> str:
    for prefix in ("clamor bake: ", "clamor inspect: "):
        line = line.removeprefix(prefix)
    return line


class BakeProcess:
    """One run of `clamor bake`. A thread reads what it prints; poll() is called by the owner."""

    def __init__(self, command: list[str]) -> None:
        self.stage = "starting"
        self.share = 0.0  # of the photons that are traced
        self.seconds_left: float | None = None
        self.cancelled = False
        self.warnings: list[str] = []
        self._complaints: list[str] = []
        self._kill_time_s: float | None = None
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        try:
            self._process = subprocess.Popen(
                [*command, "--progress", "json"],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
            )
        except OSError as error:
            raise ClamorError(f"{command[0]} cannot be started: {error.strerror}.") from error
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def poll(self) -> bool:
        """Takes in what was printed since the last call. Returns whether the bake has ended."""
        if self._kill_time_s is not None and time.monotonic() > self._kill_time_s:
            self._process.kill()
        ended = not self._reader.is_alive() and self._process.poll() is not None
        while not self._lines.empty():
            self._take(self._lines.get())
        return ended

    def cancel(self) -> None:
        """Asks the bake to stop. It ends soon, or is killed after a grace period."""
        self.cancelled = True
        self._kill_time_s = time.monotonic() + _GRACE_S
        self._process.terminate()

    @property
    def succeeded(self) -> bool:
        return self._process.returncode == 0

    @property
    def complaint(self) -> str:
        """Clamor's own sentence about what went wrong."""
        if self._complaints:
            return " ".join(self._complaints)
        return f"clamor bake ended with exit code {self._process.returncode}."

    def _read(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as stream:
            for line in stream:
                self._lines.put(line.strip())

    def _take(self, line: str) -> None:
        if not line.startswith("{"):
            if line:
                self._complaints.append(_without_prefix(line))
            return
        message = json.loads(line)
        if message["stage"] == "warning":
            self.warnings.append(message["text"])
            return
        self.stage = message["stage"]
        if message.get("photons_total"):
            self.share = message["photons"] / message["photons_total"]
            self.seconds_left = message.get("seconds_left")
