"""Trajectories that another program made."""

from __future__ import annotations

import json
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any, Mapping

import numpy as np

from . import _core
from ._core import InvalidArgument
from .results import PathLike, Result
from .runs import report_beside


def judge(trajectory: PathLike | Mapping[str, Any], model: PathLike, *, map: PathLike | None = None, out: PathLike | None = None) -> Result:
    """The verdict for a trajectory of another program, as for a run: energy, momenta, growth law, the balance with the work of torques.

    trajectory: a file, CSV or HDF5, or columns by name, (k,) or (k, n): "time" [s] and those that `map` names, without it the
    names that Porthos gives ("elbow", "v.elbow", "base.attitude" (k, 4), ...; docs/judge.md). model: a URDF file. map: a TOML
    file that says what the columns mean. out: the folder of results (default: results/<name of the file>-judge; of columns,
    which are written there as trajectory.csv, a temporary folder that is gone with the result).

    Raises InvalidArgument with file and line for a missing column, a value that is not a number, time that does not increase, a map
    that does not fit the model.
    """
    if isinstance(trajectory, Mapping):
        return _judge_columns(trajectory, model, map, out)
    file = Path(trajectory)
    return _judge_file(file, model, map, Path(out) if out is not None else Path("results") / f"{file.stem}-judge")


def _judge_columns(columns: Mapping[str, Any], model: PathLike, map: PathLike | None, out: PathLike | None) -> Result:
    folder = Path(out if out is not None else tempfile.mkdtemp(prefix="porthos_judge_"))
    try:
        _write_csv(folder / "trajectory.csv", columns)
        result = _judge_file(folder / "trajectory.csv", model, map, folder)
    except BaseException:
        if out is None:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    if out is None:
        weakref.finalize(result, shutil.rmtree, folder, ignore_errors=True)
    return result


def _judge_file(file: Path, model: PathLike, map: PathLike | None, out: Path) -> Result:
    summary = _core.judge_into(str(file), str(model), "" if map is None else str(map), str(out))
    report_beside(out, [Path(model).resolve().parent])
    return Result(json.loads(summary), out)


def _write_csv(file: Path, columns: Mapping[str, Any]) -> None:
    values = {name: np.asarray(column, dtype=float) for name, column in columns.items()}
    if not values:
        raise InvalidArgument("there are no columns, expected 'time' and those of the joints")
    lengths = [c.shape[0] for c in values.values() if c.ndim]
    clock = values.get("time", values.get("t"))  # of other names: as many rows as most columns
    k = len(clock) if clock is not None and clock.ndim else max(lengths, key=lengths.count, default=1)
    for name, column in values.items():
        if column.ndim not in (1, 2) or len(column) != k:
            raise InvalidArgument(f"the column '{name}' has the shape {column.shape}, expected ({k},) or ({k}, n): a row for each time")
    names = [name if column.ndim == 1 else f"{name}[{i}]" for name, column in values.items() for i in range(column[0].size if len(column) else 1)]
    rows = np.column_stack(list(values.values()))
    file.parent.mkdir(parents=True, exist_ok=True)
    with open(file, "w", encoding="utf-8") as text:
        text.write(",".join(names) + "\n")
        text.writelines(",".join(map(repr, row)) + "\n" for row in rows.tolist())
