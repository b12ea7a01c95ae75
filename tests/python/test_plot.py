"""Pictures by matplotlib."""
import os
import subprocess
import sys
import time

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def run(source, tmp_path_factory):
    return ph.Scene(source / "examples/ledger/scene.toml", duration=300).run(tmp_path_factory.mktemp("plot") / "run", progress=False)


def test_four_panels(run, tmp_path):
    figure = ph.plot(run, tmp_path / "a.svg")
    titles = [a.get_title(loc="left") for a in figure.axes]
    assert len(titles) == 4 and "stored" in titles[0] and "works" in titles[1] and "residual" in titles[2] and "momentum" in titles[3]
    names = [t.get_text() for t in figure.axes[1].get_legend().get_texts()]
    assert names == list(run.group("supplied")) + list(run.group("dissipated"))
    assert (tmp_path / "a.svg").stat().st_size > 20000
    refused(lambda: ph.plot(run, tmp_path / "a.gif"), "a.gif", ".png, .svg or .pdf")


def test_the_motion(run, source, tmp_path):
    figure = ph.plot(run, tmp_path / "motion.svg", what="motion")
    titles = [a.get_title(loc="left") for a in figure.axes]
    assert {"rotation of base", "rates of base, own axes", "path of base", "velocity of base"} <= set(titles), titles
    assert (tmp_path / "motion.svg").stat().st_size > 20000
    from matplotlib.figure import Figure

    mine = Figure().subplots()
    which = "joints" if "joints" in titles else "turning joints"
    assert ph.plot(run, what=which, axes=mine) is mine.figure
    assert [t.get_text() for t in mine.get_legend().get_texts()] == list(run.motion()[f"{which} [rad]"])
    # rates are the derivatives of positions: central differences of records 1 s apart, of a slow motion
    m = ph.Scene(source / "examples/ets_vii/scene.toml", duration=40).run(tmp_path / "slow", progress=False).motion()
    t = m["time [s]"]["t"]
    q, v = m["path of base [m]"]["x"], m["velocity of base [m/s]"]["x"]
    off = np.abs((q[2:] - q[:-2]) / (t[2:] - t[:-2]) - v[1:-1]).max()
    assert off < 0.05 * np.abs(v).max(), off  # measured 0.010
    refused(lambda: ph.plot(run, what="motions"), "what is 'motions', expected motion, energies", "rotation of base")
    refused(lambda: ph.plot(run, what=["joints"]), "what is ['joints'], expected the name of a panel")
    for key in list(run.motion())[:-1]:  # the keys of motion(), and each line by itself
        assert len(ph.plot(run, what=key).axes) == 1
    line = next(iter(run.motion()["joints [rad]"]))
    assert [k.get_label() for k in ph.plot(run, what=line).axes[0].get_lines()] == [line]
    refused(lambda: ph.plot(run, what="motion", axes=mine), "axes are of one panel")
    refused(lambda: ph.plot(run, axes=mine), "expected what as well")


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
    from porthos.plotting import envelope, thinned

    n = 1_000_000
    t = np.arange(n) * 0.1
    y = np.full(n, 1e-16)
    peaks = [5, 1234, 77777, 999_998]
    y[peaks] = -1e-12
    start = time.perf_counter()
    at, low, high = envelope(t, y)
    spent = time.perf_counter() - start
    assert len(at) <= 1200 and (high == 1e-12).sum() == len(peaks) and low.min() == 1e-16 and spent < 1
    assert len(thinned(t)) <= 3000 and thinned(t)[-1] == n - 1


def test_outputs_have_a_panel_for_each_unit(run, monkeypatch):
    t = np.linspace(0, 1, 5)
    monkeypatch.setattr(type(run), "motion", lambda self: {"outputs [rad]": {"a": t}, "com [m]": {"x": t}, "outputs [m]": {"b": t}, "time [s]": {"t": t}})
    axes = ph.plot(run, what="motion").axes
    assert [(a.get_title(loc="left"), a.get_ylabel()) for a in axes] == [("outputs", "rad"), ("com", "m"), ("outputs", "m")]
    for what, line in (("outputs [rad]", "a"), ("outputs", "a"), ("outputs [m]", "b")):
        assert [k.get_label() for k in ph.plot(run, what=what).axes[0].get_lines()] == [line]
