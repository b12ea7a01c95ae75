"""Runs, results, Ctrl-C and what the Python side costs."""
import io
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused


@pytest.fixture(scope="module")
def short_run(source, tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "ets"
    return ph.Scene(source / "examples/ets_vii/scene.toml", duration=200).run(out, progress=False)


def test_a_scene_runs_and_its_folder_opens(short_run):
    r = short_run
    assert r.passed and r.verdict == "pass" and bool(r), str(r)
    assert "verdict  pass" in str(r) and "energy" in str(r)
    again = ph.open(r.folder)
    assert again.summary == r.summary == json.loads((r.folder / "summary.json").read_text())
    assert np.array_equal(again["energy_error"], r["energy_error"]) and again.unit("energy_error") == "J"
    assert r.time[-1] == 200 and r["state/base.attitude"].shape == (len(r.time), 4) and r["step"].dtype == np.int64
    assert "provenance/scene" not in r.names and len(r) == len(list(r))
    with pytest.raises(KeyError, match="energy_eror.*energy_error"):
        r["energy_eror"]


def test_a_run_that_failed_is_false_though_it_has_series(pendulum):
    model = ph.MechanicalModel(pendulum)
    kw = dict(step=0.01, duration=1, progress=False)
    failed = ph.simulate(model, model.state([2.0, 0.5], [0, 0]), method="rk4", limits={"energy": 1e-14}, **kw)
    assert not failed.passed and not bool(failed) and len(failed) > 5
    assert ph.simulate(model, model.state([2.0, 0.5], [0, 0]), limits={"energy": 1e-12}, **kw)  # control


def test_flat_states_of_a_folder_are_refused_with_the_way_to_them(short_run):
    refused(lambda: short_run.x, "run.h5 has the state by names", "result['state/elbow'][-1]", "[initial] from", most=400)


def test_a_momentum_that_is_no_invariant_has_no_series(pendulum, short_run):
    model = ph.MechanicalModel(pendulum)
    fixed = ph.simulate(model, model.state([2.0, 0.5], [0, 0]), step=0.01, duration=1, progress=False)
    assert "energy_error" in fixed.names and not any("momentum_error" in n for n in fixed.names)
    assert "angular_momentum_error" in short_run.names  # control: it floats


def test_the_series_are_those_h5py_reads(short_run):
    h5py = pytest.importorskip("h5py")
    with h5py.File(short_run.folder / "run.h5") as f:
        for name in short_run.names:
            assert np.array_equal(short_run[name], f[name][...]), name
        title = f.attrs["title"]
        assert short_run.file.attributes()["title"] == (title.decode() if isinstance(title, bytes) else title)


def test_in_memory_and_in_a_folder_are_the_same_run(pendulum, tmp_path):
    model = ph.MechanicalModel(pendulum)
    x = model.state([2.0, 0.5], [0, 0])
    kw = dict(step=0.01, duration=3, record_every=0.05, limits={"energy": 1e-12})
    here, there = ph.simulate(model, x, **kw), ph.simulate(model, x, out=tmp_path / "run", **kw)
    assert here.passed and there.passed
    assert set(here.names) == set(there.names)
    for name in here.names:
        assert np.array_equal(here[name], there[name]), name
        assert here.unit(name) == there.unit(name)
    assert here["state/upper"].base is not None  # a view, of the one array of records
    for key in ("checks", "energy", "balance", "final_state", "records", "steps"):
        assert here.summary[key] == there.summary[key], key
    assert here.x.shape == (61, 4)


def test_verify_and_compare(pendulum):
    model = ph.MechanicalModel(pendulum)
    x = model.state([1.0, 0.5], [0, 0])
    r = ph.verify(model, x, step=0.01, duration=1)
    assert r.passed and {"symmetry", "axiom: J skew"} <= {c["name"] for c in r.checks}
    bad = ph.simulate(model, x, step=0.05, duration=10, method="rk4", limits={"energy": 1e-12})
    assert not bad.passed and bad.verdict == "fail" and "FAIL" in str(bad)  # negative control
    none = ph.simulate(model, model.state([1.0, 0.5], [0, 1e30]), step=0.01, duration=1)
    assert none.verdict == "fail" and none.summary["steps"] == 0 and none.summary["energy"]["max_rel_error"] is None
    assert "the error is not known: nothing but the start was seen\n" in str(none) and "error max" not in str(none) and "error max" in str(bad)
    refused(lambda: ph.verify(model), "state x")
    refused(lambda: ph.simulate(model, x, step=-1, duration=1), "step is -1")
    refused(lambda: ph.simulate(model, x, step=0.1, duration=1, method="gaus16"), "gauss16", most=900)
    refused(lambda: ph.simulate(model, x[:3], step=0.1, duration=1), "x has 3 numbers, expected 4")
    refused(lambda: ph.simulate(model, x, step=0.1, duration=1, tolerance=1), "'tolerance'")
    refused(lambda: ph.simulate(model, x, step=0.1, duration=1, limits={"enrgy": 1}), "enrgy")


def test_a_comparison_is_opened_and_drawn(source, tmp_path):
    c = ph.compare(source / "examples/double_pendulum/scene.toml", methods=["gauss4", "rk4"], duration=2, budget=1, out=tmp_path / "compare", progress=False)
    again = ph.open(tmp_path / "compare")
    assert isinstance(again, ph.Comparison) and again.content == c.content and str(again) == str(c)
    lines = c.lines()
    assert list(lines) == ["gauss4", "rk4"] and all(len(x) == len(y) > 1 for x, y in lines.values())
    assert lines["rk4"][1][0] == next(r["energy"]["max_rel_error"] for r in c.content["runs"] if r["method"] == "rk4" and r["outcome"] == "ok")
    pytest.importorskip("matplotlib")
    figure = ph.plot(tmp_path / "compare")
    (axes,) = figure.axes
    shown = {line.get_label(): (line.get_color(), line.get_linestyle(), line.get_marker()) for line in axes.get_lines()}
    assert {"gauss4", "rk4"} <= set(shown) and len(set(shown.values())) == len(shown)
    assert axes.get_xlabel() == "CPU time of one core [s]" and (tmp_path / "compare" / "plot.png").exists()
    refused(lambda: ph.plot(c, what="gauss4"), "a comparison has one picture")


def test_what_a_scene_states_is_not_ignored_beside_it(source):
    path = source / "examples/double_pendulum/scene.toml"
    v = ph.verify(path, method="rk4", step=0.02, duration=2)
    assert v.summary["method"] == "rk4" and v.summary["step_s"] == 0.02 and v.verdict == "fail"
    assert ph.verify(path, duration=2).verdict == "pass", "control"
    refused(lambda: ph.verify(path, limits={"energy": 1e-30}), "limits is given with a scene")
    refused(lambda: ph.verify(path, nonsense=3), "nonsense is given with a scene")
    refused(lambda: ph.verify(path, [0.0]), "x is given with a scene")
    refused(lambda: ph.verify(path, method="nonsense"), "nonsense")
    refused(lambda: ph.verify(ph.Scene(path), step=0.003), "step is given with a Scene, expected it where the Scene is made: Scene(path, step=...)")
    refused(lambda: ph.compare(ph.Scene(path), step=0.003), "step is given with a Scene")


@pytest.mark.parametrize("size", [1, 3])
def test_a_momentum_of_one_number(size):
    """A planar system declares its angular momentum as one number or as three."""

    class Kepler:
        def description(self):
            return ph.Description(name="kepler", nx=4, traits=ph.Traits(canonical=True),
                                  blocks=[ph.Block(name="r", at=0, size=2, momentum=2, unit="m", momentum_unit="kg m/s")],
                                  invariants=[ph.Invariant(name="angular_momentum", unit="kg m^2/s", at=0, size=size, degree=2)])

        def hamiltonian(self, x):
            return 0.5 * (x[2] ** 2 + x[3] ** 2) - 1 / np.sqrt(x[0] ** 2 + x[1] ** 2)

        def invariants(self, x):
            L = x[0] * x[3] - x[1] * x[2]
            return np.array([L] if size == 1 else [0 * L, 0 * L, L])

    limits = {"energy": 1e-9, "angular_momentum": 1e-12}
    good = ph.simulate(ph.UserModel(Kepler()), [1.0, 0, 0, 1.1], step=0.05, duration=5, limits=limits)
    assert good.verdict == "pass" and good.checks[1]["name"] == "angular_momentum" and good.checks[1]["value"] < 1e-14
    bad = ph.simulate(ph.UserModel(Kepler()), [1.0, 0, 0, 1.1], step=0.05, duration=5, method="rk4", limits=limits)
    assert bad.summary["angular_momentum"]["max_rel_error"] > 1e-12, "control"


def test_step_by_step(pendulum):
    model = ph.MechanicalModel(pendulum)
    assert "gauss16" in [d.name for d in ph.methods()]
    assert ph.declaration_of("gauss16").symplectic == ph.Claim.holds
    assert ph.misfit("gauss16", model) is None
    i = ph.integrator("gauss8", model, 0.01)
    a, b = ph.State(model, model.state([1, 0.2], [0, 0])), ph.State(model, model.state([1, 0.2], [0, 0]))
    x = a.x
    t, states = i.run(a, 50, every=10)
    other = ph.integrator("gauss8", model, 0.01)
    for _ in range(50):
        other.step(b)
    assert a == b and a.step == 50 and np.array_equal(states[-1], x)  # x is a view of the state
    assert t.shape == (6,) and t[-1] == pytest.approx(0.5) and i.cost.steps == 50
    refused(lambda: ph.integrator("gauss8", model, 0.0), "step")
    with pytest.raises(RuntimeError, match="t = .* the state is the last good one"):
        wild = ph.integrator("gauss16", model, 50.0, max_sweeps=2)
        wild.run(a, 10)


def test_folders_that_hold_no_result(tmp_path):
    refused(lambda: ph.open(tmp_path / "none"), "none", "not a folder")
    refused(lambda: ph.open(tmp_path), "no summary.json")
    (tmp_path / "checkpoint").mkdir()
    refused(lambda: ph.open(tmp_path), "unfinished")
    (tmp_path / "summary.json").write_text("{")
    refused(lambda: ph.open(tmp_path), "damaged")


def test_damaged_files_say_so(short_run, tmp_path):
    whole = (short_run.folder / "run.h5").read_bytes()
    for name, content in {"cut": whole[: len(whole) // 2], "text": b"hello", "empty": b""}.items():
        (tmp_path / name).write_bytes(content)
        refused(lambda: ph.RunFile(tmp_path / name), name, "cut off, damaged or no HDF5 file")
    refused(lambda: ph.RunFile(tmp_path / "missing"), "there is no such file")
    refused(lambda: short_run.file.read("state/elbow"), "no dataset 'state/elbow'", most=2000)


def test_a_scene_takes_no_attribute_of_ones_own(source):
    scene = ph.Scene(source / "examples/double_pendulum/scene.toml")
    refused(lambda: setattr(scene, "step", 0.05), "a Scene has no 'step' to be set, expected Scene(path, method=, step=, duration=, change=)", most=300)


def test_numbers_of_a_scene_are_changed(source, tmp_path):
    path = source / "examples/furuta_swing_up/scene.toml"
    names = [c.title for c in ph.Scene(path).certificates]
    balance = next(k for k, n in enumerate(names) if "linear-quadratic" in n)
    key = f"controller[{balance}].joints.turn.effort"
    gains = [ph.Scene(path, change={key: w}).certificates[balance].item("gains of turn.torque").numbers for w in (10, 20)]
    assert np.abs(np.subtract(*gains)).max() > 0.01 * np.abs(gains[0]).max()
    short = dict(duration=0.5, change={"initial.joints.swing.position": 0.25})
    ph.Scene(path, **short).run(tmp_path / "run", progress=False)
    assert ph.Scene(path, **short).assembly.start[1] == 0.25 != ph.Scene(path).assembly.start[1]
    held = ph.RunFile(tmp_path / "run/run.h5").read("provenance/scene")
    assert "position = 0.25" in held and "position = 0.25" not in path.read_text(), "results hold what was run"
    refused(lambda: ph.Scene(path, change={key.replace("effort", "efort"): 1}), key.replace("effort", "efort"), "the nearest known one is 'effort'", most=400)
    refused(lambda: ph.Scene(path, change={"contrller[0].rate": 1}), "the scene has no 'contrller', the nearest known key is 'controller'")
    refused(lambda: ph.Scene(path, change={"controller[7].rate": 1}), "'controller' has the places 0 to 1")
    refused(lambda: ph.Scene(path, change={key: "a lot"}), "expected numbers, or rows of them, by key")
    refused(lambda: ph.Scene(path, change={key: 1}, case=0), "change is given besides case")


def test_a_scene_with_events_has_phases(source, tmp_path):
    scene = source / "examples/capture/scene.toml"
    r = ph.Scene(scene).run(tmp_path / "capture", progress=False)
    assert r.summary["verdict"] == r.verdict
    notes = r.summary["notes"]  # one on its controllers, not one for each phase
    assert len(notes) <= 2 and sum("delivered by controllers" in n for n in notes) == 1
    assert len(r.phases) > 1 and all(p.time[0] >= 0 for p in r.phases)
    refused(lambda: r.names, "phases")
    name = next(n for n in r.phases[0].names if n.startswith("energy_error"))
    t, e = r.joined(name)
    assert len(t) == len(e) == sum(len(p.time) for p in r.phases) and (np.diff(t) >= 0).all()
    assert e[len(r.phases[0].time)] == r.phases[1][name][0]
    refused(lambda: r.joined("energy_eror"), "no phase has a series 'energy_eror'", most=2000)
    # the motion of all phases in one picture: the target, captured, has no place of its own any more
    motion, first = r.motion(), r.phases[0].motion()
    t = motion["time [s]"]["t"]
    assert t[0] == 0 and t[-1] == r.summary["simulated_s"] and (np.diff(t) >= 0).all()
    what = next(w for w in first if w.startswith("path of target"))
    path, at = motion["path of base [m]"]["x"], np.searchsorted(t, r.phases[0].time[-1])
    assert np.abs(np.diff(path)[at - 1 : at + 3]).max() < 0.05 * np.abs(path).max()  # paths and rotations count from the first start
    gone = np.isnan(next(iter(motion[what].values())))
    assert not gone[0] and gone[-1]
    ph.plot(r, tmp_path / "joints.png", what="joints")
    assert (tmp_path / "joints.png").stat().st_size > 1000 and not (tmp_path / "joints_1.png").exists()


# --- Ctrl-C and progress --------------------------------------------------------------------------------------------------
INTERRUPTED = """
import sys, time
import porthos
scene = porthos.Scene({scene!r}, duration=1e7)
print("ready", flush=True)
try:
    scene.run({out!r}, progress=False)
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(130)
"""


def test_ctrl_c_saves_and_raises(source, tmp_path):
    out = str(tmp_path / "run")
    code = INTERRUPTED.format(scene=str(source / "examples/ets_vii/scene.toml"), out=out)
    p = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=os.environ)
    assert p.stdout.readline() == "ready\n"
    time.sleep(0.6)
    start = time.monotonic()
    p.send_signal(signal.SIGINT)
    rest, _ = p.communicate(timeout=30)
    print(f"KeyboardInterrupt after {time.monotonic() - start:.2f} s, with the end of the interpreter")
    assert p.returncode == 130 and rest == "interrupted\n"
    assert (tmp_path / "run/checkpoint/state.bin").exists()
    refused(lambda: ph.open(out), "unfinished")
    # and the checkpoint is good: the run goes on, until it is stopped again
    refused(lambda: ph.Scene(source / "examples/ets_vii/scene.toml", duration=1e7).run(out, progress=False), "unfinished run")


def test_a_callback_can_stop_a_run(duffing):
    class Enough(Exception):
        pass

    def tell(fraction, spent, left):
        raise Enough

    class Slow(duffing):
        def gradient(self, x):
            time.sleep(0.0005)
            return duffing.gradient(self, x)

    with pytest.raises(Enough):
        ph.simulate(ph.UserModel(Slow()), [1.0, 0.0], step=0.01, duration=1e4, progress=tell)


def test_other_threads_go_on_during_a_run(pendulum):
    import threading

    model = ph.MechanicalModel(pendulum)
    ticks = []
    done = threading.Event()

    def tick():
        while not done.wait(0.005):
            ticks.append(1)

    t = threading.Thread(target=tick)
    t.start()
    ph.integrator("gauss16", model, 0.001).run(ph.State(model, model.state([2, 0.5], [0, 0])), 20000, every=20000)
    done.set()
    t.join()
    assert len(ticks) >= 2, "the GIL was held"


def test_the_progress_line():
    from porthos.progress import Progress

    s = io.StringIO()
    p = Progress(s)
    p(0.5, 10, 4000)
    p(0.6, 11, 90)  # too soon after the last
    p.finish()
    text = s.getvalue()
    assert text.count("\r") == 3 and "50.0 %" in text and "1 h 06 min left" in text and "60.0" not in text
    assert text.endswith(" \r") and "\n" not in text


def test_where_progress_is_shown(monkeypatch):
    import types

    from porthos.progress import Progress, chosen, in_notebook

    assert not in_notebook() and chosen(False)[0] is None and isinstance(chosen(True)[0], Progress)

    class ZMQInteractiveShell:
        pass

    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=ZMQInteractiveShell))
    assert in_notebook() and isinstance(chosen(None)[0], Progress)
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: None))
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert chosen(None)[0] is None  # neither a notebook nor a terminal
    assert chosen(print)[0] is print


