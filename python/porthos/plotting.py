"""Pictures of a run, by matplotlib: energies, works, the residual of the balance with guide lines, the motion, momentum errors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._core import InvalidArgument
from .ensembles import EnsembleResult
from .results import PathLike, Result
from .results import open as open_result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, SOFT, GRID, GUIDE = "#1f2933", "#66717f", "#e4e8ed", "#8a94a0"
# told apart by lightness as well, for readers who do not see all colours
LINES = ["#2a5b8c", "#c8743a", "#4f8f5b", "#8a5aa8", "#b8a13a", "#3f9c9c", "#a84a5f", "#777f88"]


def thinned(t: np.ndarray, most: int = 3000) -> np.ndarray:
    """Indices of at most so many records, the last among them."""
    return np.unique(np.linspace(0, len(t) - 1, min(len(t), most)).astype(int))


def envelope(t: np.ndarray, y: np.ndarray, columns: int = 1200) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(t, least, greatest) of |y| in columns of equal width in log t: every peak of a million records stays."""
    keep = t > 0
    t, y = t[keep], np.abs(y[keep])
    if len(t) <= columns:
        return t, y, y
    edges = np.geomspace(t[0], t[-1], columns + 1)
    at = np.unique(np.searchsorted(t, edges[:-1]))
    at = at[at < len(t)]
    return t[at], np.minimum.reduceat(y, at), np.maximum.reduceat(y, at)


def _style(ax: "Axes", title: str, unit: str) -> None:
    ax.set_title(title, loc="left", fontsize=9, color=INK)
    ax.set_ylabel(unit, fontsize=8, color=SOFT)
    ax.tick_params(labelsize=7.5, colors=SOFT, length=3)
    ax.grid(True, color=GRID, linewidth=0.7)
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color(GUIDE)


def _legend(ax: "Axes") -> None:
    handles, _ = ax.get_legend_handles_labels()
    if len(handles) > 8:  # they would lie on the lines
        ax.legend(fontsize=6, frameon=False, labelcolor=INK, loc="center left", bbox_to_anchor=(1, 0.5), handlelength=1.4)
    elif handles:
        ax.legend(fontsize=7, frameon=False, labelcolor=INK, ncol=1 + (len(handles) > 5), loc="best", handlelength=1.4)


def _energies(ax: "Axes", r: Result) -> None:
    stored, at = r.group("stored"), thinned(r.time)
    t, base = r.time[at], np.zeros(len(at))
    _style(ax, "stored energies, stacked from their least values", "J")
    for k, (name, y) in enumerate(stored.items()):
        top = base + (y[at] - min(0.0, y.min()))
        ax.fill_between(t, base, top, color=LINES[k % len(LINES)], alpha=0.75, linewidth=0, label=name)
        base = top
    _legend(ax)


def _works(ax: "Axes", r: Result) -> None:
    _style(ax, "works: through sources (full), to losses (dashed)", "J")
    at = thinned(r.time)
    lines = [(n, y, "-") for n, y in r.group("supplied").items()] + [(n, y, "--") for n, y in r.group("dissipated").items()]
    for k, (name, y, dash) in enumerate(lines):
        ax.plot(r.time[at], y[at], dash, color=LINES[k % len(LINES)], linewidth=1.2, label=name)
    if not lines:
        ax.text(0.5, 0.5, "nothing is supplied or lost", transform=ax.transAxes, ha="center", va="center", fontsize=8, color=SOFT)
    _legend(ax)


def _guides(ax: "Axes", t: np.ndarray, level: float) -> None:
    """t^(1/2), a random walk of rounding errors, and t, a drift, through the level at the end."""
    for power, name in ((0.5, "∝ √t"), (1.0, "∝ t")):
        y = level * (t / t[-1]) ** power
        ax.plot(t, y, ":", color=GUIDE, linewidth=1)
        k = int(0.12 * len(t))
        ax.annotate(name, (t[k], y[k]), textcoords="offset points", xytext=(0, -9), fontsize=7, color=GUIDE)


def _logarithmic(ax: "Axes", curves: dict[str, tuple[np.ndarray, np.ndarray]], guides: bool) -> None:
    ends = []
    for k, (name, (t, y)) in enumerate(curves.items()):
        if not np.any(y):
            ax.plot([], [], color=LINES[k], label=f"{name}: exactly 0")
            continue
        t, low, high = envelope(t, y)
        floor = high.max() * 1e-4  # an error that passes through zero says nothing by it
        ax.fill_between(t, np.maximum(low, floor), np.maximum(high, floor), where=high > floor, color=LINES[k], alpha=0.3, linewidth=0.6)
        so_far = np.maximum.accumulate(high)
        ax.plot(t, np.where(so_far > 0, so_far, np.nan), color=LINES[k], linewidth=1.3, label=name)
        ends.append((t, so_far[-1]))
    if ends:
        ax.set_xscale("log"), ax.set_yscale("log")
        if guides:
            _guides(ax, np.geomspace(ends[0][0][0], ends[0][0][-1], 200), ends[0][1])
    _legend(ax)


