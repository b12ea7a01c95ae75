"""A method of integration written in Python, beside those of the catalogue."""
import subprocess
import sys

import numpy as np
import porthos as ph
import pytest

from test_dynamics import refused


def rk4(field, t, x, h):
    a = field(t, x)
    b = field(t + h / 2, x + h / 2 * a)
    c = field(t + h / 2, x + h / 2 * b)
    d = field(t + h, x + h * c)
    return h / 6 * (a + 2 * b + 2 * c + d)


def midpoint(field, t, x, h):
    d = h * field(t + h / 2, x)
    for _ in range(60):
        before, d = d, h * field(t + h / 2, x + d / 2)
        if np.all(abs(d - before) <= 1e-16 * (abs(x) + abs(d))):
            break
    return d


@pytest.fixture(scope="module", autouse=True)
def methods():
    ph.add_method("own_rk4", rk4, order=4)
    ph.add_method("own_midpoint", midpoint, order=2, symmetric=True, symplectic=True, quadratic_invariants=True)


def test_claims_are_measured(pendulum):
    model = ph.MechanicalModel(pendulum)
    x = np.linspace(1.0, -0.5, model.description.nx)
    check = lambda name: ph.check_method(name, model, x, step=0.1)
    of = lambda report: {c.claim: c for c in report.claims}
    with np.errstate(all="ignore"):  # of steps that are too long
        true = check("own_midpoint")
    assert true.holds and of(true)["symplectic"].measured < 1e-13 and abs(of(true)["order"].measured - 2) < 0.1, true
    assert "not measured: the system declares none" in str(true)
    ph.add_method("own_liar", rk4, order=5, symmetric=True, symplectic=True, energy_exact=True)
    false = check("own_liar")
    print(false)
    assert not false.holds and [c.claim for c in false.claims if not c.holds] == ["order", "symmetric", "symplectic", "energy"]
    assert abs(of(false)["order"].measured - 4) < 0.2 and str(false).count("FAILS") == 4
    assert check("own_rk4").holds  # control: the same without the claims
    refused(lambda: ph.check_method("own_rk4", model, [0.1], step=0.1), "start")


def test_the_same_motion_as_the_method_of_the_catalogue(pendulum):
    x = np.linspace(1.0, -0.5, ph.MechanicalModel(pendulum).description.nx)
    ends = []
    for name in ("rk4", "own_rk4"):
        model = ph.MechanicalModel(pendulum)
        state = ph.State(model, x)
        method = ph.integrator(name, model, 0.01)
        method.run(state, 200)
        assert method.cost.evaluations == 800
        ends.append(np.array(state.x))
    assert ends[1] == pytest.approx(ends[0], abs=1e-13)  # sums in another order: measured 1e-15
    assert abs(ends[0] - x).max() > 0.1


def test_a_scene_verified_compared_and_resumed(source, tmp_path):
    scene = ph.Scene(source / "examples/dzhanibekov/scene.toml", method="own_midpoint", duration=5)
    result = scene.verify(out=tmp_path / "verify")
    within = {c["name"]: c["pass"] for c in result.checks}
    assert within["angular_momentum"] and within["symmetry"]
    assert not within["energy"]  # order 2 at this step: the control

    rows = [line.split() for line in str(scene.compare(methods=["own_rk4", "rk4"], budget=2)).splitlines()]
    errors = {row[0]: float(row[6]) for row in rows if row[1:3] == ["0.25", "s"]}
    assert errors["own_rk4"] == pytest.approx(errors["rk4"], rel=0.02)  # two digits are printed

    whole = scene.run(out=tmp_path / "whole")
    ph.Scene(source / "examples/dzhanibekov/scene.toml", method="own_midpoint", duration=2.5).run(out=tmp_path / "parts")
    parts = scene.extend(5, out=tmp_path / "parts")
    for name in whole.names:
        assert np.array_equal(whole[name][-1], parts[name][-1]), name