def test_outputs_are_series_and_panels(source, tmp_path):
    result = ph.Scene(source / "examples/slew/scene.toml", duration=60).run(tmp_path / "out")
    assert result.unit("output/pointing_error") == "rad"
    assert result["output/hand"].shape == (len(result.time), 3)
    assert result["output/pointing_error"][0] > 1.5 > result["output/pointing_error"][-1]
    assert result.summary["outputs"]["hand.x"]["end"] == result["output/hand"][-1, 0]
    assert list(result.motion()["outputs [N m]"]) == ["torque_x", "torque_y", "torque_z"]
    ph.plot(result, tmp_path / "error.png", what="pointing_error")
    assert (tmp_path / "error.png").stat().st_size > 1000


def test_extended_is_the_longer_run(source, tmp_path):
    whole = ph.Scene(source / "examples/slew/scene.toml", duration=60)
    whole.data.record_every = 1.0
    half = ph.Scene(source / "examples/slew/scene.toml", duration=20)
    half.data.record_every = 1.0
    half.run(tmp_path / "parts")
    parts, all = half.extend(60, tmp_path / "parts"), whole.run(tmp_path / "whole")
    assert parts.summary["steps"] == 600
    assert all.time[-1] == parts.time[-1]
    for name in all:
        assert np.array_equal(all[name], parts[name]), name
    with pytest.raises(ph.InvalidArgument, match="expected a later time"):
        half.extend(30, tmp_path / "parts")


