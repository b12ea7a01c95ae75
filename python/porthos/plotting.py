"""Pictures of a run, by matplotlib: energies, works, the residual of the balance, the motion, momentum errors.

What a panel holds comes from C++, as in the SVG files (scene/plot); here it is drawn into axes of the user's.
"""

from __future__ import annotations

import difflib
import textwrap
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._core import InvalidArgument, before_holes, is_held, line_colours, residual_panel
from ._core import thinned as thinned_rows
from .ensembles import EnsembleResult, is_same
from .results import Comparison, PathLike, Result, steps_of
from .results import open as open_result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, SOFT, GRID, GUIDE = "#1f2933", "#66717f", "#e4e8ed", "#8a94a0"
ALARM = "#c8472f"
LINES = line_colours()  # of every picture, also of the SVG files and the report
# told apart without colours as well
DASHES: list[Any] = ["-", (0, (4, 2)), (0, (1.2, 1.8)), (0, (7, 2, 1.2, 2)), (0, (2.5, 1.5)), (0, (9, 3)), (0, (7, 2, 1.2, 2, 1.2, 2)), (0, (1.2, 3.5))]


def thinned(t: np.ndarray, most: int = 3000) -> np.ndarray:
    """Indices of at most so many records for a line, as the SVG files have them: a fast swing is not drawn as a slow one."""
    return np.array(thinned_rows(len(t), most))


def _style(ax: "Axes", title: str, unit: str) -> None:
    if ax.name == "3d":
        raise InvalidArgument(f"the axes are of three dimensions and '{title}' is no place x, y, z in metres, expected axes as of Figure().subplots()")
    ax.set_title(title, fontsize=9, color=INK)
    ax.set_xlabel("time [s]", fontsize=8, color=SOFT)
    ax.set_ylabel(title if unit == "1" else unit, fontsize=8, color=SOFT)
    ax.tick_params(labelsize=7.5, colors=SOFT, length=3)
    ax.grid(True, color=GRID, linewidth=0.7)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(GUIDE)


