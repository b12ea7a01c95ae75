"""Trajectories that another program made."""

from __future__ import annotations

import json
import re
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


def judge(trajectory: PathLike | Mapping[str, Any], model: PathLike, *, map: PathLike | Mapping[str, Any] | None = None,
          out: PathLike | None = None) -> Result:
    """The verdict for a trajectory of another program, as for a run: energy, momenta, growth law, the balance with the work of torques.

    trajectory: a file, CSV or HDF5, or columns by name, (k,) or (k, n): "time" [s] and those that `map` names, without it the
    names that Porthos gives ("elbow", "v.elbow", "base.attitude" (k, 4), ...; docs/judge.md). model: a URDF file. map: a TOML
    file that says what the columns mean, or its tables as a dict, which is written beside the results as map.toml. out: the folder of results (default: results/<name of the file>-judge; of columns,
    which are written there as trajectory.csv, a temporary folder that is gone with the result).

    Raises InvalidArgument with file and line for a missing column, a value that is not a number, time that does not increase, a map
    that does not fit the model.
    """
    if isinstance(trajectory, Mapping):
        return _judge_columns(trajectory, model, map, out)
    file = Path(trajectory)
    return _judge_file(file, model, map, Path(out) if out is not None else Path("results") / f"{file.stem}-judge")


def _judge_columns(columns: Mapping[str, Any], model: PathLike, map: PathLike | Mapping[str, Any] | None, out: PathLike | None) -> Result:
    named = map is not None and (not isinstance(map, Mapping) or "time" in map.get("columns", {}))
    if len(columns) > 0 and not named and not {"time", "t"} & set(columns):
        raise InvalidArgument("the columns have no 'time' or 't'")
    folder = Path(out if out is not None else tempfile.mkdtemp(prefix="porthos_judge_"))
    try:
        _write_csv(folder / "trajectory.csv", columns)
        result = _judge_file(folder / "trajectory.csv", model, map, folder)
    except BaseException as error:
        if out is None:
            shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, InvalidArgument):
            raise type(error)(_of_arguments(str(error), folder, isinstance(map, Mapping))) from None
        raise
    if out is None:
        weakref.finalize(result, shutil.rmtree, folder, ignore_errors=True)
    return result


def _of_arguments(text: str, folder: Path, mapped: bool) -> str:
    """An error that names the files which were written of arguments, with the arguments in their place."""
    place = lambda line: f"trajectory: row {int(line) - 2}" if line and int(line) > 2 else "trajectory"  # below the line of names
    text = re.sub(re.escape(str(folder / "trajectory.csv")) + r"(?::(\d+))?", lambda m: place(m[1]), text)
    return re.sub(re.escape(str(folder / "map.toml")) + r"(:\d+)*", "map", text) if mapped else text


def _judge_file(file: Path, model: PathLike, map: PathLike | Mapping[str, Any] | None, out: Path) -> Result:
    if isinstance(map, Mapping):
        out.mkdir(parents=True, exist_ok=True)
        text = _toml(map)
        map = out / "map.toml"
        map.write_text(text, encoding="utf-8")
    summary = _core.judge_into(str(file), str(model), "" if map is None else str(map), str(out))
    report_beside(out, [Path(model).resolve().parent])
    return Result(json.loads(summary), out)


def _toml(table: Mapping[str, Any], name: str = "") -> str:
    """The table as TOML: its values first, then its tables and arrays of tables."""
    values, tables = [], []
    for key, value in table.items():
        key = key if re.fullmatch("[A-Za-z0-9_-]+", str(key)) else json.dumps(str(key), ensure_ascii=False)
        full = f"{name}.{key}" if name else key
        if isinstance(value, Mapping):
            tables.append(f"[{full}]\n" + _toml(value, full))
        elif isinstance(value, (list, tuple)) and value and all(isinstance(one, Mapping) for one in value):
            tables += [f"[[{full}]]\n" + _toml(one, full) for one in value]
        else:
            values.append(f"{key} = {_toml_value(value, full)}\n")
    return "".join(values + tables)


def _toml_value(value: Any, name: str) -> str:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml_value(one, name) for one in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return repr(value)
    raise InvalidArgument(f"map: {name} is a {type(value).__name__}, expected a number, a text, a list or a table")


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
