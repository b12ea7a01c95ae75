"""The options of Env and VectorEnv: what does not fit is refused when the environment is made."""

from __future__ import annotations

import difflib
from typing import Any, Mapping, Sequence

import numpy as np

from ._core import Description, InvalidArgument, Mechanism, Model, PowerKind

passed_on = ("method", "step", "substeps", "seed", "longest", "threads", "ports", "begin", "ended")  # to Environment


def check_look(look: dict[str, Any]) -> None:
    """Of picture=."""
    known = {"size": None, "camera": ("iso", "x", "y", "z"), "follow": ("place", "base", "world"), "dark": None}
    for key, value in look.items():
        if key not in known:
            raise InvalidArgument(f"picture has '{key}', expected {', '.join(known)}")
        if (words := known[key]) and value not in words:
            raise InvalidArgument(f"picture has {key}={value!r}, expected one of {', '.join(words)}")


def check_options(options: dict[str, Any]) -> None:
    """Those that go on to Environment."""
    if "outputs" in options:
        raise InvalidArgument("outputs is of Environment, expected observed=, a list of names of the state or of the scene's outputs")
    for name in options:
        if name in ("cases", "change"):
            raise InvalidArgument(f"{name} is of from_scene, expected " + ("begin=, a function that says where episodes begin" if name == "cases" else "another model"))
        if name not in passed_on:
            known = ("reward", "terminated", "limit", "num_envs", "dtype", "mechanism", "scene", "render_mode", "picture", "rates", "observed", "cases", "change", *passed_on)
            near = difflib.get_close_matches(name, known, 1)
            raise InvalidArgument(f"there is no option '{name}', expected {repr(near[0]) if near else 'one of ' + ', '.join(known[:6]) + ', ...: help(porthos.VectorEnv)'}")
    if isinstance(ports := options.get("ports"), str):
        raise InvalidArgument(f"ports is {ports!r}, expected a list of names: [{ports!r}]")


def read_only(a: np.ndarray) -> np.ndarray:
    """A view of the same numbers, by which they cannot be written."""
    view = a.view()
    view.flags.writeable = False
    return view


def driven(given: Sequence[str] | None, d: Description, m: Mechanism | None) -> dict[str, int]:
    """The ports that actions drive, and their sizes; where none are given, all but the wrenches on free bodies, or these where there is nothing else."""
    sizes = {p.name: p.size for p in d.ports}
    if not given:
        free = {c.joint + ".wrench" for c in m.coordinates} if m is not None else {"base.wrench"}
        return {p: n for p, n in sizes.items() if n < 6 or p not in free} or sizes
    for port in given:
        if port not in sizes:
            near = [p for p in sizes if p.startswith(f"{port}.")] or difflib.get_close_matches(port, sizes, 1) or list(sizes)[:3]
            raise InvalidArgument(f"ports has '{port}', expected a port of '{d.name}', as {', '.join(map(repr, near))}")
        if list(given).count(port) > 1:
            raise InvalidArgument(f"ports: the port '{port}' is named twice, expected once")
    return {p: sizes[p] for p in given}


def refuse_jumps(model: Model) -> None:
    """Refuses a model that jumps or sticks, in the words of a scene: rigid contacts count their impacts, dry friction its slips."""
    for name, _, counts in (p.name.rpartition(".") for p in model.description.powers if p.kind == PowerKind.observed):
        if counts == "impacts":
            raise InvalidArgument(f"an environment does not jump: '{name}' is rigid, expected a soft contact, as law = \"smooth\", or an element of type 'limits'")
        if counts == "slips":
            raise InvalidArgument(f"an environment does not stick: '{name}' is dry, expected an element of type 'friction', which is smooth")


def of_each(what: str, given: Any, n: int) -> np.ndarray:
    """What a function of the batch gave, a number for each of n environments."""
    if np.shape(given) != (n,):
        raise InvalidArgument(f"{what} gave shape {np.shape(given)}, expected ({n},)")
    return np.asarray(given)


def limits(limit: Any, ports: Mapping[str, int]) -> np.ndarray:
    """Of each number of the ports, whose sizes they are; limit: a number, one of each port, or by names."""
    if isinstance(limit, Mapping):
        if wrong := [p for p in limit if p not in ports] or [p for p in ports if p not in limit]:
            told = f"has no '{wrong[0]}'" if wrong[0] in ports else f"is of '{wrong[0]}', which is no port that is driven"
            raise InvalidArgument(f"limit {told}, expected one for each: {', '.join(ports)}")
        limit = [limit[p] for p in ports]
    given = np.asarray(limit if isinstance(limit, (int, float, np.number, list, tuple, np.ndarray)) else np.nan)
    if given.dtype.kind not in "iuf" or given.shape not in ((), (len(ports),)) or not (given > 0).all():
        raise InvalidArgument(f"limit is {limit!r}, expected a number above 0, or {len(ports)} of them: the largest input of each port")
    return np.repeat(np.broadcast_to(given.astype(np.float64), len(ports)), list(ports.values()))
