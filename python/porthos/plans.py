"""What a plan leaves behind: docs/planning.md."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Iterator

import numpy as np

from .judged import html_table, short


class Plan(Mapping):
    """A planned motion: the columns of motion.csv as numpy arrays by name, plan["time"], plan["elbow"], plan["elbow.torque"]
    [s, rad or m, N m or N], at the ends of the intervals. A torque is that of the interval that begins there."""

    def __init__(self, summary: dict[str, Any], folder: Path):
        self.summary = summary  #: as plan.json
        self.folder = folder
        self._motion = _columns(folder / "motion.csv")

    @property
    def optimal(self) -> bool:
        """Whether an optimum was found; `summary["status"]` says what else."""
        return self.summary["status"] == "optimal"

    def __bool__(self) -> bool:
        """Whether an optimum was found and its replay reaches it."""
        return self.summary["replays"]

    @property
    def cost(self) -> float:
        return self.summary["cost"]

    @property
    def duration(self) -> float:
        """[s], found by the planner where the scene gives a time_weight."""
        return self.summary["duration_s"]

    @property
    def goals(self) -> dict[str, tuple[float, float]]:
        """Value and multiplier of each goal; the multiplier is minus the derivative of the cost by the value."""
        return {g["name"]: (g["value"], g["multiplier"]) for g in self.summary["goals"]}

    @property
    def costates(self) -> dict[str, np.ndarray]:
        """The derivatives of the cost by the state at the ends of the intervals, by the names of the motion."""
        return _columns(self.folder / "costates.csv")

    @property
    def replay(self) -> Path | None:
        """The scene that repeats the plan, for Scene(plan.replay).verify(); None if no optimum was found."""
        return self.folder / "replay.toml" if self.optimal else None

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._motion:
            raise KeyError(f"the plan has no '{name}', it has {', '.join(self._motion)}")
        return self._motion[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._motion)

    def __len__(self) -> int:
        return len(self._motion)

    def _rows(self) -> list[tuple[str, str]]:
        s = self.summary
        return [("status", s["status"]), ("duration", f"{s['duration_s']:.10g} s"), ("cost", f"{s['cost']:.10g}"), ("iterations", str(s["approach_iterations"] + s["iterations"])),
                ("residual", short(s["residual"])), ("limits that are reached", str(s["active_limits"])),
                ("replay ends within", short(s["replay_distance"])), *(("note", note) for note in s["notes"])]

    def __str__(self) -> str:
        return "\n".join(f"{name:25}{value}" for name, value in self._rows())

    def __repr__(self) -> str:
        return f"Plan({self.summary['status']}, cost {self.cost:.6g}, {len(self['time']) - 1} intervals)"

    def _repr_html_(self) -> str:
        return html_table(("plan", ""), self._rows())


def _columns(path: Path) -> dict[str, np.ndarray]:
    with path.open() as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    return dict(zip(names, rows.T.copy()))