def test_a_claim_that_the_trials_contradict_is_not_believed(source, tmp_path):
    ph.add_method("own_liar", rk4, order=4, symmetric=True, symplectic=True, energy_exact=True)
    scene = ph.Scene(source / "examples/double_pendulum/scene.toml", method="own_liar", step=0.02, duration=2)
    note = "own_liar is declared to keep the energy with any step, and its error is "
    told = [n for n in scene.run(out=tmp_path / "run").notes if n.startswith(note)]
    assert len(told) == 1 and told[0].endswith(", expected below 1e-08: the declaration is not believed"), told
    text = str(ph.compare(source / "examples/double_pendulum/scene.toml", methods=["own_liar"], duration=2, budget=2))
    assert "declared to keep the energy with any step, and these trials do not: own_liar (errors up to " in text and ", expected below 1e-08)" in text
    assert "not in the advice" not in text
    honest = ph.Scene(source / "examples/double_pendulum/scene.toml", method="own_rk4", step=0.02, duration=2)
    assert not any("declared" in n for n in honest.run(out=tmp_path / "honest").notes)


def test_an_order_and_invariants_that_the_trials_contradict_are_told(source, tmp_path, pendulum):
    def heun(field, t, x, h):
        a = field(t, x)
        return h / 2 * (a + field(t + h, x + h * a))

    model = ph.MechanicalModel(pendulum)
    for order in (3, 2):
        ph.add_method("own_heun", heun, order=order)
        text = str(ph.compare(model, model.state([0.5, 0.2], [0, 0]), step=0.02, duration=2, methods=["own_heun", "rk4", "gauss4"], budget=1))
        assert ("own_heun is declared of order 3, and these trials show 2.0" in text) == (order == 3), text
        assert "rk4 is declared" not in text and "gauss4 is declared" not in text
    notes = []
    for claim in (True, False):
        ph.add_method("own_turning", heun, order=2, quadratic_invariants=claim)
        scene = ph.Scene(source / "examples/dzhanibekov/scene.toml", method="own_turning", step=0.01, duration=2)
        notes.append([n for n in scene.run(out=tmp_path / str(claim), progress=False).notes if "quadratic_invariants is contradicted" in n])
    assert any(n.startswith("own_turning is declared to keep quadratic invariants with any step, and angular_momentum is off by") and "expected at most 1e-09" in n for n in notes[0]) and not notes[1]


def test_what_a_method_needs_of_a_system(source, pendulum):
    def leapfrog(field, t, x, h):  # of x = (q, p): p moves by q alone, q by p alone
        n = len(x) // 2
        y = x.copy()
        y[n:] += h / 2 * field(t, y)[n:]
        y[:n] += h * field(t, y)[:n]
        y[n:] += h / 2 * field(t + h, y)[n:]
        return y - x

    ph.add_method("own_leapfrog", leapfrog, order=2, symmetric=True, symplectic=True, needs=["canonical", "separable"])
    model = ph.MechanicalModel(pendulum)
    refused(lambda: ph.simulate(model, model.state([0.5, 0], [0, 0]), step=0.01, duration=1, method="own_leapfrog"), "own_leapfrog", "needs a separable Hamiltonian")
    ph.add_method("own_leapfrog", leapfrog, order=2)  # control: it is taken without
    ph.simulate(model, model.state([0.5, 0], [0, 0]), step=0.01, duration=0.1, method="own_leapfrog")
    refused(lambda: ph.add_method("own_leapfrog", leapfrog, order=2, needs=["seperable"]), "needs has 'seperable', expected canonical, lossless, separable or linear_state")


def test_a_method_with_a_memory_is_refused_at_once(source):
    before = []

    def two_step(field, t, x, h):
        f = field(t, x)
        move = h * (1.5 * f - 0.5 * before[-1]) if before else h * f
        before.append(f)
        return move

    ph.add_method("own_two_step", two_step, order=2)
    scene = ph.Scene(source / "examples/double_pendulum/scene.toml", method="own_two_step", step=0.01, duration=1)
    for _ in range(2):  # with and without a memory of another run
        refused(lambda: scene.run(), "gives another change when it is called again")


def test_an_error_of_ones_own_is_not_tried_at_every_step(source):
    def broken(field, t, x, h):
        raise ValueError("no such thing")

    ph.add_method("own_broken", broken, order=1)
    c = ph.compare(source / "examples/double_pendulum/scene.toml", methods=["own_broken", "rk4"], duration=2, budget=2)
    tried = [r["method"] for r in c.content["runs"]]
    assert tried.count("own_broken") == 3 and tried.count("rk4") > 3, tried


