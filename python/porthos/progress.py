"""One line that says how far a run has come, in terminals and notebooks."""

from __future__ import annotations

import sys
import time
from typing import TextIO


def in_notebook() -> bool:
    """Whether output goes to a Jupyter cell, which is no terminal and shows a carriage return all the same."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return type(shell).__name__ == "ZMQInteractiveShell"


def _duration(seconds: float) -> str:
    if not 0 <= seconds < float("inf"):
        return "?"
    s = int(seconds + 0.999)
    if s < 60:
        return f"{s} s"
    if s < 3600:
        return f"{s // 60} min {s % 60:02} s"
    return f"{s // 3600} h {s // 60 % 60:02} min"


class Progress:
    """Called with (fraction, spent, left); draws at most four times a second and takes its line away at the end."""

    def __init__(self, stream: TextIO | None = None):
        self.stream = stream if stream is not None else sys.stderr
        self._drawn = 0
        self._last = 0.0

    def __call__(self, fraction: float, spent: float, left: float) -> None:
        now = time.monotonic()
        if fraction < 0 or now - self._last < 0.25:
            return
        self._last = now
        full = int(30 * min(max(fraction, 0.0), 1.0))
        text = f"[{'#' * full}{'.' * (30 - full)}] {100 * fraction:5.1f} %  {_duration(spent)} spent, {_duration(left)} left"
        self.stream.write("\r" + text.ljust(self._drawn))
        self.stream.flush()
        self._drawn = len(text)

    def finish(self) -> None:
        if self._drawn:
            self.stream.write("\r" + " " * self._drawn + "\r")
            self.stream.flush()
        self._drawn = 0


class _Quiet:
    def finish(self) -> None:
        pass


def chosen(progress):
    """(what the core is to call, what to finish) for progress = True, False, None (where someone looks) or a callable."""
    if progress is None:
        progress = in_notebook() or (hasattr(sys.stderr, "isatty") and sys.stderr.isatty())
    if callable(progress):
        return progress, _Quiet()
    if not progress:
        return None, _Quiet()
    line = Progress()
    return line, line
