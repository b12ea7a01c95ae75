"""What runs and ensembles leave behind have in common."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Iterator

import numpy as np

from ._core import RunFile


class Judged(Mapping):
    """Figures with a verdict, and numpy arrays by name, which are read when they are asked for, and kept.

    Its truth, bool(result), is its verdict, .passed: that of other mappings, "not empty", would let `assert result` pass for a
    run that failed. A program says what it means by .passed, and by len(result) or .names what there is.
    """

    _it_has_no = ""  #: "the run has no series", in front of a wrong name

    def __init__(self, summary: dict[str, Any], folder: Path | None):
        self.summary = summary
        self.folder = folder
        self._read: dict[str, np.ndarray] = {}

    @property
    def verdict(self) -> str:
        """"pass", "fail" or "not judged" (no check tells of the motion, or the data do not decide one): docs/results.md."""
        return self.summary["verdict"]

    @property
    def passed(self) -> bool:
        """Whether the verdict is "pass"; false of what is not judged too."""
        return self.verdict == "pass"

    def __bool__(self) -> bool:
        """As .passed."""
        return self.passed

    @property
    def file(self) -> RunFile | None:
        """The HDF5 file with the arrays; None where there is none."""
        raise NotImplementedError

    @property
    def names(self) -> list[str]:
        """Names of all arrays."""
        return [n for n in self.file.names if not n.startswith("provenance/")]

    def unit(self, name: str) -> str:
        return self.file.attributes(name).get("unit", "")

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._read:
            if name not in self.file.names:
                raise KeyError(f"{self._it_has_no} '{name}', it has {', '.join(self.names)}")
            self._read[name] = self.file.read(name)
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


def short(x) -> str:
    """A figure for a table."""
    return "null" if x is None else f"{x:.3g}"


def text_table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines with the columns two blanks apart."""
    width = [max(map(len, column)) for column in zip(*rows)]
    return ["  ".join(t.ljust(w) for t, w in zip(row, width)).rstrip() for row in rows]


def html_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The same for notebooks, escaped."""
    line = lambda tag, cells: "<tr>" + "".join(f"<{tag}>{html.escape(c)}</{tag}>" for c in cells) + "</tr>"
    return f"<table>{line('th', heads)}{''.join(line('td', row) for row in rows)}</table>"