def test_a_method_that_is_refused_at_once_leaves_no_run_to_continue(source, tmp_path):
    scene = lambda: ph.Scene(source / "examples/dzhanibekov/scene.toml", method="own_mended", duration=1)  # noqa: E731
    ph.add_method("own_mended", lambda field, t, x, h: None, order=1)
    with pytest.raises(ph.InvalidArgument, match="returned None"):
        scene().run(out=tmp_path / "run")
    ph.add_method("own_mended", rk4, order=4)
    assert scene().run(out=tmp_path / "run").summary["outcome"] == "ok"


def test_results_are_drawn_where_the_method_is_not_known(source, tmp_path):
    run = tmp_path / "run"
    ph.Scene(source / "examples/dzhanibekov/scene.toml", method="own_rk4", duration=1).run(out=run, progress=False)
    ph.report(run)
    here = (run / "report.html").read_bytes()
    subprocess.run([sys.executable, "-c", f"import porthos as ph; ph.report({str(run)!r}); ph.plot({str(run)!r}, what='motion')"], check=True)
    assert len((run / "report.html").read_bytes()) > 0.95 * len(here)  # with the playback


def test_faults_of_a_method(source, tmp_path):
    def run(step, name="own_faulty"):
        ph.add_method(name, step, order=1)  # replaces the one before
        return ph.Scene(source / "examples/dzhanibekov/scene.toml", method=name, duration=1).run(out=tmp_path / str(len(list(tmp_path.iterdir()))))

    with pytest.raises(ph.InvalidArgument, match="method 'own_faulty' returned 2 numbers, expected 14"):
        run(lambda field, t, x, h: x[:2])
    with pytest.raises(ph.InvalidArgument, match="field.t, x.: x returned 3 numbers, expected 14"):
        run(lambda field, t, x, h: field(t, x[:3]))
    with pytest.raises(ph.InvalidArgument, match="returned complex numbers, expected real ones"):
        run(lambda field, t, x, h: 1j * field(t, x))
    with pytest.raises(ph.InvalidArgument, match="returned None, expected 14 numbers"):
        run(lambda field, t, x, h: None)
    def in_place(field, t, x, h):
        before = x  # no copy: the change would be zero, and the motion frozen
        x += h * field(t, x)
        return x - before

    with pytest.raises(ValueError, match="read-only"):
        run(in_place)
    for wrong in (lambda field, t, x, h: 0 * x, lambda field, t, x, h: field(t, x), lambda field, t, x, h: -h * field(t, x)):
        with pytest.raises(ph.InvalidArgument, match=r"gives a change that differs from h times the rates field\(t, x\) by "):
            run(wrong)
    with pytest.raises(ZeroDivisionError, match=r"^division by zero \(method 'own_faulty' at t = 0 s, test_methods.py:\d+\)$"):
        run(lambda field, t, x, h: 1 / 0)
    assert "expected a smaller step" in str(run(lambda field, t, x, h: np.nan * x))
    with pytest.raises(ph.InvalidArgument, match=r"gives the new state x\(t \+ h\), expected the change"):
        run(lambda field, t, x, h: x + h * field(t, x))
    for name in ("auto", "", "my method"):
        with pytest.raises(ph.InvalidArgument, match="expected"):
            ph.add_method(name, rk4, order=4)
    with pytest.raises(ph.InvalidArgument, match="'rk4' is a method of Porthos"):
        ph.add_method("rk4", rk4, order=4)
    with pytest.raises(ph.InvalidArgument, match="the order of 'zero' is 0"):
        ph.add_method("zero", rk4, order=0)

    kept = []
    run(lambda field, t, x, h: kept.append(field) or h * field(t, x), "own_keeper")
    with pytest.raises(ph.InvalidArgument, match="a run that is over"):
        kept[0](0.0, np.zeros(14))