def draw(result: Result) -> "Figure":
    """Four panels of one result, as a matplotlib Figure."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InvalidArgument("plots need matplotlib, which is not installed (Debian: python3-matplotlib); "
                              "the command `porthos plot` draws SVG without it") from None
    s = result.summary
    figure = Figure(figsize=(11, 6.6), layout="constrained")
    ((a, b), (c, d)) = figure.subplots(2, 2)
    _energies(a, result)
    _works(b, result)
    _residual(c, result)
    limit = next((x["limit"] for x in s["checks"] if x["name"] == "energy"), None)
    if limit and c.get_yscale() == "log":
        c.axhline(limit, color="#c8472f", linewidth=1)
        c.annotate("limit", (1, limit), xycoords=("axes fraction", "data"), xytext=(-2, 3), textcoords="offset points",
                   ha="right", fontsize=7, color="#c8472f")
    _style(d, "momentum errors (world axes) and |ξ| - 1", "kg m/s, kg m²/s, 1")
    size = lambda name: np.linalg.norm(result[name], axis=1)
    momenta = {w: (result.time, size(f"{w}_momentum_error")) for w in ("linear", "angular") if f"{w}_momentum_error" in result.names}
    _logarithmic(d, {**momenta, "quaternion norm": (result.time, result["quaternion_norm_error"])}, False)
    for ax in (c, d):
        ax.set_xlabel("time [s]", fontsize=8, color=SOFT)
    figure.suptitle(f"{s['title']}    {s['method']}, step {s['step_s']:g} s, {s['steps']} steps, verdict: {s['verdict']}",
                    x=0.01, ha="left", fontsize=11, color=INK)
    return figure


def _of_motion(result: Result) -> tuple[dict[str, Any], dict[str, Any]]:
    """Panels of the motion by their titles without units: "joints", "rates of joints", ...; and each of their lines by its name."""
    motion = result.motion()
    t = motion.pop("time [s]")["t"]

    def panel(what, lines):
        def draw_into(ax, _):
            title, unit = what[:-1].split(" [")
            _style(ax, title, unit)
            for k, (name, y) in enumerate(lines.items()):
                ax.plot(t, y, color=LINES[k % len(LINES)], linestyle=("-", "--", ":")[k // len(LINES) % 3], linewidth=1.2, label=name)
            _legend(ax)
        return draw_into

    panels, alone = {}, {}
    for what, lines in motion.items():
        title, unit = what[:-1].split(" [")
        panels[title if title not in panels else what] = panel(what, lines)  # outputs have a panel for each unit
        for name, y in lines.items():
            alone.setdefault(name, panel(f"{name} [{unit}]", {name: y}))
    return panels, alone


def _residual(ax: "Axes", r: Result) -> None:
    _style(ax, "residual of the energy balance, relative (band: range, line: largest so far)", "1")
    _logarithmic(ax, {"energy": (r.time, r["energy_error"] / (r.summary["energy"]["scale_J"] or 1.0))}, True)


PANELS = {"energies": _energies, "works": _works, "residual": _residual}


def panel(result: Result | PathLike, what: str, axes: "Axes | None" = None) -> Any:
    """One panel of a result with axes of its own, or in yours: "energies", "works", "residual", or of the motion "joints", "rates of joints" ...

    what = "motion": all panels of the motion in one figure. The name of a line, as of an output: that line alone. Returns the
    Figure. Raises InvalidArgument, naming what there is.
    """
    if not isinstance(result, Result):
        result = open_result(result)
    if not isinstance(what, str):
        raise InvalidArgument(f"what is {what!r}, expected the name of a panel")
    title = what.split(" [")[0]  # without the unit that motion() adds
    known, lines = dict(PANELS), {}
    if title not in known:
        motion, lines = _of_motion(result)
        known.update(motion)
    draw = {**lines, **known}
    what = what if what in draw else title
    names = [n for n in known if n not in PANELS] if what == "motion" else [what]
    if what != "motion" and what not in draw:
        raise InvalidArgument(f"what is '{what}', expected motion, {', '.join(known)} or a line")
    if axes is not None:
        if len(names) > 1:
            raise InvalidArgument(f"axes are of one panel, expected what to be one of {', '.join(known)}")
        draw[names[0]](axes, result)
        axes.set_xlabel("time [s]", fontsize=8, color=SOFT)
        return axes.figure
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 2.3 * len(names) + 0.6), layout="constrained")
    for name, ax in zip(names, figure.subplots(len(names), 1, squeeze=False)[:, 0]):
        draw[name](ax, result)
        ax.set_xlabel("time [s]", fontsize=8, color=SOFT)
    figure.suptitle(result.summary["title"] or "run", x=0.01, ha="left", fontsize=11, color=INK)
    return figure


def _histogram(ax: "Axes", title: str, unit: str, y: np.ndarray, passed: np.ndarray, log: bool) -> None:
    """Of the cases that passed, and upon them of the others."""
    _style(ax, title, "cases")
    ax.set_xlabel(unit, fontsize=8, color=SOFT)
    keep = np.isfinite(y) & ((y > 0) | (not log))
    if not keep.any():
        ax.text(0.5, 0.5, "exactly 0 in every case" if np.isfinite(y).any() else "in no case", transform=ax.transAxes, ha="center", va="center", fontsize=8, color=SOFT)
        return
    low, high = y[keep].min(), y[keep].max()
    if low == high:
        ax.text(0.5, 0.5, f"{low:.3g} in every case", transform=ax.transAxes, ha="center", va="center", fontsize=8, color=SOFT)
        return
    edges = np.geomspace(low, high * (1 + 1e-12), 49) if log else np.linspace(low, high, 49)
    ax.hist([y[keep & passed], y[keep & ~passed]], bins=edges, stacked=True, color=[LINES[0], "#c8472f"], label=["passed", "not passed"])
    if log:
        ax.set_xscale("log")
    if (keep & ~passed).any():
        _legend(ax)


def _ensemble(e: EnsembleResult, what: str | None, axes: "Axes | None") -> "Figure":
    """Histograms over the cases: of the errors and of the outputs at the end, or of one number by its name."""
    errors = {k: (k.replace("_", " "), "relative", e[k], True) for k in e.summary if k.endswith("_error")}
    known = {**errors, **{k: (k, "", v, False) for k, v in e.outputs().items()}}
    first = list(known)
    known.update({k: (k, "", v, False) for k, v in e.inputs.items()})
    known.update({k: (k, "s", v, False) for k, v in e.events.items()})
    if what is not None and what not in known:
        raise InvalidArgument(f"what is '{what}', expected one of {', '.join(known)}")
    names, passed = first if what is None else [what], e["passed"] == 1
    if axes is not None:
        _histogram(axes, *known[names[0]][:3], passed, known[names[0]][3])
        return axes.figure
    from matplotlib.figure import Figure

    across = min(3, len(names))
    down = -(-len(names) // across)
    figure = Figure(figsize=(1.2 + 3.6 * across, 2.4 * down + 0.6), layout="constrained")
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for ax, name in zip(grid, names):
        title, unit, y, log = known[name]
        _histogram(ax, title, unit, y, passed, log)
    for ax in grid[len(names):]:
        ax.set_visible(False)
    s = e.summary
    figure.suptitle(f"{s['title'] or 'ensemble'}    {s['passed']} of {s['cases']} cases passed", x=0.01, ha="left", fontsize=11, color=INK)
    return figure


def plot(result: Result | EnsembleResult | PathLike, path: PathLike | None = None, what: str | None = None, axes: "Axes | None" = None) -> Any:
    """Draws a result, or the one in a folder. path: a .png, .svg or .pdf file; None: plot.png in the folder of the run, or for a
    run in memory the Figure alone, which is returned in any case. Phases of a scene with events have a picture each, but for their
    motion, which is in one. Of an ensemble: histograms over its cases, what: one number by its name.

    what: "motion" or one panel, see panel(); then a file is written only if path names one. axes: matplotlib axes to draw it in.
    """
    if what is None and axes is not None:
        raise InvalidArgument("axes are of one panel, expected what as well")
    if not isinstance(result, (Result, EnsembleResult)):
        result = open_result(result)
    if isinstance(result, EnsembleResult):
        figure = _ensemble(result, what, axes)
        if path is None and what is None:
            path = result.folder / "plot.png"
        return _saved(figure, path)
    phases = result.phases
    of_motion = isinstance(what, str) and what.split(" [")[0] not in PANELS  # all phases are in one picture
    if len(phases) > 1 and not of_motion:
        if axes is not None:
            raise InvalidArgument(f"axes are of one phase, expected one of the {len(phases)} in result.phases")
        return [plot(p, None if path is None else Path(path).with_stem(f"{Path(path).stem}_{k}"), what) for k, p in enumerate(phases, 1)]
    if path is None and result.folder is not None and what is None:
        path = result.folder / "plot.png"
    figure = draw(phases[0]) if what is None else panel(result if of_motion else phases[0], what, axes)
    return _saved(figure, path)


def _saved(figure: Any, path: PathLike | None) -> Any:
    if path is not None:
        if Path(path).suffix not in (".png", ".svg", ".pdf"):
            raise InvalidArgument(f"path is '{path}', expected a name that ends with .png, .svg or .pdf")
        figure.savefig(path, dpi=150)
    return figure
