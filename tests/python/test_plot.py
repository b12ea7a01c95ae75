"""Pictures by matplotlib."""
import io
import os
import re
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

import porthos as ph
from porthos.plotting import draw
from test_dynamics import refused

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def run(source, tmp_path_factory):
    return ph.Scene(source / "examples/ledger/scene.toml", duration=300).run(tmp_path_factory.mktemp("plot") / "run", progress=False)


def test_the_panels_of_a_run(run, tmp_path):
    figure = ph.plot(run, tmp_path / "a.svg")
    titles = [a.get_title() for a in figure.axes]
    assert titles[:3] == ["energies", "works", "residual"] and titles[3].startswith("error of the ")
    units = {"linear momentum": "kg m/s", "angular momentum": "kg m²/s", "quaternion norm": "relative"}
    assert all(a.get_ylabel() == units[a.get_title().removeprefix("error of the ").removesuffix(" (world axes)")] for a in figure.axes[3:])
    names = [t.get_text() for t in figure.axes[1].get_legend().get_texts()]
    balance = run.summary["balance"]
    assert names == [f"{n} (in)" for n in balance["ports"]] + [f"{n} (lost)" for n in balance["losses"]]
    assert "1" not in [a.get_ylabel() for a in figure.axes] and figure.axes[2].get_ylabel() == "relative"
    assert (tmp_path / "a.svg").stat().st_size > 20000
    refused(lambda: ph.plot(run, tmp_path / "a.gif"), "a.gif", ".png, .svg or .pdf")


def test_a_judged_file(tmp_path):
    """Lines have a gap where its rows are missing, and no place of the figure is empty. Control: all rows."""
    from test_plans import URDF

    model = tmp_path / "wheel.urdf"
    model.write_text(URDF)
    t = np.linspace(0, 4, 401)
    gaps = {}
    for missing in (0, 100):
        kept = (t <= 1) | (t > 1 + 0.01 * missing + 1e-9)
        result = ph.judge({"time": t[kept], "axle": 0.7 * t[kept], "v.axle": np.full(kept.sum(), 0.7)}, model, out=tmp_path / str(missing))
        x = ph.plot(result, what="axle").axes[0].get_lines()[0].get_xdata()
        gaps[missing] = [x[i - 1] for i in np.flatnonzero(np.isnan(x))]
        figure = ph.plot(result, tmp_path / "all.svg")
        assert [a.get_title() for a in figure.axes] == ["energies", "residual"]
        assert figure.axes[0].get_gridspec().get_geometry() == (1, 2)
    assert gaps[0] == [] and gaps[100] == pytest.approx([1.0])