def test_rates_that_are_zero_at_the_start_only_refuse_no_method(source, tmp_path):
    def second(field, t, x, h):  # Heun: half of its change is by the rates at the end
        a = field(t, x)
        return h / 2 * (a + field(t + h, x + h * a))

    ph.add_method("own_second", second, order=2)
    arm = source / "examples/throwing_arm/scene.toml"  # driven from rest: x' = 0 at t = 0
    run = ph.Scene(arm, method="own_second", duration=0.1).run(out=tmp_path / "run", progress=False)
    assert run.summary["outcome"] == "ok"
    ph.add_method("own_second", lambda field, t, x, h: 4 * second(field, t, x, h), order=2)  # control
    refused(lambda: ph.Scene(arm, method="own_second", duration=0.1).run(out=tmp_path / "twice", progress=False), "differs from h times the rates")


def test_step_controls_take_a_method_by_what_it_declares(source, tmp_path):
    def run(control, method):
        text = f'''[model]
            urdf = "{source}/examples/double_pendulum/double_pendulum.urdf"
            base = "fixed"
            [initial]
            joints.shoulder = {{ velocity = 1.0 }}
            [integrator]
            method = "{method}"
            step = 0.01
            step_control = "{control}"
            [run]
            duration = 0.5'''
        (tmp_path / "scene.toml").write_text(text)
        return ph.Scene(tmp_path / "scene.toml").run(out=tmp_path / f"{control}_{method}", progress=False).summary["outcome"]

    for control, method in (("time_transformed", "own_rk4"), ("time_transformed", "own_midpoint"), ("reversible", "own_midpoint")):
        assert run(control, method) == "ok"
    refused(lambda: run("reversible", "own_rk4"), 'step_control is "reversible", but own_rk4 is not symmetric, expected a symmetric method')


def test_a_run_is_not_resumed_by_another_function_of_the_same_name(source, tmp_path):
    def made(factor):
        return lambda field, t, x, h: factor * h * field(t, x)

    ph.add_method("own_euler", made(1.0), order=1)
    known = ph.method_version("own_euler")
    scene = lambda: ph.Scene(source / "examples/dzhanibekov/scene.toml", method="own_euler", step=0.01, duration=2)  # noqa: E731
    scene().run(out=tmp_path / "run", progress=False)
    ph.add_method("own_euler", made(1.0), order=1)
    assert ph.method_version("own_euler") == known  # also after calls
    scene().extend(3, out=tmp_path / "run", progress=False)  # control
    ph.add_method("own_euler", made(1.0 + 1e-12), order=1)
    assert ph.method_version("own_euler") != known and ph.method_version("rk4") == ""
    refused(lambda: scene().extend(4, out=tmp_path / "run", progress=False), "the method 'own_euler' has changed")

    class Factor:
        value = 1.0

    ph.add_method("own_euler", lambda field, t, x, h: Factor().value * h * field(t, x), order=1)
    scene().run(out=tmp_path / "other", progress=False)
    scene().extend(3, out=tmp_path / "other", progress=False)
    factor = Factor()
    ph.add_method("own_euler", lambda field, t, x, h: factor.value * h * field(t, x), order=1)
    scene().run(out=tmp_path / "third", progress=False)
    with pytest.warns(UserWarning, match="'own_euler' was added in Python and uses objects of its own, not checked"):
        scene().extend(3, out=tmp_path / "third", progress=False)


def test_what_a_version_of_a_method_sees():
    a = np.array([1.0, 2.0])

    def version(make):
        ph.add_method("own_seen", make, order=1)
        return ph.method_version("own_seen")

    def of(array, default=1.0):
        def step(field, t, x, h, k=default):
            return k * h * field(t, x) * array[0]
        return step

    known = version(of(a))
    assert known == version(of(a.copy())) and "not checked" not in known
    assert len({known, version(of(a + 1)), version(of(a, 2.0)), version(lambda field, t, x, h: h * field(t, x)), version(lambda field, t, x, h: x * field(t, x))}) == 5
    assert version(of(object())).endswith(", not checked")
    names = {"np": np, "B": 1.0}
    exec("def inner(y):\n    return B * y\ndef step(field, t, x, h):\n    return h * inner(field(t, x))", names)
    one = version(names["step"])
    names["B"] = 2.0  # a number that a function of a function uses
    assert version(names["step"]) != one
    names["B"] = 1.0
    assert version(names["step"]) == one