def test_film_refuses_in_a_sentence(source, tmp_path):
    ph.Scene(source / "examples/double_pendulum/scene.toml", duration=1.0).run(tmp_path / "out")
    with pytest.raises(ph.InvalidArgument, match="a film of 640x361 pixels, expected even numbers from 64 to 4096"):
        ph.film(tmp_path / "out", size=(640, 361))
    with pytest.raises(ph.InvalidArgument, match="camera is 'w', expected one of iso, x, y, z"):
        ph.film(tmp_path / "out", camera="w")
    with pytest.raises(ph.InvalidArgument, match="reel.gif: expected a name that ends with .mp4"):
        ph.film(tmp_path / "out", "reel.gif")


def test_certificates_of_a_scenes_controllers(source):
    scene = ph.Scene(source / "examples/furuta_swing_up/scene.toml")
    assert len(scene.certificates) == 2 and all(c.holds for c in scene.certificates)


def test_a_table_of_a_run(source, tmp_path):
    result = ph.Scene(source / "examples/double_pendulum/scene.toml", duration=1.0).run(tmp_path / "out")
    result.to_csv(tmp_path / "run.csv", ["time", "stored"])
    head, *rows = (tmp_path / "run.csv").read_text().splitlines()
    names = ["time", *sorted(n for n in result.names if n.startswith("stored/"))]
    assert head == ",".join(f"{n} [{result.unit(n)}]" for n in names)
    assert np.array_equal(np.array([row.split(",") for row in rows], float), np.column_stack([result[n] for n in names]))
    with pytest.raises(ph.InvalidArgument, match="has no series 'elbows', expected one of time"):
        result.to_csv(tmp_path / "x.csv", ["elbows"])
    scene = ph.Scene(source / "examples/double_pendulum/scene.toml")
    with pytest.raises(ph.InvalidArgument, match="the run is in memory"):
        ph.simulate(scene.model, scene.assembly.initial.x, step=0.01, duration=0.1).to_csv(tmp_path / "x.csv")