def test_the_motion(run, source, tmp_path):
    figure = ph.plot(run, tmp_path / "motion.svg", what="motion")
    titles = [a.get_title() for a in figure.axes]
    assert {"rotation of base", "rates of base, own axes", "path of base", "velocity of base"} <= set(titles), titles
    assert (tmp_path / "motion.svg").stat().st_size > 20000
    from matplotlib.figure import Figure

    mine = Figure().subplots()
    which = "joints" if "joints" in titles else "turning joints"
    assert ph.plot(run, what=which, axes=mine) is mine.figure
    assert [t.get_text() for t in mine.get_legend().get_texts()] == list(run.motion()[f"{which} [rad]"])
    two = Figure().subplots()
    for name in ("first", "second"):
        ph.plot(run, what=next(iter(run.motion()["joints [rad]"])), axes=two, label=name)
    assert [t.get_text() for t in two.get_legend().get_texts()] == ["first", "second"]
    assert two.get_lines()[0].get_color() != two.get_lines()[1].get_color()
    refused(lambda: ph.plot(run, what="joints", label="first"), "expected axes as well")
    vectors = Figure().subplots()  # lines of one name have their panels' names before them, in whatever number
    ph.plot(run, what="path of base", axes=vectors)
    assert [t.get_text() for t in vectors.get_legend().get_texts()] == ["x", "y", "z"]
    for name in ("velocity of base", "rates of base"):
        ph.plot(run, what=name, axes=vectors)
    assert [t.get_text() for t in vectors.get_legend().get_texts()] == [f"{p} {k}" for p in ("path of base", "velocity of base", "rates of base, own axes") for k in "xyz"]
    # rates are the derivatives of positions: central differences of records 1 s apart, of a slow motion
    m = ph.Scene(source / "examples/ets_vii/scene.toml", duration=40).run(tmp_path / "slow", progress=False).motion()
    t = m["time [s]"]["t"]
    q, v = m["path of base [m]"]["x"], m["velocity of base [m/s]"]["x"]
    off = np.abs((q[2:] - q[:-2]) / (t[2:] - t[:-2]) - v[1:-1]).max()
    assert off < 0.05 * np.abs(v).max(), off  # measured 0.010
    refused(lambda: ph.plot(run, what="motions"), "what is 'motions', the nearest is 'motion', expected motion, energies", "rotation of base", most=280)
    begun, full = (ph.plot(run, what=w).axes[0] for w in ("rates of base", "rates of base, own axes"))
    assert begun.get_title(loc="left") + begun.get_ylabel() == full.get_title(loc="left") + full.get_ylabel()
    refused(lambda: ph.plot(run, what="rates"), "'rates of base, own axes'", most=280)
    refused(lambda: ph.plot(run, what=["joints"]), "what is ['joints'], expected the name of a panel")
    for key in list(run.motion())[:-1]:  # the keys of motion(), and each line by itself
        assert len(ph.plot(run, what=key).axes) == 1
    line = next(iter(run.motion()["joints [rad]"]))
    assert [k.get_label() for k in ph.plot(run, what=line).axes[0].get_lines()] == [line]
    refused(lambda: ph.plot(run, what="motion", axes=mine), "axes are of one panel")
    refused(lambda: ph.plot(run, axes=mine), "expected what as well")


