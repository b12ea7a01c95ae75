"""What a run leaves behind: docs/results.md."""

from __future__ import annotations

import difflib
import html
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Sequence, Union

import numpy as np

from ._core import InvalidArgument, RunFile, export_csv, motion_of, moved_in, states_of
from .ensembles import EnsembleResult, open_ensemble
from .judged import Judged, html_table, short, text_table

PathLike = Union[str, "os.PathLike[str]"]


def steps_of(summary: dict[str, Any]) -> str:
    """Its steps; the rows of a judged trajectory, worded as by the command."""
    steps, step = summary["steps"], summary["step_s"]
    if summary["method"] != "recorded":
        return f"{steps} steps of {step:g} s"
    mean = summary["simulated_s"] / steps
    return f"{steps + 1} rows, " + (f"{mean:g} s apart" if abs(mean - step) < 1e-6 * mean else f"{mean:.3g} s apart in the mean")


class Result(Judged):
    """A finished run: figures, verdict and time series.

    Time series are numpy arrays by the names of run.h5: result["energy_error"], result["state/elbow"]. Those of a folder are
    read when they are asked for, and kept; those of a run in memory are views of one array.
    """

    _it_has_no = "the run has no series"

    def __init__(self, summary: dict[str, Any], folder: Path | None = None,
                 columns: dict[str, tuple[np.ndarray, str]] | None = None,
                 states: np.ndarray | None = None):
        super().__init__(summary, folder)  # as summary.json; None for a run in memory
        self._columns = columns
        self._states = states
        self.mechanism: Any = None  #: what moved, of a model made in code; None: of the folder's scene, or there is none
        self.angles: list[str] = []  #: of a run in memory: the names behind the columns of "turns"
        self._file: RunFile | None = None

    # --- figures ------------------------------------------------------------------------------------------------------
    @property
    def checks(self) -> list[dict[str, Any]]:
        """name, value, limit, pass, telling: one per limit that has a meaning for this run."""
        return self.summary["checks"]

    @property
    def not_applicable(self) -> list[dict[str, Any]]:
        """name, why: the checks that have none."""
        return self.summary["not_applicable"]

    @property
    def notes(self) -> list[str]:
        return self.summary["notes"]

    def __str__(self) -> str:
        s, e = self.summary, self.summary["energy"]
        lines = [f"{s['title'] or 'run'}: {s['method']}, {steps_of(s)}, {s['simulated_s']:g} s{'' if s['method'] == 'recorded' else ' simulated'}", ""]
        rows = [("check", "value", "limit", "")]
        rows += [(c["name"], short(c["value"]), short(c["limit"]), "pass" if c["pass"] else "FAIL") for c in self.checks]
        rows += [(n["name"], "-", "-", f"not applicable: {n['why']}") for n in self.not_applicable]
        if len(rows) > 1:
            lines += text_table(rows) + [""]
        known, seen = (e[key] is not None for key in ("max_rel_error", "max_abs_error_J"))
        lines.append(f"energy   start {short(e['initial_J'])} J" + (f", error max {short(e['max_abs_error_J'])} J" if seen else "")
                     + (f" = {short(e['max_rel_error'])} relative to {short(e['scale_J'])} J" if known else ""))
        if "growth" in e:  # not in results of version 0.1
            drift = f"; drift {short(e['drift_per_s'])} per s, {'' if e['drift_is_significant'] else 'not '}significant" if known else ""
            lines.append(f"         the error {e['growth']}{drift}")
        lines += [f"note     {n}" for n in self.notes]
        if self.folder:
            lines.append(f"results  {self.folder}")
        return "\n".join(lines + [f"verdict  {'FAIL' if self.verdict == 'fail' else self.verdict}"])

    def __repr__(self) -> str:
        return f"<porthos.Result '{self.summary['title']}': {self.verdict}, {self.summary['records']} records>"

    # --- time series --------------------------------------------------------------------------------------------------
    @property
    def phases(self) -> list["Result"]:
        """The runs between events, each with time series of its own; [self] without events."""
        if self.folder and not (self.folder / "run.h5").exists():
            k, all = 1, []
            while (self.folder / f"phase_{k}" / "summary.json").exists():
                all.append(open(self.folder / f"phase_{k}"))
                k += 1
            return all
        return [self]

    @property
    def file(self) -> RunFile | None:
        """run.h5, None for a run in memory."""
        if self._file is None and self.folder is not None:
            if len(self.phases) > 1:
                raise InvalidArgument(f"{self.folder} has time series by phase: take them from .phases, which are {len(self.phases)}, or by .joined(name)")
            one = self.phases[0] if self.phases else self
            self._file = RunFile(one.folder / "run.h5")
        return self._file

    @property
    def names(self) -> list[str]:
        """Names of all time series."""
        if self._columns is not None:
            return list(self._columns)
        return super().names

    def unit(self, name: str) -> str:
        if name not in self.names:
            raise KeyError(f"the run has no series '{name}', it has {', '.join(self.names)}")
        if self._columns is not None:
            return self._columns[name][1]
        return self.file.attributes(name)["unit"]

    def __getitem__(self, name: str) -> np.ndarray:
        if self._columns is not None:
            if name not in self._columns:
                raise KeyError(f"the run has no series '{name}', it has {', '.join(self._columns)}")
            return self._columns[name][0]
        return super().__getitem__(name)

    @property
    def time(self) -> np.ndarray:
        """(n,) [s]"""
        return self["time"]

    def joined(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """A series over all phases that have it: times (n,) [s] and values (n,) or (n, columns), phase after phase.

        The instant of an event stands in it twice, as the values before and after it.
        Raises InvalidArgument for a series that no phase has, or that has other columns in another phase.
        """
        parts = [(p.time, np.asarray(p[name])) for p in self.phases if name in p.names]
        if not parts:
            raise InvalidArgument(f"no phase has a series '{name}', expected one of {', '.join(self.phases[0].names)}")
        if len({v.shape[1:] for _, v in parts}) > 1:
            raise InvalidArgument(f"'{name}' has other columns in another phase: take it from .phases")
        return np.concatenate([t for t, _ in parts]), np.concatenate([v for _, v in parts])

    def to_csv(self, file: PathLike, names: Sequence[str] = ()) -> None:
        """Writes the time series of the folder as a table, a row for each record: those of the names, or groups of them; all.

        Angles are true angles, turns included; phases follow each other. Raises InvalidArgument for a run in memory, or a name
        that no phase has.
        """
        if self.folder is None:
            raise InvalidArgument("the run is in memory, expected one with a folder: simulate(..., out=) or Scene.run(out)")
        export_csv(str(self.folder), str(file), list(names))

    @property
    def x(self) -> np.ndarray:
        """The flat states, (n, nx): of runs in memory only, a view. Angles are in [-pi, pi], with "turns" beside."""
        if self._states is None:
            raise InvalidArgument("run.h5 has the state by names, not as one flat vector, which runs in memory alone keep: expected series as "
                                  "result['state/elbow'][-1] and result['momentum/elbow'][-1], or [initial] from = the folder to go on from its end")
        return self._states

    @property
    def springs(self) -> list[tuple[str, Any]]:
        """Names and energies of the actuators of the folder's scene."""
        return moved_in(self.folder)[1] if self.folder else []

    def motion(self, most: int = 3000, bands: bool = False) -> dict[str, dict[str, np.ndarray]]:
        """How the mechanism moved, at no more than `most` records: {"joints [rad]": {"elbow": ...}, ..., "time [s]": {"t": ...}}.

        The scene's outputs; positions and rates of joints; rotation from the start, rates, path and velocity of free bodies;
        deflection, stiffness setting, stiffness and torque of actuators, angle, torque and power of their motors, as motion.svg has
        them. Phases follow each other: nan where a phase has no such line. bands: of more records the least and the largest of each
        part, in place of one record of it, as pictures show them.
        Raises InvalidArgument for a system without a mechanism.
        """
        if self.folder is None and self.mechanism is None:
            raise InvalidArgument("the run has no mechanism whose motion could be shown, expected a scene or a MechanicalModel; "
                                  "what = \"states\" shows its states")
        t, panels = motion_of(self, most, bands)
        return {**panels, "time [s]": {"t": t}}

    def has_mechanism(self) -> bool:
        """Whether motion() can show the run: of a scene, or of a MechanicalModel in this session."""
        if self.mechanism is not None or self.folder is None:
            return self.mechanism is not None
        file = self.phases[0].file
        return file is not None and "provenance/scene" in file.names and file.read("provenance/scene") != ""

    def states(self, most: int = 3000, bands: bool = False) -> dict[str, dict[str, np.ndarray]]:
        """The states of any system, at no more than `most` records: {"states [rad]": {"elbow": ...}, "momenta [kg m^2/s]": ..., "time [s]": {"t": ...}}.

        Series "state/..." and "momentum/..." by unit, each line (records,); of a block of several numbers "base.x", or "base.0"
        where they have no names. Angles are true angles, turns included. Phases follow each other: nan where a phase has no such
        line. bands: as of motion(). Cost: reads those series.
        """
        t, panels = states_of(self, most, bands)
        return {**panels, "time [s]": {"t": t}}

    def _repr_html_(self) -> str:
        """What notebooks show: the verdict and its checks."""
        rows = [(c["name"], short(c["value"]), short(c["limit"]), "pass" if c["pass"] else "FAIL") for c in self.checks]
        rows += [(n["name"], "", "", f"not applicable: {n['why']}") for n in self.not_applicable]
        s = self.summary
        return (f"<p><b>{html.escape(s['title'] or 'run')}</b>: {html.escape(self.verdict)}; {html.escape(s['method'])}, {steps_of(s)}</p>"
                + html_table(("check", "value", "limit", ""), rows))

    def group(self, name: str) -> dict[str, np.ndarray]:
        """The series of a group without its name: group("stored") -> {"kinetic": ..., "gravity": ...}."""
        start = name + "/"
        group = {n[len(start):]: self[n] for n in self.names if n.startswith(start)}
        known = sorted({n.split("/")[0] for n in self.names if "/" in n})
        if not group and name not in ("stored", "supplied", "dissipated", "output", *known):
            raise InvalidArgument(f"the run has no group '{name}', expected one of {', '.join(known)}")
        return group


def open(folder: PathLike) -> Any:
    """The Result in a folder that a run has written, the EnsembleResult of an ensemble, or the Comparison of compare.

    Raises InvalidArgument where there is none, or an unfinished one.
    """
    folder = Path(folder)
    summary = folder / "summary.json"
    if not folder.is_dir():
        raise InvalidArgument(f"{folder} is not a folder, expected one with the results of a run")
    if not summary.exists() and (folder / "ensemble.json").exists():
        return open_ensemble(folder)
    if not summary.exists() and (folder / "compare.json").exists():
        return open_comparison(folder)
    if not summary.exists() and (folder / "parts").exists():
        raise InvalidArgument(f"{folder} holds an unfinished ensemble: continue it with resume=True")
    if not summary.exists():
        unfinished = (folder / "checkpoint").exists()
        raise InvalidArgument(f"{folder} holds an unfinished run: continue it with resume=True" if unfinished else
                              f"{folder} has no summary.json, expected the results of a run, an ensemble or a comparison")
    try:
        content = json.loads(summary.read_text(encoding="utf-8"))
    except ValueError as e:
        raise InvalidArgument(f"{summary} is damaged: {e}") from None
    return Result(content, folder)


def _place(name: str, names: list[str], what: str) -> int:
    if name not in names:
        near = difflib.get_close_matches(name, names, n=1, cutoff=0)
        raise InvalidArgument(f"there is no {what} {name!r}, the nearest is {near[0]!r}" if near else f"there is no {what} {name!r}")
    return names.index(name)


@dataclass(frozen=True)
class Sensitivity:
    """How the end of a run depends on its inputs, from Scene.sensitivity(): docs/derivatives.md. Printed, it is the table of the command."""

    uncertainty: float | None  #: relative standard deviation of every parameter
    inputs: list[str]  #: names of parameters, "link_2.mass", then of start values, "joint_1.velocity"
    input_units: list[str]
    input_values: np.ndarray  #: (inputs,), nan of turns
    is_start: np.ndarray  #: (inputs,), whether it is a start value
    of: list[str]  #: names of the quantities
    units: list[str]
    values: np.ndarray  #: (quantities,), at the end
    growth: np.ndarray  #: (quantities,), see Gradient.growth: above about 8 the slopes tell nothing of a finite change; nan by differences
    slopes: np.ndarray  #: (quantities, inputs)
    errors: np.ndarray  #: (quantities, inputs), of slopes by differences; nan by the adjoint
    runs: int  #: that differences were taken of; 0: by the adjoint
    notes: list[str]
    text: str

    def __post_init__(self) -> None:
        for name in ("input_values", "is_start", "values", "growth"):
            object.__setattr__(self, name, np.array(getattr(self, name)))

    def slope(self, quantity: str, value: str) -> float:
        """The slope of a quantity by an input. Raises InvalidArgument for a name that is none."""
        return float(self.slopes[_place(quantity, self.of, "quantity"), _place(value, self.inputs, "input")])

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviation of each quantity by `uncertainty` of all parameters, independent of each other, (quantities,)."""
        whole = np.where(self.is_start, 0.0, self.slopes * self.input_values)
        return (np.nan if self.uncertainty is None else self.uncertainty) * np.sqrt((whole**2).sum(axis=1))

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Identification:
    """Parameters of a scene from a log, from Scene.identify(): docs/identification.md. Printed, it is the table of the command."""

    parameters: list[str]
    units: list[str]
    start: np.ndarray  #: (n,), of the scene
    values: np.ndarray  #: (n,), as found
    deviations: np.ndarray  #: (n,), 1 sigma; nan: the log tells nothing of it
    covariance: np.ndarray  #: (n, n), of the values
    combinations: np.ndarray  #: (n, n), row i: the change of each parameter along combination i, in parts of its size
    combination_deviations: np.ndarray  #: (n,), 1 sigma along each, best told first; inf: the log tells nothing of it
    told: np.ndarray  #: (n,), whether the log tells the combination within a whole change
    columns: list[str]  #: of the log, as used
    times: np.ndarray  #: (times,) [s]
    before: np.ndarray  #: (times, columns), (run - log)/sigma with the start values; sigma is 1 where it is not given
    after: np.ndarray  #: (times, columns), the same with the values found
    chi_square: float  #: the sum of the squares of `after`
    freedoms: int  #: numbers of the log less parameters
    converged: bool
    scene: str  #: text of the scene with the values found, for the folder of the scene
    notes: list[str]
    text: str
    json: str

    def __post_init__(self) -> None:
        for name in ("start", "values", "deviations", "told"):
            object.__setattr__(self, name, np.array(getattr(self, name)))

    def __getitem__(self, parameter: str) -> float:
        """The value found. Raises KeyError for a name that is none."""
        if parameter not in self.parameters:
            raise KeyError(parameter)
        return float(self.values[self.parameters.index(parameter)])

    def __str__(self) -> str:
        return self.text


class Comparison:
    """Speed against error: docs/compare.md."""

    def __init__(self, content: dict[str, Any], table: str, folder: Path | None):
        self.content = content  #: as compare.json
        self.table = table  #: as compare.txt
        self.folder = folder

    def lines(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Of each method, by its name in the table, CPU times [s] and errors of the trials that reached their end, from coarse to fine.

        The error is that of the advice, content["error"]: the largest relative one of the energy, or that of the trajectory.
        """
        lines: dict[str, list[tuple[float, float]]] = {}
        for r in self.content["runs"]:
            name = r["method"] + (" short" if r["iteration_tolerance"] else "") + ("" if r["step_control"] == "fixed" else f" {r['step_control']}")
            error = r["energy"]["max_rel_error"] if self.content["error"] == "energy" else r["trajectory_error"]
            if r["outcome"] == "ok" and error and r["cpu_s"]:
                lines.setdefault(name, []).append((r["cpu_s"], error))
        return {name: (np.array([x for x, _ in points]), np.array([y for _, y in points])) for name, points in lines.items()}

    def __str__(self) -> str:
        return self.table


def open_comparison(folder: Path) -> Comparison:
    """The comparison in a folder. Raises InvalidArgument for a damaged one."""
    try:
        content = json.loads((folder / "compare.json").read_text(encoding="utf-8"))
        return Comparison(content, (folder / "compare.txt").read_text(encoding="utf-8"), folder)
    except (ValueError, OSError) as e:
        raise InvalidArgument(f"the comparison in {folder} is damaged: {e}") from None