def test_a_scene_in_memory_has_the_bits_of_its_folder(source, tmp_path, monkeypatch):
    (tmp_path / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    path = tmp_path / "scene.toml"
    path.write_text((source / "examples/double_pendulum/scene.toml").read_text() + "\n[[output]]\nquantity = 'position'\nname = 'tip'\nlink = 'lower'\n")
    monkeypatch.chdir(tmp_path)
    scene = ph.Scene(path, duration=2)
    before = set(tmp_path.iterdir())
    here = scene.run(memory=True, progress=False)
    assert here.passed and here.folder is None and set(tmp_path.iterdir()) == before, "no files"
    there = scene.run(tmp_path / "out", progress=False)
    for name in ("time", "state/elbow", "momentum/elbow", "energy_error", "output/tip"):
        assert np.array_equal(here[name], there[name]), name
    assert here["output/tip"].shape == (len(here.time), 3) and "joints [rad]" in here.motion()
    assert not np.array_equal(here["state/elbow"], ph.Scene(path, duration=2, change={"initial.joints.elbow.position": 0.1}).run(memory=True)["state/elbow"])  # control
    refused(lambda: scene.run(tmp_path / "out", memory=True), "out is given with memory=True, which has no folder")
    refused(lambda: scene.run(memory=True, resume=True), "resume is given with memory=True")
    with pytest.raises(ph.InvalidArgument, match="cannot run in memory"):
        ph.Scene(source / "examples/ets_vii_orbit/scene.toml").run(memory=True)