def test_many_panels_stand_in_two_columns(run, pendulum, tmp_path):
    axes = ph.plot(run, tmp_path / "many.png", what="motion").axes
    left = [round(a.get_position().x0, 1) for a in axes]
    half = -(-len(axes) // 2)
    assert len(axes) == len(run.motion()) - 1 > 6  # but for the times
    assert set(left[:half]) == {min(left)} and set(left[half:]) == {max(left)} and max(left) > min(left), left
    model = ph.MechanicalModel(pendulum)
    r = ph.simulate(model, model.state([0.3, -0.2], [0.5, 0]), step=0.01, duration=2)
    few = ph.plot(r, tmp_path / "few.png", what="motion").axes  # the control
    assert len({round(a.get_position().x0, 1) for a in few}) == 1


def test_the_springs_of_actuators(source, tmp_path):
    r = ph.Scene(source / "examples/vsa_cycle/scene.toml", duration=2).run(tmp_path / "cycle", progress=False)
    m, a, k = r.motion(), 6.7328, 0.0222
    sigma = 0.3 * (1 - np.cos(m["time [s]"]["t"]))
    assert np.abs(m["stiffness settings [rad]"]["first"] - sigma).max() < 1e-13
    assert np.abs(m["stiffness of springs [N m/rad]"]["first"] - 2 * a * k * np.cosh(a * sigma)).max() < 1e-12
    phi, torque = m["deflections of springs [rad]"]["second"], m["torques of springs [N m]"]["second"]
    assert np.abs(torque + 2 * k * np.cosh(a * sigma) * np.sinh(a * phi)).max() < 1e-12 and np.abs(torque).max() > 0.05
    assert [name for name, _ in r.springs] == ["first", "second"] and r.springs[0][1].family == "cosh"
    axes = ph.plot(r, what="stiffness of springs").axes[0]
    assert axes.get_ylabel() == "N m/rad" and [t.get_text() for t in axes.get_legend().get_texts()] == ["first", "second"]
    refused(lambda: ph.plot(r, what="first"), "a line of several panels, expected one of: deflections of springs.first, stiffness settings.first", most=280)
    assert len(ph.plot(r, what="deflections of springs.first").axes) == 1


def test_the_states_of_a_network(pendulum, tmp_path):
    """A network has no mechanism: said in one sentence wherever its motion is asked for; its states are shown. Control: those of a mechanism."""
    model = pendulum if isinstance(pendulum, ph.MechanicalModel) else ph.MechanicalModel(pendulum)
    names = [c.name for c in model.mechanism.coordinates]
    start = model.state(0.3 * np.ones(len(names)), 9 * np.ones(len(names)))
    net = ph.Network("net").add("arm", model).build()
    here = ph.simulate(net, start, step=0.01, duration=2)
    there = ph.simulate(net, start, step=0.01, duration=2, out=tmp_path / "net", progress=False)
    for run in (here, there, ph.open(tmp_path / "net")):
        for ask in (run.motion, lambda: ph.plot(run, what="motion")):
            refused(ask, "has no mechanism whose motion could be shown, expected a scene or a MechanicalModel; what = \"states\"")
        refused(lambda: ph.plot(run, what="joints"), "expected states, energies", "(the run has no mechanism)")
        assert [a.get_title() for a in ph.plot(run, what="states").axes] == ["states", "momenta"]
        line = ph.plot(run, what=names[0]).axes[0].get_lines()
        assert [k.get_label() for k in line] == [names[0]]
        for key in list(run.states())[:-1]:
            assert len(ph.plot(run, what=key).axes) == 1
    mine, known = here.states()["states [rad]"], ph.simulate(model, start, step=0.01, duration=2).motion()
    panel = "joints [rad]" if "joints [rad]" in known else "turning joints [rad]"
    off = max(np.abs(mine[n] - known[panel][n]).max() for n in known[panel])
    assert off < 1e-13 and max(np.abs(y).max() for y in mine.values()) > 3.2, off  # more than half a turn
    for n in mine:
        assert np.array_equal(mine[n], there.states()["states [rad]"][n])


def test_the_motion_of_a_run_in_memory(pendulum):
    model = ph.MechanicalModel(pendulum)
    r = ph.simulate(model, model.state([0.3, -0.2], [0.5, 0]), step=0.01, duration=2)
    m = r.motion()
    assert list(m) == ["joints [rad]", "rates of joints [rad/s]", "time [s]"]
    rates = m["rates of joints [rad/s]"]
    assert abs(rates["upper"][0] - 0.5) < 1e-14 and abs(rates["lower"][0]) < 1e-14
    t, q = m["time [s]"]["t"], m["joints [rad]"]["lower"]
    assert np.abs(np.gradient(q, t)[1:-1] - rates["lower"][1:-1]).max() < 1e-3 * np.abs(rates["lower"]).max()
    assert "pass" in r._repr_html_() or "not judged" in r._repr_html_()


def test_the_command(run, tmp_path):
    code = subprocess.run([sys.executable, "-m", "porthos", "plot", str(run.folder)], env=os.environ, capture_output=True, text=True)
    assert code.returncode == 0, code.stderr
    assert (run.folder / "plot.png").read_bytes()[:4] == b"\x89PNG"
    code = subprocess.run([sys.executable, "-m", "porthos", "plot", str(tmp_path)], env=os.environ, capture_output=True, text=True)
    assert code.returncode == 2 and "no summary.json" in code.stderr and "Traceback" not in code.stderr


def test_every_peak_of_a_million_records_stays():
    from porthos._core import residual_panel
    from porthos.plotting import thinned

    n = 1_000_000
    t = np.arange(n) * 0.1
    y = np.full(n, 1e-16)
    peaks = [5, 1234, 77777, 999_998]
    y[peaks] = -1e-12
    start = time.perf_counter()
    band, rms, guide, limit = residual_panel(t, y, 1e-10)
    spent = time.perf_counter() - start
    high, low = band[3], band[4]
    assert len(band[2]) <= 1500 and (high == 1e-12).sum() == len(peaks) and low.min() == 1e-16 and spent < 2, spent
    assert [part[:2] for part in (rms, guide, limit)] == [("rms so far", "line"), ("∝ √t (random walk)", "guide"), ("limit 10⁻¹⁰", "limit")]
    assert abs(rms[3][-1] / np.sqrt((y**2).mean()) - 1) < 1e-9 and guide[3][-1] == rms[3][-1]
    assert len(thinned(t)) <= 3000 and thinned(t)[-1] == n - 1


def test_nothing_covers_the_data(run, source, tmp_path):
    for figure in (ph.plot(run), ph.plot(run, what="motion")):
        figure.canvas.draw()
        for ax in figure.axes:
            legend = ax.get_legend().get_window_extent()
            assert not legend.overlaps(ax.get_window_extent()) or legend.y0 >= ax.get_window_extent().y1 - 1, ax.get_title()
    # without sources and losses there is no panel for them
    free = ph.Scene(source / "examples/ets_vii/scene.toml", duration=5).run(tmp_path / "free", progress=False)
    assert [a.get_title() for a in ph.plot(free).axes][:2] == ["energies", "residual"]
    refused(lambda: ph.plot(free, what="works"), "no panel 'works'", "nothing is supplied or lost")


def test_lines_that_are_zero_are_counted(run, monkeypatch):
    t = np.linspace(0, 1, 5)
    for idle, names in ((7, ["moves", "7 others: 0"]), (2, ["moves", "still_0", "still_1"])):
        lines = {"moves": t, **{f"still_{k}": 0 * t for k in range(idle)}}
        monkeypatch.setattr(type(run), "motion", lambda self, bands: {"joints [rad]": lines, "time [s]": {"t": t}})
        assert [k.get_text() for k in ph.plot(run, what="joints").axes[0].get_legend().get_texts()] == names


def test_a_line_that_covers_an_area_has_no_dashes(run, monkeypatch):
    t = np.linspace(0, 1, 1501)
    lines = {"slow": t, "fast": np.cos(np.pi * np.arange(1501)), "control": np.sin(40 * t)}
    monkeypatch.setattr(type(run), "motion", lambda self, bands: {"joints [rad]": lines, "time [s]": {"t": t}})
    styles = [k.get_linestyle() for k in ph.plot(run, what="joints").axes[0].get_lines()]
    assert [k == "-" for k in styles[:3]] == [True, True, False], styles


def test_the_command_draws_the_same_panels(run, tmp_path):
    """`porthos plot --what` knows the names of porthos.plot(what=...), and shows the same lines."""
    motion = run.motion()
    motion.pop("time [s]")
    program = os.environ["PORTHOS_CLI"]
    for what, names in [("energies", list(run.summary["balance"]["storages"])), *((k, list(v)) for k, v in motion.items())]:
        svg = tmp_path / "panel.svg"
        done = subprocess.run([program, "plot", run.folder, "--what", what, "--out", svg], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        texts = re.findall("<text[^>]*>([^<]*)</text>", svg.read_text(encoding="utf-8"))
        assert [t for t in texts if t in names] == names, (what, names, texts)
        assert [t.get_text() for t in ph.plot(run, what=what).axes[0].get_legend().get_texts()] == names
        svg.unlink()
    done = subprocess.run([program, "plot", run.folder, "--what", "rates of joinst"], capture_output=True, text=True)
    assert done.returncode == 2 and "the nearest is 'rates of joints'" in done.stderr
    refused(lambda: ph.plot(run, what="rates of joinst"), "the nearest is 'rates of joints'", most=280)


def test_a_row_of_the_ledger_is_a_line(run, tmp_path):
    """As the command has it. Control: other numbers are none of the row."""
    name = next(iter(run.group("stored")))
    axes = ph.plot(run, what=name).axes[0]
    (line,) = (k for k in axes.get_lines() if len(k.get_xdata()) > 2)
    assert axes.get_ylabel() == "J" and np.isin(line.get_ydata(), run[f"stored/{name}"]).all()
    assert not np.isin(line.get_ydata(), 2 * run[f"stored/{name}"] + 1).any()
    done = subprocess.run([os.environ["PORTHOS_CLI"], "plot", run.folder, "--what", name, "--out", tmp_path / "one.svg"], capture_output=True, text=True)
    assert done.returncode == 0 and f">{name} [J]<" in (tmp_path / "one.svg").read_text(encoding="utf-8"), done.stderr


def test_a_line_of_several_panels_is_named_with_its_panel(run, monkeypatch, tmp_path):
    t = np.linspace(0, 1, 5)
    panels = {"tip [m]": {"x": t, "y": -t}, "bus [m]": {"x": 2 * t}, "time [s]": {"t": t}}
    monkeypatch.setattr(type(run), "motion", lambda self, bands: {k: dict(v) for k, v in panels.items()})
    (line,) = [k for k in ph.plot(run, what="bus.x").axes[0].get_lines() if len(k.get_xdata()) == 5]
    assert np.array_equal(line.get_ydata(), 2 * t)
    assert ph.plot(run, what="y").axes[0].get_title() == "y"
    refused(lambda: ph.plot(run, what="x"), "a line of several panels, expected one of: tip.x, bus.x")
    monkeypatch.undo()
    name = next(k for k in run.motion() if k.startswith("rates of"))
    full = name.split(" [")[0] + "." + next(iter(run.motion()[name]))
    done = subprocess.run([os.environ["PORTHOS_CLI"], "plot", run.folder, "--what", full, "--out", tmp_path / "one.svg"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_one_palette(source):
    """The lines of matplotlib, of the SVG files and of the page have the same colours."""
    from porthos.plotting import LINES

    css = (source / "report/web/src/style.css").read_text().split("}")[0]
    assert re.findall(r"--c\d: (#\w+);", css) == LINES == ph._core.line_colours()


def test_outputs_have_a_panel_for_each_unit(run, monkeypatch):
    t = np.linspace(0, 1, 5)
    monkeypatch.setattr(type(run), "motion", lambda self, bands: {"outputs [rad]": {"a": t}, "com [m]": {"x": t}, "outputs [m]": {"b": t}, "time [s]": {"t": t}})
    axes = ph.plot(run, what="motion").axes
    assert [(a.get_title(), a.get_ylabel()) for a in axes] == [("outputs", "rad"), ("com", "m"), ("outputs", "m")]
    for what, line in (("outputs [rad]", "a"), ("outputs [m]", "b")):
        assert [k.get_label() for k in ph.plot(run, what=what).axes[0].get_lines()] == [line]
    refused(lambda: ph.plot(run, what="outputs"), "what is 'outputs', the name of several panels, expected one of: outputs [rad], outputs [m]")
    refused(lambda: ph.plot(run, what="speed"), "expected motion, energies, works, residual, outputs [rad], com, outputs [m] or a line")


def keeps(what, measured, bound):
    print(f"  {what:58} {measured:.3g}   bound {bound:.3g}")
    assert measured <= bound, (what, measured)


def breaks(what, measured, bound):
    print(f"  {what:58} {measured:.3g}   control, must exceed {bound:.3g}")
    assert measured > bound, (what, measured)


def of_motion(monkeypatch, run, **panels):
    """The run as if it had moved so: lines by the titles of panels, over 0 ... 20 s."""
    t = np.linspace(0, 20, 201)
    lines = {k.replace("_", " "): {n: f(t) for n, f in v.items()} for k, v in panels.items()}
    monkeypatch.setattr(type(run), "motion", lambda self, bands: {**{k: dict(v) for k, v in lines.items()}, "time [s]": {"t": t}})
    return t


def test_a_panel_tells_joints_that_are_in_another(run, monkeypatch):
    def title(what, turning):
        of_motion(monkeypatch, run, **{"joints [rad]": {"elbow": np.sin}, "rates of joints [rad/s]": {"elbow": np.cos},
                                       **({"turning joints [rad]": {k: np.exp for k in turning}, "rates of turning joints [rad/s]": {k: np.exp for k in turning}} if turning else {})})
        return ph.plot(run, what=what).axes[0].get_title()

    assert title("joints", ["a", "b"]) == "joints (2 others are in 'turning joints')"
    assert title("rates of joints", ["a"]) == "rates of joints (1 other is in 'rates of turning joints')"
    assert title("turning joints", ["a"]) == "turning joints" and title("joints", []) == "joints"  # controls


def outside(figure, what):
    """By how much a thing reaches over the edge of its figure [pt]."""
    box, whole = what.get_window_extent(), figure.bbox
    return 72 / figure.dpi * max(whole.x0 - box.x0, whole.y0 - box.y0, box.x1 - whole.x1, box.y1 - whole.y1)


def test_many_lines_fit_small_axes_of_the_user(run, monkeypatch):
    from matplotlib.figure import Figure

    def drawn(letters, layout, size=(3.4, 2.4), **more):
        of_motion(monkeypatch, run, **{"joints [rad]": {f"{k:x}" * letters: np.sin for k in range(12)}})
        axes = Figure(figsize=size, layout=layout).subplots()
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # as "constrained_layout not applied because axes sizes collapsed to zero"
            ph.plot(run, what="joints", axes=axes, **more)
            axes.figure.savefig(io.BytesIO())
        return axes

    for layout, size in (("constrained", (3.4, 2.4)), (None, (6, 3))):
        axes = drawn(17, layout, size)
        keeps(f"legend over the edge of a figure of layout {layout} [pt]", outside(axes.figure, axes.get_legend()), 0.5)
        if layout:
            keeps("name of the axis of time over the edge [pt]", outside(axes.figure, axes.xaxis.label), 0.5)
            keeps("height of the figure over that of its axes", axes.figure.bbox.height / axes.bbox.height, 5)
            keeps("axes over the foot of the legend [pt]", 72 / axes.figure.dpi * (axes.bbox.y1 - axes.get_legend().get_window_extent().y0), 0)
    assert drawn(80, "constrained", legend=False).get_legend() is None
    with pytest.raises(UserWarning, match="the names of 12 lines do not fit above these axes, expected larger axes, or legend=False"):
        drawn(80, "constrained")  # control
    refused(lambda: ph.plot(run, legend=False), "legend is of one panel, expected what as well")


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_a_legend_within_axes_of_the_user_covers_no_curve(run, monkeypatch, scale):
    from matplotlib.figure import Figure

    of_motion(monkeypatch, run, **{"works [J]": {f"shoulder_{k}.hold (lost)": lambda t, k=k: 2 + np.sin((k + 1) * t) for k in range(14)}})
    axes = Figure(figsize=(6.4, 4.8)).subplots()
    axes.set_yscale(scale)

    def covered():
        axes.figure.savefig(io.BytesIO())
        legend = axes.get_legend().get_window_extent()
        return max(axes.transData.transform(np.column_stack([line.get_xdata(), line.get_ydata()]))[:, 1].max() for line in axes.get_lines()) - legend.y0, legend.y1 - axes.bbox.y1

    for label in (None, "second"):  # which makes room anew
        ph.plot(run, what="works", axes=axes, label=label)
        over, above = covered()
        keeps("curves over the foot of the legend [px]", over, 0)
        keeps("legend over the top of the axes [px]", above, 0)
    axes.autoscale(axis="y")
    breaks("the same without the room", covered()[0], 0)
    axes.set_ylim(1, 4)
    ph.plot(run, what="works", axes=axes)
    assert axes.get_ylim() == (1, 4)  # limits of the user's own stay


def test_what_is_kept_exactly_is_named(run, monkeypatch):
    """As the page names it; what no check judges is not."""
    one, zero = np.full((len(run.time), 3), 1e-9), np.zeros((len(run.time), 3))
    checks = [{"name": n, "value": 0.0, "limit": 1e-9, "pass": True} for n in ("linear_momentum", "quaternion_norm")]
    read = type(run).__getitem__
    errors = {"linear_momentum_error": zero, "angular_momentum_error": one, "quaternion_norm_error": zero[:, 0]}
    monkeypatch.setattr(type(run), "__getitem__", lambda self, name: errors[name] if name in errors else read(self, name))
    for judged in (checks, checks[:1], []):
        monkeypatch.setitem(run.summary, "checks", judged)
        axes = draw(run).axes[3:]
        assert [a.get_title() for a in axes] == ["error of the angular momentum (world axes)"]
        told = [t.get_text() for t in axes[0].get_legend().get_texts() if "exactly" in t.get_text()]
        assert told == [f"{c['name'].replace('_', ' ')}: 0 at every record, kept exactly" for c in judged]


def test_several_runs_and_several_outputs_in_one_axes(run, monkeypatch):
    from matplotlib.figure import Figure

    axes = Figure(figsize=(7, 4), layout="constrained").subplots()
    ph.plot(run, what="residual", axes=axes, label="first")
    alone = [t.get_text() for t in axes.get_legend().get_texts()]
    for name in ("second", "third"):
        ph.plot(run, what="residual", axes=axes, label=name)
    assert alone[0] == "first" and any("√t" in n or "∝ t" in n for n in alone)  # guides, and a limit if there is one
    assert [t.get_text() for t in axes.get_legend().get_texts()] == [*alone, "second", "third"]
    named = {n: line for line, n in zip(*axes.get_legend_handles_labels())}
    assert len({named[n].get_color() for n in ("first", "second", "third")}) == 3
    of_motion(monkeypatch, run, **{"tip [m]": {"x": np.sin}, "motor [N m]": {"y": np.cos}})
    axes = Figure().subplots()
    said = []
    for what in ("tip", "motor", "tip"):
        ph.plot(run, what=what, axes=axes)
        said.append((axes.get_title(), axes.get_ylabel()))
    assert said == [("tip", "m"), *[("tip, motor", "m, N m")] * 2]


def test_a_title_of_the_user_replaces_ours(run, monkeypatch):
    from matplotlib.figure import Figure

    of_motion(monkeypatch, run, **{"tip [m]": {"x": np.sin, "y": np.cos}})
    for mine in ("mine", ""):
        axes = Figure(figsize=(3.4, 2.4), layout="constrained").subplots()
        ph.plot(run, what="tip", axes=axes)
        assert axes.get_title() == "tip"
        axes.set_title(mine)
        axes.figure.savefig(io.BytesIO())
        assert [axes.get_title(loc=k) for k in ("left", "center", "right")] == ["", mine, ""]
        if mine:
            keeps("title over the foot of the legend [pt]", 72 / axes.figure.dpi * (axes.title.get_window_extent().y1 - axes.get_legend().get_window_extent().y0), 0)
            axes.set_title(mine, fontsize=24)
            breaks("one of 24 pt", 72 / axes.figure.dpi * (axes.title.get_window_extent().y1 - axes.get_legend().get_window_extent().y0), 0)


def test_axes_of_three_dimensions_show_a_path(run, monkeypatch):
    from matplotlib.figure import Figure

    t = of_motion(monkeypatch, run, **{"hand [m]": {"x": np.sin, "y": np.cos, "z": np.sqrt}, "speed [m/s]": {"x": np.sin, "y": np.cos, "z": np.sqrt}})
    axes = Figure().add_subplot(projection="3d")
    ph.plot(run, what="hand", axes=axes, label="first")
    (line,) = axes.get_lines()
    assert all(np.array_equal(a, f(t)) for a, f in zip(line.get_data_3d(), (np.sin, np.cos, np.sqrt)))
    assert [axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel(), line.get_label()] == ["x [m]", "y [m]", "z [m]", "first"]
    for what in ("speed", "hand.x", "energies", "residual"):
        refused(lambda: ph.plot(run, what=what, axes=axes), f"the axes are of three dimensions and '{what}' is no place x, y, z in metres, expected axes as of Figure().subplots()")
    assert len(axes.get_lines()) == 1


def test_what_is_held_is_drawn_as_stairs(run, monkeypatch):
    """Control: smooth lines, and one that rests before it moves."""
    lines = {"held": lambda t: np.sin(np.floor(2 * t + 1e-9)), "smooth": np.sin, "rests": lambda t: np.sin(np.maximum(t - 10, 0))}
    of_motion(monkeypatch, run, **{"torques [N m]": lines})
    drawn = ph.plot(run, what="torques").axes[0].get_lines()
    assert [line.get_drawstyle() for line in drawn] == ["steps-post", "default", "default"]


def test_angles_that_jump_have_gaps(run, monkeypatch):
    wrapped = lambda t: np.angle(np.exp(1j * t))  # noqa: E731, jumps at pi, 3 pi and 5 pi
    of_motion(monkeypatch, run, **{"attitude [rad]": {"z": wrapped, "turned": lambda t: 2 * wrapped(t)}, "place [m]": {"z": wrapped}})

    def longest(what, line):
        y = ph.plot(run, what=what).axes[0].get_lines()[line].get_ydata()
        return np.nanmax(np.abs(np.diff(y))), np.isnan(y).sum()

    step, gaps = longest("attitude", 0)
    assert gaps == 3
    keeps("largest step of an angle that jumps [rad]", step, 0.11)
    for what, line in (("attitude", 1), ("place", 0)):
        step, gaps = longest(what, line)
        assert gaps == 0
        breaks(f"of {what}, line {line}, which has no gaps", step, np.pi)