def _legend(ax: "Axes", narrow: bool = False) -> float:
    """Above the axes and their title, where it covers no data; its height [pt]. narrow: in axes of the user's, of which it takes at most
    half the height, by smaller letters; within them, above the data, where nothing makes room above."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    handles, names = ax.get_legend_handles_labels()
    if not handles or len(names) == 1 and f".{ax.get_title()}".endswith(f".{names[0]}"):
        return 0.0
    figure = ax.get_figure()
    width, height = (72 / figure.dpi * x for x in ax.bbox.size)
    for size in (7, 6, 5) if narrow else (7,):
        entry = 4.3 * size + max(text_to_path.get_text_width_height_descent(n, FontProperties(size=size), False)[0] for n in names)
        across = min(len(names), max(1, int((width + 1.2 * size) / entry)))  # no gap right of the last column
        tall = 1.5 * size * -(-len(names) // across)
        if tall <= 0.5 * height:
            break
    if narrow and tall > 0.5 * height:
        warnings.warn(f"the names of {len(names)} lines do not fit above these axes, expected larger axes, or legend=False and names of your own", stacklevel=5)
        return 0.0
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0, 1), "borderaxespad": (22 if ax.get_title() else 3) / size, "frameon": False}
    if narrow and not figure.get_layout_engine() and tall + 22 > 72 / figure.dpi * (figure.bbox.y1 - ax.bbox.y1):
        place = {"loc": "best", "framealpha": 0.8}
        if ax.get_autoscaley_on():  # limits of the user's own stay
            place = {"loc": "upper left", "borderaxespad": 3 / size, "frameon": False}
            _make_room(ax, tall + 6, height)
    ax.legend(**place, fontsize=size, labelcolor=INK, borderpad=0, ncol=across, handlelength=2.2, columnspacing=1.2)
    return tall


def _make_room(ax: "Axes", tall: float, height: float) -> None:
    """Raises the upper end of y so that nothing lies in the uppermost part of the axes, tall of their height [pt]."""
    ax.autoscale(axis="y")  # what an earlier legend needed is no more
    low, high = ax.transScale.transform([(1, y) for y in ax.get_ylim()])[:, 1]
    top = ax.transScale.inverted().transform((0, low + (high - low) * height / (height - tall)))[1]
    ax.set_ylim(top=top, auto=True)  # lines that follow make limits of their own


def _before_holes(r: Result) -> np.ndarray:
    """Times of the rows of a judged file behind which others are missing, most being at equal intervals [s]."""
    if r.summary["method"] != "recorded":
        return np.empty(0)
    return np.array(before_holes(r.time))


def _lines(ax: "Axes", r: Result, t: np.ndarray, lines: dict[str, np.ndarray], angles: bool = False) -> None:
    """Of many lines those that are 0 all the time are counted. Angles [rad] that never leave [-π, π] have gaps where they jump, all lines
    where rows of a judged file are missing. What a sampled controller holds is drawn as stairs. A line that covers an area has no dashes, whose
    pattern would look like a beat."""
    holes = np.searchsorted(t, _before_holes(r), side="right")
    shown = {n: y for n, y in lines.items() if np.any(y)}
    if len(lines) <= 4 or len(lines) - len(shown) < 2:
        shown = lines
    first = len(ax.get_legend_handles_labels()[0])  # of another run in the same axes
    for k, (name, y) in enumerate(shown.items(), first):
        wraps = angles and not np.any(np.abs(y) > np.pi + 1e-9)
        jumps = np.flatnonzero(np.abs(np.diff(y)) > np.pi) + 1 if wraps else []
        at = np.union1d(holes, jumps).astype(int)  # gaps
        covers = np.count_nonzero(np.diff(y)[1:] * np.diff(y)[:-1] < 0) > max(len(y) / 8, 140)
        style = {"color": LINES[k % 8], "linestyle": "-" if covers else DASHES[(k + k // 8) % 8], "drawstyle": "steps-post" if is_held(y) else "default"}
        ax.plot(np.insert(t, at, np.nan), np.insert(y, at, np.nan), **style, linewidth=1.2, label=name)
    if idle := len(lines) - len(shown):
        ax.plot([], [], color=SOFT, linewidth=0.6, label=f"{idle} {'others' if shown else 'lines'}: 0")


def _in_order(r: Result, group: str, rows: str) -> dict[str, np.ndarray]:
    """The series of a group in the order of the summary, as in the SVG files."""
    all = r.group(group)
    return {n: all[n] for n in [*(k.replace("/", "_") for k in r.summary["balance"][rows]), *all] if n in all}


def _energies(ax: "Axes", r: Result) -> None:
    stored, at = _in_order(r, "stored", "storages"), thinned(r.time)
    t, base = r.time[at], np.zeros(len(at))
    _style(ax, "energies", "J")
    for k, (name, y) in enumerate(stored.items()):
        least = min(0.0, y.min())
        top = base + (y[at] - least)
        ax.fill_between(t, base, top, color=LINES[k % 8], alpha=0.8, linewidth=0, label=name + (" (above its least)" if least < 0 else ""))
        base = top


def _works_of(r: Result) -> dict[str, np.ndarray]:
    supplied, lost = _in_order(r, "supplied", "ports"), _in_order(r, "dissipated", "losses")
    return {f"{n} (in)": y for n, y in supplied.items()} | {f"{n} (lost)": y for n, y in lost.items()}


def _works(ax: "Axes", r: Result) -> None:
    at, works = thinned(r.time), _works_of(r)
    if not works:
        raise InvalidArgument("the run has no panel 'works': nothing is supplied or lost")
    _style(ax, "works", "J")
    _lines(ax, r, r.time[at], {n: y[at] for n, y in works.items()})


def _logarithmic(ax: "Axes", t: np.ndarray, error: np.ndarray, limit: float | None = None) -> None:
    """What residual_panel() says. Of several runs in the same axes each has its colour; guides and limit are those of the first."""
    k = sum(hasattr(line, "of_run") for line in ax.get_lines())
    for label, stroke, at, y, low in residual_panel(t, error, None if k else limit):
        if stroke == "band":
            setattr(ax.fill_between(at, low, y, color=LINES[k % 8 if k else 7], alpha=0.2 if k else 0.45, linewidth=0.6, label=None if k else label), "of_band", True)
        elif stroke == "line":
            (line,) = ax.plot(at, y, color=LINES[k % 8], linestyle=DASHES[k % 8], linewidth=1.3, label=f"run {k + 1}" if k else label)
            setattr(line, "of_run", True)
        elif not k:
            ax.plot(at, y, color=GUIDE if stroke == "guide" else ALARM, linestyle="--" if stroke == "guide" else ":", linewidth=1, label=label)
    if np.any(error):
        ax.set_yscale("log")
        if t[-1] > 100 * (t[1] - t[0]):
            ax.set_xscale("log")


def draw(result: Result) -> "Figure":
    """The panels of one result, as a matplotlib Figure."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InvalidArgument("plots need matplotlib, which is not installed (Debian: python3-matplotlib); "
                              "the command `porthos plot` draws SVG without it") from None
    s = result.summary
    drawn = [_energies, *([_works] if _works_of(result) else []), _residual, *_momenta_of(result)]
    down = -(-len(drawn) // 2)
    figure = Figure(figsize=(11, 3.7 * down), layout="constrained")
    grid = figure.subplots(down, 2).ravel()
    for ax, into in zip(grid, drawn):
        into(ax, result)
        _legend(ax)
    for ax in grid[len(drawn):]:
        figure.delaxes(ax)
    figure.suptitle(f"{s['title']}    {s['method']}, {steps_of(s)}, verdict: {s['verdict']}",
                    x=0.01, ha="left", fontsize=11, color=INK)
    return figure


def _of_motion(motion: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Panels of the motion, or of the states, by their titles, "joints", "rates of joints", ..., with the unit where several have one title:
    "outputs [N m]"; and each of their lines by its name, which with the panel's before it, "tip.x", is always one."""
    t = motion.pop("time [s]")["t"]

    def panel(title, unit, lines):
        def draw_into(ax, r):
            if ax.name == "3d" and unit == "m" and list(lines) == ["x", "y", "z"]:
                return _path(ax, title, lines)
            turning = title.replace("joints", "turning joints")
            others = len(motion.get(f"{turning} [{unit}]", ())) if title in ("joints", "rates of joints") else 0
            _style(ax, title, unit)
            if others:
                ax.set_title(f"{title} ({others} {'other is' if others == 1 else 'others are'} in '{turning}')", fontsize=9, color=INK)
            _lines(ax, r, t, lines, unit == "rad")
        return draw_into

    def several(name, places, kind="a line"):
        def refuse(*_):
            raise InvalidArgument(f"what is '{name}', {kind} of several panels, expected one of: {', '.join(places)}")
        return refuse

    panels, alone, places = {}, {}, {}
    for what, lines in motion.items():
        title, unit = what[:-1].split(" [")
        same = [k for k in motion if k.split(" [")[0] == title]  # outputs have a panel for each unit
        panels[what if same[1:] else title] = panel(title, unit, lines)
        if same[1:]:
            alone[title] = several(title, same, "the name")
        for name, y in lines.items():
            full = f"{title}.{name}"
            moment, comma, force = unit.partition(", ")  # of a wrench
            alone[full] = panel(full, force if comma and name[0] != "m" else moment, {name: y})
            places.setdefault(name, []).append(full)
            spring = places[name][0].startswith("deflections of springs.")
            if places[name][1:] and (spring or name in ("w", "x", "y", "z", "mx", "my", "mz", "fx", "fy", "fz")):
                alone[name] = several(name, places[name])
            else:  # joint_1 is the place, not the rate, as its panel comes first
                alone.setdefault(name, panel(name, unit, {name: y}))
    return panels, alone


def _path(ax: Any, title: str, lines: dict[str, np.ndarray]) -> None:
    """A place in metres as a path in space."""
    k = len(ax.get_legend_handles_labels()[0])
    ax.plot(*lines.values(), color=LINES[k % 8], linestyle=DASHES[k % 8], linewidth=1.2, label=title)
    ax.set_title(title, fontsize=9, color=INK)
    ax.tick_params(labelsize=7, colors=SOFT, pad=0)
    for name in lines:
        getattr(ax, f"set_{name}label")(f"{name} [m]", fontsize=8, color=SOFT, labelpad=-4)
    ax.set_aspect("equal")


def _residual(ax: "Axes", r: Result) -> None:
    _style(ax, "residual", "relative")
    limit = next((x["limit"] for x in r.summary["checks"] if x["name"] == "energy"), None)
    _logarithmic(ax, r.time, r["energy_error"] / (r.summary["energy"]["scale_J"] or 1.0), limit)


def _momenta_of(r: Result) -> list[Any]:
    """A panel of each error that is not 0, as each has a unit of its own; the first names those that are kept exactly."""
    size = lambda name: np.linalg.norm(r[name], axis=1)
    errors = {f"{w} momentum": (unit, size(f"{w}_momentum_error")) for w, unit in (("linear", "kg m/s"), ("angular", "kg m²/s")) if f"{w}_momentum_error" in r.names}
    if "quaternion_norm_error" in r.names:
        errors["quaternion norm"] = ("relative", r["quaternion_norm_error"])
    judged = {c["name"].replace("_", " ") for c in r.summary["checks"]}
    kept = [f"{n}: 0 at every record, kept exactly" for n, (_, y) in errors.items() if not np.any(y) and n in judged]

    def panel(name, unit, y, others):
        def draw_into(ax, r):
            _style(ax, f"error of the {name}{' (world axes)' if 'momentum' in name else ''}", unit)
            _logarithmic(ax, r.time, y)
            for other in others:
                ax.plot([], [], color=SOFT, linewidth=0.6, label=other)
        return draw_into

    shown = [(n, unit, y) for n, (unit, y) in errors.items() if np.any(y)]
    return [panel(*of, [] if k else kept) for k, of in enumerate(shown)]


def _row(key: str) -> tuple[str, Any]:
    """A row of the ledger by its name, and alone."""
    name = key.partition("/")[2]

    def draw_into(ax, r):
        t, y = r.joined(key) if len(r.phases) > 1 else (r.time, r[key])
        at = thinned(t)
        _style(ax, name, "J")
        _lines(ax, r, t[at], {name: y[at]})
    return name, draw_into


PANELS = {"energies": _energies, "works": _works, "residual": _residual}


def panel(result: Result | PathLike, what: str, axes: "Axes | None" = None, label: str | None = None, legend: bool = True) -> Any:
    """One panel of a result with axes of its own, or in yours: "energies", "works", "residual", or of the motion "joints", "rates of joints" ...

    what = "motion": all panels of the motion in one figure, more than six in two columns. "states": the states and momenta of any system, as of a
    Network; of one without a mechanism each by the name of its block. A beginning that no other panel has is enough, "rates of base". The name of a
    line, as of an output, or of a row of the ledger: that line alone. label: what a
    run is called among others in the same axes. legend: whether lines are named above the axes (in them where the figure has no layout
    and they do not fit above; left out with a warning where they would take more than half the height). Axes of three dimensions show a
    place x, y, z [m] as a path. Returns the Figure. Raises InvalidArgument, naming what there is.
    """
    if not isinstance(result, Result):
        result = open_result(result)
    if not isinstance(what, str):
        raise InvalidArgument(f"what is {what!r}, expected the name of a panel")
    title = what.split(" [")[0]  # without the unit that motion() adds
    known, lines, whole = dict(PANELS), {}, "motion"
    if title not in known:
        if title in ("states", "momenta") or what != whole and not result.has_mechanism():
            whole = "states"
        motion, lines = _of_motion(result.states(bands=True) if whole == "states" else result.motion(bands=True))
        known.update(motion)
    series = [k for p in result.phases if len(result.phases) > 1 for k in p.names] or result.names
    rows = dict(_row(k) for k in series if k.startswith(("stored/", "supplied/", "dissipated/")))
    draw = {**rows, **lines, **known}
    all = what == whole
    what = what if what in draw else title
    if what not in draw and len(begin := [n for n in known if what and n.startswith(what)]) == 1:
        what = begin[0]
    names = [n for n in known if n not in PANELS] if all else [what]
    if not all and what not in draw:
        near = difflib.get_close_matches(what, [whole, *draw], n=1, cutoff=0)[0]
        raise InvalidArgument(f"what is '{what}', the nearest is '{near}', expected {', '.join(repr(n) if ',' in n else n for n in dict.fromkeys([whole, *known]))} or a line"
                              + ("" if whole == "motion" or result.has_mechanism() else " (the run has no mechanism)"))
    if axes is not None:
        if len(names) > 1:
            raise InvalidArgument(f"axes are of one panel, expected what to be one of {', '.join(known)}")
        before, unit = set(axes.get_children()), axes.get_ylabel()
        draw[names[0]](axes, result)
        _title_of_all(axes, names[0], unit)
        if label is None:
            _tell_apart(names[0], axes, before)
        else:
            _call(label, [a for a in axes.get_legend_handles_labels()[0] if a not in before])
        if legend:
            _legend(axes, narrow=True)
        return axes.figure
    from matplotlib.figure import Figure

    across = 2 if len(names) > 6 else 1
    down = -(-len(names) // across)
    figure = Figure(figsize=(7.5 if across == 1 else 12, 2.3 * down + 0.6), layout="constrained")
    taller = [0.0] * down
    for k, name in enumerate(names):
        ax = figure.add_subplot(down, across, k % down * across + k // down + 1)  # the first ones left
        draw[name](ax, result)
        if legend:
            taller[k % down] = max(taller[k % down], _legend(ax))
    figure.set_figheight(figure.get_figheight() + sum(taller) / 72)
    figure.suptitle(result.summary["title"] or "run", x=0.01, ha="left", fontsize=11, color=INK)
    return figure


def _title_of_all(axes: Any, title: str, unit: str) -> None:
    """Axes with several panels are named by all of them, with the units of all. unit: of those before"""
    setattr(axes, "of_panels", list(dict.fromkeys([*getattr(axes, "of_panels", []), title])))
    if len(axes.of_panels) > 1:
        axes.set_title(", ".join(axes.of_panels), fontsize=9, color=INK)
        axes.set_ylabel(", ".join(dict.fromkeys([*unit.split(", "), axes.get_ylabel()])))


def _tell_apart(title: str, axes: "Axes", before: set[Any]) -> None:
    """Lines of one name from two panels, as x of two vectors, are called by both: "L x"."""
    for line in axes.get_lines():
        if line not in before:
            setattr(line, "of_panel", (title, str(line.get_label())))
    known = [(line, *of) for line in axes.get_lines() if (of := getattr(line, "of_panel", None)) and not of[1].startswith("_")]
    for line, own, name in known:
        if any(other != own and same == name for _, other, same in known):
            line.set_label(f"{own} {name}")


def _call(label: str, lines: list[Any]) -> None:
    """A residual is called by its line alone: guides and limit are of all runs."""
    own = [a for a in lines if hasattr(a, "of_run")] or lines
    for line in own:
        line.set_label(label if len(own) == 1 else f"{label}: {line.get_label()}")
    for band in (a for a in lines if hasattr(a, "of_band")):
        band.set_label("_band")


def _histogram(ax: "Axes", title: str, unit: str, y: np.ndarray, passed: np.ndarray, log: bool, limits: dict[str, float]) -> None:
    """Of the cases that passed, and upon them of the others; a dotted line where a limit is, which the axis reaches unless the bars would be
    lost beside it."""
    _style(ax, title, "cases")
    ax.set_xlabel("1" if unit == "" else unit, fontsize=8, color=SOFT)
    keep = np.isfinite(y) & ((y > 0) | (not log))
    if not keep.any():
        ax.text(0.5, 0.5, "exactly 0 in every case" if np.isfinite(y).any() else "in no case", transform=ax.transAxes, ha="center", va="center", fontsize=8, color=SOFT)
        return
    low, high = y[keep].min(), y[keep].max()
    if is_same(low, high):
        ax.text(0.5, 0.5, f"in every case: {low:.3g}{'' if unit in ('', '1') else ' ' + unit}", transform=ax.transAxes, ha="center", va="center", fontsize=8, color=SOFT)
        return
    edges = np.geomspace(low, high * (1 + 1e-12), 49) if log else np.linspace(low, high, 49)
    ax.hist([y[keep & passed], y[keep & ~passed]], bins=edges, stacked=True, color=[LINES[0], ALARM], label=["passed", "not passed"])
    if log:
        ax.set_xscale("log")
    place = np.log10 if log else np.asarray
    span, drawn = place(high) - place(low), False
    for name, limit in limits.items():
        text = f"{name}{': ' if name else ''}limit {limit:.3g}"
        if log and limit <= 0 or not place(low) - 6 * span < place(limit) < place(high) + 6 * span:
            ax.plot([], [], color=INK, linestyle=":", label=f"{text}, far away")
        else:
            ax.axvline(limit, color=INK, linestyle=":", linewidth=1.4, label=text)
        drawn = True
    if drawn or (keep & ~passed).any():
        _legend(ax)


def _ensemble(e: EnsembleResult, what: str | None, axes: "Axes | None") -> "Figure":
    """Histograms over the cases: of the errors, of what requirements limit and of the outputs at the end, or of one number by its name."""
    limits = e.summary.get("limits", {})
    errors = {k: (k.replace("_", " "), "relative", e[k], True, {"": limits[k]} if k in limits else {}) for k in e.summary if k.endswith("_error")}
    required: dict[str, Any] = {}
    for check, w in e.summary.get("requirements", {}).items():
        if "limit" in w:  # not in results of earlier versions
            key = f"{w['is']} {w['output']}"
            required.setdefault(key, (f"{key} at the records", w["unit"], e.outputs(w["is"])[w["output"]], False, {}))[4][check] = w["limit"]
    known = {**errors, **required, **{k: (k, e.unit(k), v, False, {}) for k, v in e.outputs().items()}}
    first = list(known)
    known.update({k: (k, e.unit(k) or "as in the scene", v, False, {}) for k, v in e.inputs.items()})
    known.update({k: (k, "s", v, False, {}) for k, v in e.events.items()})
    if what is not None and what not in known:
        raise InvalidArgument(f"what is '{what}', expected one of {', '.join(known)}")
    names, passed = first if what is None else [what], e["passed"] == 1

    def is_one(y: np.ndarray) -> bool:
        return len(y := y[np.isfinite(y)]) > 0 and is_same(y.min(), y.max())

    same = {n: f"{known[n][0]} {np.nanmin(known[n][2]):.3g}{'' if known[n][1] in ('', '1', 'relative') else ' ' + known[n][1]}" for n in names if what is None and is_one(known[n][2])}
    if len(same) < len(names):  # what is one number in every case is no picture
        names = [n for n in names if n not in same]
    same.update({n: f"{n} at {t[0]:.3g} s" for n, t in e.events.items() if what is None and np.isfinite(t).all() and is_one(t)})
    if axes is not None:
        title, unit, y, log, limit = known[names[0]]
        _histogram(axes, title, unit, y, passed, log, limit)
        return axes.figure
    from matplotlib.figure import Figure

    across = min(3, len(names))
    down = -(-len(names) // across)
    figure = Figure(figsize=(1.2 + 3.6 * across, 2.4 * down + 0.6), layout="constrained")
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for ax, name in zip(grid, names):
        title, unit, y, log, limit = known[name]
        _histogram(ax, title, unit, y, passed, log, limit)
    for ax in grid[len(names):]:
        ax.set_visible(False)
    s = e.summary
    constant = textwrap.fill(f"in every case: {', '.join(same.values())}", int(11 * figure.get_figwidth())) if same else ""
    figure.suptitle("\n".join([f"{s['title'] or 'ensemble'}    {s['passed']} of {s['cases']} cases passed", *constant.splitlines()]), x=0.01, ha="left", fontsize=11, color=INK)
    return figure


MARKS = "o^Dvs<>*"


def _comparison(c: Comparison, axes: "Axes | None") -> "Figure":
    """Error against CPU time, a line for each method: of more than sixteen those that no other beats in both and the reference solvers have a
    colour each, the others are thin."""
    lines, content = c.lines(), c.content
    if axes is None:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9, 5.6), layout="constrained")
        axes = figure.subplots()
        figure.suptitle(f"{content['title'] or 'comparison'}    {content['duration_s']:g} s simulated", x=0.01, ha="left", fontsize=11, color=INK)
    _style(axes, "largest relative energy error" if content["error"] == "energy" else f"error of the trajectory at {content['trajectory']['time_s']:g} s", "1")
    axes.set_xlabel("CPU time of one core [s]", fontsize=8, color=SOFT)
    points = sorted((x, y, name) for name, (xs, ys) in lines.items() for x, y in zip(xs, ys))
    best = {name for k, (_, y, name) in enumerate(points) if all(y < other for _, other, _ in points[:k])}
    rivals = {r["method"] for r in content["runs"] if r["rival"]}
    named = [n for n in lines if len(lines) <= 16 or n in best or n in rivals]
    for name in [n for n in lines if n not in named]:
        axes.plot(*lines[name], color=GUIDE, linewidth=0.6, alpha=0.6, label="_thin")
    if thin := len(lines) - len(named):
        axes.plot([], [], color=GUIDE, linewidth=0.6, label=f"{thin} others")
    for k, name in enumerate(named):
        fill = {"markerfacecolor": "white"} if name in rivals else {}
        axes.plot(*lines[name], color=LINES[k % 8], linestyle=DASHES[(k // 8) % 8] if name not in rivals else "--", marker=MARKS[(k + k // 8) % 8], markersize=4, linewidth=1.2, label=name, **fill)
    target = content["advice"]["target"]
    if points and 1e-3 * min(y for _, y, _ in points) < target < 1e3 * max(y for _, y, _ in points):
        axes.axhline(target, color=ALARM, linestyle=":", linewidth=1.2, label=f"target {target:.3g}")
    axes.set(xscale="log", yscale="log")
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize=7, labelcolor=INK, frameon=False, handlelength=3)
    return axes.figure


def plot(result: Result | EnsembleResult | Comparison | PathLike, path: PathLike | None = None, what: str | None = None, axes: "Axes | None" = None, label: str | None = None, legend: bool = True) -> Any:
    """Draws a result, an ensemble or a comparison, or the one in a folder. path: a .png, .svg or .pdf file; None: plot.png in the folder of the run, or for a
    run in memory the Figure alone, which is returned in any case. Phases of a scene with events have a picture each, but for their
    motion, which is in one. Of an ensemble: histograms over its cases, what: one number by its name; those that are the same in every case are named
    in the title. Of a comparison: error against CPU time of each method, in axes of yours too.

    what: "motion", "states" or one panel, see panel(); then a file is written only if path names one. axes: matplotlib axes to draw it in, where
    several runs may be, each by its label. legend=False: without the names of lines. The title is the ordinary one, which axes.set_title("mine")
    replaces.
    """
    if not isinstance(result, (Result, EnsembleResult, Comparison)):
        result = open_result(result)
    if isinstance(result, Comparison):
        if what is not None or label is not None or not legend:
            raise InvalidArgument("a comparison has one picture, expected neither what nor label nor legend")
        return _saved(_comparison(result, axes), path if path is not None or axes is not None or result.folder is None else result.folder / "plot.png")
    if what is None and axes is not None:
        raise InvalidArgument("axes are of one panel, expected what as well")
    if not legend and what is None:
        raise InvalidArgument("legend is of one panel, expected what as well")
    if label is not None and axes is None:
        raise InvalidArgument("label is of a run in axes of yours, expected axes as well")
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
        return [plot(p, None if path is None else Path(path).with_stem(f"{Path(path).stem}_{k}"), what, legend=legend) for k, p in enumerate(phases, 1)]
    if path is None and result.folder is not None and what is None:
        path = result.folder / "plot.png"
    figure = draw(phases[0]) if what is None else panel(result if of_motion else phases[0], what, axes, label, legend)
    return _saved(figure, path)


def _saved(figure: Any, path: PathLike | None) -> Any:
    if path is not None:
        if Path(path).suffix not in (".png", ".svg", ".pdf"):
            raise InvalidArgument(f"path is '{path}', expected a name that ends with .png, .svg or .pdf")
        figure.savefig(path, dpi=150)
    return figure
