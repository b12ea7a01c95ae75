"""What an ensemble leaves behind: docs/ensemble.md."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._core import InvalidArgument, RunFile
from .judged import Judged, html_table, short, text_table

if TYPE_CHECKING:
    from .runs import Scene


def is_same(least: float, largest: float) -> bool:
    """Whether numbers from the least to the largest are one but for rounding."""
    return largest - least <= 1e-12 * max(abs(least), abs(largest))


class EnsembleResult(Judged):
    """A finished ensemble: ensemble["energy_error"], ensemble["final/x"] are numpy arrays with one row per case, read when they are
    asked for, and kept. Names and units: docs/ensemble.md."""

    _it_has_no = "the ensemble has no"

    def __init__(self, summary: dict[str, Any], folder: Path):
        super().__init__(summary, folder)  # as ensemble.json
        self._file = RunFile(folder / "ensemble.h5")

    @property
    def file(self) -> RunFile:
        """ensemble.h5"""
        return self._file

    @property
    def cases(self) -> int:
        """How many there are."""
        return self.summary["cases"]

    @property
    def not_passed(self) -> np.ndarray:
        """The cases that did not pass, or are not judged."""
        return np.flatnonzero(self["passed"] != 1)

    def worst(self, name: str = "energy_error", count: int = 1, which: str | None = None) -> np.ndarray:
        """The cases with the largest numbers of a dataset with one number a case, or of an output, the largest first.

        which: of an output its number at the "end" (unless given), the "largest" at the records, or the "least", of which the smallest
        come first.
        """
        v = self[name] if which is None and name in self.names else self.outputs(which or "end").get(name)
        if v is None:
            raise InvalidArgument(f"{self._it_has_no} output '{name}', expected one of: {', '.join(self.outputs())}")
        if v.ndim > 1:
            raise InvalidArgument(f"'{name}' has {v.shape[1]} numbers a case, expected a name with one")
        sign = -1 if which == "least" else 1
        order = np.argsort(np.where(np.isnan(v), -np.inf, sign * v), kind="stable")[::-1]
        return order[:count]

    def cases_of(self, why: str) -> np.ndarray:
        """The cases of a kind of trouble: that failed a check, "energy" or "stop.NAME", or that did not reach their end, "refused".

        Raises InvalidArgument for a name that is none of them.
        """
        for kind, cases in (("failed_checks", lambda k: self["failed_checks"] >> k & 1), ("status", lambda k: self["status"] == k)):
            names = self.file.attributes(kind).get("names", "").split("\n")
            if why in names and why != "ok":
                return np.flatnonzero(cases(names.index(why)))
        raise InvalidArgument(f"why is '{why}', expected one of {', '.join([k for key in ('failures', 'failed_checks') for k in self.summary.get(key, {})]) or 'none: every case passed'}")

    @property
    def inputs(self) -> dict[str, np.ndarray]:
        """The numbers that differ from case to case, by their keys of the scene."""
        return self._columns("inputs")

    def outputs(self, which: str = "end") -> dict[str, np.ndarray]:
        """The numbers of the scene's [[output]]s: at the "end" of each case, or the "least" or "largest" one at its records."""
        if which not in ("end", "least", "largest"):
            raise InvalidArgument(f"which is '{which}', expected one of end, least, largest")
        return self._columns(f"outputs/{which}")

    @property
    def events(self) -> dict[str, np.ndarray]:
        """When each [[event]] happened [s]; nan: it did not."""
        return self._columns("events/time")

    @property
    def final(self) -> dict[str, np.ndarray]:
        """The last states, a number of the state each; nan where the last mechanism of a case has no such number."""
        return self._columns("final/x")

    def case(self, index: int, **overrides: Any) -> "Scene":
        """A case as a scene by itself: .run() has its bits, and records, plots and a report as any run has.

        overrides: method, step [s], duration [s]. Raises InvalidArgument for a scene with a law of the user's own, which results do
        not hold: Scene(path, case=index).
        """
        from .runs import Scene

        return Scene(self.folder, case=int(index), **overrides)

    def unit(self, name: str) -> str:
        """The unit of a dataset, or of one of the outputs or the inputs by its name; "": not known."""
        for group in ("outputs/end", "inputs"):
            known = self.file.attributes(group) if group in self.names else {}
            units = dict(zip(known.get("columns", "").split("\n"), known.get("units", "").split("\n")))  # none in files of earlier versions
            if name in units:
                return units[name]
        return super().unit(name)

    def _columns(self, name: str) -> dict[str, np.ndarray]:
        if name not in self.names:
            return {}
        names = self.file.attributes(name)["columns"].split("\n")
        return {n: self[name][:, k] for k, n in enumerate(names)}

    def _rows(self) -> list[tuple[str, ...]]:
        spreads = [(k.removesuffix("_error").replace("_", " "), v) for k, v in self.summary.items() if k.endswith("_error")]
        return [(name, *(short(s[q]) for q in ("median", "q95", "max")), str(s.get("case_of_max", ""))) for name, s in spreads]

    def _kinds(self) -> list[tuple[str, ...]]:
        """Why cases did not pass: of each kind how many, the limit and the first cases."""
        s, rows = self.summary, []
        for key, end in (("failures", ""), ("failed_checks", ""), ("not_judged_checks", ": not judged")):
            for name, n in s.get(key, {}).items():
                first = s.get("first_cases", {}).get(key, {}).get(name, [])  # not in results of earlier versions
                rows.append((name + end, str(n), s.get("check_limits", {}).get(name, "-"), ", ".join(map(str, first)) + (", ..." if n > len(first) else "")))
        return rows

    def _events(self) -> list[str]:
        """What happened at the same time in every case."""
        same = [e for e in self.summary.get("events", []) if e["happened"] == self.cases and is_same(e["time_s"]["min"], e["time_s"]["max"])]
        return [f"in every case: {e['event']} at {e['time_s']['median']:g} s" for e in same]

    _kind_heads = ("not passed", "cases", "limit", "first of them")
    _heads = ("relative error", "median", "95 % below", "largest", "case")

    def __str__(self) -> str:
        s = self.summary
        lines = [f"{s['title'] or 'ensemble'}: {s['cases']} cases of {s['duration_s']:g} s by {s['method']}", ""]
        lines += text_table([self._heads, *self._rows()])
        for part in (self._events(), text_table([self._kind_heads, *kinds]) if (kinds := self._kinds()) else []):
            lines += ["", *part] if part else []
        lines += ["", f"results  {self.folder}"]
        return "\n".join(lines + [f"verdict  {'FAIL' if self.verdict == 'fail' else self.verdict}: {s['passed']} of {s['cases']} cases passed"])

    def __repr__(self) -> str:
        return f"<porthos.EnsembleResult '{self.summary['title']}': {self.verdict}, {self.summary['passed']} of {self.cases} cases passed>"

    def _repr_html_(self) -> str:
        """What notebooks show: the verdict, the errors and why cases did not pass."""
        s = self.summary
        return (f"<p><b>{html.escape(s['title'] or 'ensemble')}</b>: {html.escape(self.verdict)}; {s['passed']} of {s['cases']} cases passed</p>"
                + html_table(self._heads, self._rows()) + (html_table(self._kind_heads, self._kinds()) if self._kinds() else ""))


def open_ensemble(folder: Path) -> EnsembleResult:
    """The ensemble in a folder. Raises InvalidArgument for one that is not finished, or damaged."""
    try:
        summary = json.loads((folder / "ensemble.json").read_text(encoding="utf-8"))
    except ValueError as e:
        raise InvalidArgument(f"{folder / 'ensemble.json'} is damaged: {e}") from None
    return EnsembleResult(summary, folder)
