"""The bake that runs and the outcome of the last one; .blend files do not store them."""

from dataclasses import dataclass

from .bake_process import BakeProcess
from .summary import Summary


@dataclass
class Session:
    process: BakeProcess | None = None
    summary: Summary | None = None
    message: str = ""  # why there is no summary
    failed: bool = False

    def begin(self, process: BakeProcess) -> None:
        self.process, self.summary, self.message, self.failed = process, None, "", False

    def end(self, summary: Summary) -> None:
        self.process, self.summary = None, summary

    def fail(self, message: str, failed: bool = True) -> None:
        self.process, self.summary, self.message, self.failed = None, None, message, failed

    def stop(self) -> None:
        """Stops a bake that nobody waits for any more."""
        if self.process is not None:
            self.process.cancel()
            self.process = None


current = Session()
