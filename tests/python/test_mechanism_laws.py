"""Laws designed for mechanisms made in Python: matching by formulas and by quadratures, swing-up and balance."""

import warnings
from math import pi

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused as refused_in_short

es = ph.energy_shaping


def refused(call, *words):
    refused_in_short(call, *words, most=600)

WHEEL = dict(actuated=["wheel.force"], coordinates=["pendulum", "wheel"], Md=[["a1", "a2"], ["a2", "a3"]],
             Vd="0.1*10/(a1 + a2)*cos(pendulum) + k1*(wheel - 0.1*(a2 + a3)/(0.2*(a1 + a2))*pendulum)**2/2",
             gains={"a1": 1, "a2": -1.5, "a3": 6, "k1": 0.1, "kv": 10}, lower=[-3.2, -20], upper=[3.2, 20], rate=20)


def test_formulas_of_a_matched_loop_are_the_design_in_cpp():
    """The numbers of InertiaWheelPendulum, as formulas with powers as SymPy writes them."""
    plant, ours = es.inertia_wheel_plant(), es.inertia_wheel_pendulum()
    loop = es.matched_loop(plant, **WHEEL)
    assert loop.certificate.holds, loop.certificate.text()
    worst = 0.0
    for x in np.random.default_rng(1).uniform(-2, 2, (50, 4)):
        a, b = ours.law(0, x), loop.law(0, x)
        worst = max(worst, np.abs(a - b).max() / np.abs(a).max())
    print(f"law: {worst:.1e} relative (bound 1e-12)")
    assert worst < 1e-12
    run = es.simulate(loop, loop.state([0.3, 0], [0, 0]), duration=20, step=0.01)
    above = run["H"] + 2  # V_d at rest is 0.1*10/(a1 + a2) = -2
    assert run["finished"] and run["rise"] < 1e-12 and above[-1] < 1e-3 * above[0], above
    faster = es.sweep(loop, [[1, -1.5, 6, 0.1, 10], [1, -1.5, 6, 0.1, 20]], start=[0.5, 0, 0, 0])
    assert all(r.finite for r in faster) and faster[0].settling != faster[1].settling and loop.gain_names[-1] == "kv"


def test_formulas_that_do_not_match_are_refused():
    plant = es.inertia_wheel_plant()
    refused(lambda: es.matched_loop(plant, **{**WHEEL, "Vd": "0.5*(pendulum^2 + wheel^2)"}), "matching, potential energy")
    open_ = es.matched_loop(plant, **{**WHEEL, "Vd": "0.5*(pendulum^2 + wheel^2)"}, refuse=False)
    assert not open_.certificate.holds and open_.certificate.item("matching, potential energy").value > 1e-3
    refused(lambda: es.matched_loop(plant, **{**WHEEL, "Vd": "cos(pendulm)"}), "matched_loop: Vd: ", "pendulm")
    refused(lambda: es.matched_loop(plant, **{**WHEEL, "Md": [["1", "0"]]}), "not 2 rows of 2 formulas")
    refused(lambda: es.matched_loop(plant, **{**WHEEL, "coordinates": ["q"]}), "1 coordinates are named, expected 2 or 3")
    refused(lambda: es.matched_loop(plant, **{**WHEEL, "gains": {"a1": 1, "a2": -1.5, "a3": 6, "k1": 0.1}}), "kv")


def test_the_skew_part_is_solved_for():
    """A mass matrix that turns with the unactuated coordinate needs J2: without it the kinetic matching fails."""
    beam = dict(actuated=["beam.force"], coordinates=["ball", "beam"], gains={"kp": 5, "kv": 3}, lower=[-0.8, -0.9], upper=[0.8, 0.9],
                Md=[["sqrt(2*(1 + ball^2))", "1 + ball^2"], ["1 + ball^2", "(1 + ball^2)*sqrt(2*(1 + ball^2))"]],
                Vd="9.81*(1 - cos(beam)) + 0.5*kp*(beam - log(ball + sqrt(1 + ball^2))/sqrt(2))^2")
    plant = es.ball_and_beam_plant()
    assert es.matched_loop(plant, **beam, solve_skew=True).certificate.holds
    refused(lambda: es.matched_loop(plant, **beam), "matching, kinetic energy")


def link(name, parent, joint, at, mass, inertia):
    return ph.BodySpec(name=name, parent=parent, position=(0, 0, at), joint=ph.JointSpec(name=joint, type="revolute", axis=(0, 1, 0)),
                       mass=ph.MassProperties(mass=mass, com=(0, 0, 0.5), inertia=(inertia, 0, 0, inertia, 0, inertia)))


@pytest.fixture(scope="module")
def pendubot():
    b = ph.MechanismBuilder("pendubot")
    b.gravity((0, 0, -9.8))
    b.add(link("upper", "world", "shoulder", 0, 2, 0.1)).add(link("lower", "upper", "elbow", 1, 1, 0.05))
    return ph.MechanicalModel(b.build())


def test_numerical_matching_of_a_mechanism(pendubot):
    keys = dict(actuator="shoulder.torque", ratio=-0.6, half_width=0.8, ku=300, kv=0.5, determinant=0.2)
    loop = es.numerical_matching(pendubot, **keys)
    residual = loop.certificate.item("matching, kinetic energy").value
    print(f"kinetic matching {residual:.1e} (bound 1e-10)")
    assert residual < 1e-10 and loop.certificate.holds
    n = ph.Network("under its law")
    n.add("arm", pendubot)
    es.control(n, "law", "arm", loop)
    run = ph.simulate(n.build(), loop.state([0.1, -0.1], [0, 0]), step=0.005, duration=30, limits={"balance": 1e-9}, progress=False)
    assert run.passed, run
    assert abs(run.x[-1][:2]).max() < 1e-2 < abs(run.x[0][:2]).max()
    left = ph.simulate(n.build(), loop.state([0, 0.7], [0, 0]), step=0.005, duration=1, progress=False)
    assert not left.passed and any("s: controller 'law': 'elbow' is -0." in note and "outside -0.8 to 0.8, where" in note for note in left.notes), left.notes
    narrow = es.numerical_matching(pendubot, **{**keys, "half_width": 0.4})  # a run that leaves ends there, also one that would come back
    n = ph.Network("under a narrow law")
    n.add("arm", pendubot)
    es.control(n, "law", "arm", narrow)
    for rate, stays in ((0, True), (0.3, False)):
        r = ph.simulate(n.build(), narrow.state([0, 0.1], [0, rate]), step=0.005, duration=2, limits={"balance": 1e-9}, progress=False)
        assert r.passed is stays and bool(r.time[-1] == 2) is stays and any("outside -0.4 to 0.4" in note for note in r.notes) is not stays, r.notes
    for limit, at_it in ((0.5, True), (30.0, False)):  # what kept the law from holding this start is its limit, not half_width
        n = ph.Network("under a limited law")
        n.add("arm", pendubot)
        es.control(n, "law", "arm", narrow, limits=[limit])
        r = ph.simulate(n.build(), narrow.state([0, 0.1], [0, 0]), step=0.005, duration=2, limits={"balance": 1e-9}, progress=False)
        assert r.passed is not at_it, r.notes
        assert any("controller 'law' asks for more than its limit of 0.5 at all records, first at 0 s" in note for note in r.notes) is at_it, r.notes
        assert any("take a larger half_width" in note and note.endswith("at its limit of 0.5 at all records: a larger one first") for note in r.notes) is at_it, r.notes
    refused(lambda: es.numerical_matching(pendubot, **{**keys, "half_width": 2}), "degenerates at r")
    refused(lambda: es.numerical_matching(pendubot, **{**keys, "actuator": "elbow.torque"}), "acts on 'elbow', which unactuated = 1")
    turned = es.numerical_matching(pendubot, **keys, rest=[2 * np.pi, 0])
    assert np.allclose(turned.rest, [2 * np.pi, 0, 0, 0]) and "rest without the law" not in turned.certificate.text()
    refused(lambda: es.numerical_matching(pendubot, **keys, rest=[0]), "rest")


@pytest.fixture(scope="module")
def furuta(source):
    return ph.MechanicalModel(ph.read_urdf(source / "examples/furuta_swing_up/furuta.urdf", gravity=(0, 0, -9.81)).mechanism)


def test_swing_up_and_balance_move_as_the_scene_does(furuta, source, tmp_path):
    upright = [0.0, np.pi]
    swing = es.swing_up(furuta, "turn.torque", upright, energy=60000, inertia=1, stiffness=60, damping=0.5, limit=0.1)
    balance = es.Lqr(furuta, ["turn.torque"], upright, position=[0.3, 1], rate=[0.01, 0.01], effort=[100], periodic=[False, True])
    assert swing.certificate.holds and balance.certificate.holds and balance.gains.shape == (1, 4)
    balance.certify_sampled(1 / 500)
    x = furuta.state([0, 0.01], [0, 0])
    swing.check_start(x)
    refused(lambda: swing.check_start(furuta.state([0, 0], [0, 0])), "for ever")
    n = ph.Network("furuta")
    n.add("arm", furuta)
    es.hand_over(n, "arm", swing, balance, period=1 / 500, limits=[0.1])
    run = ph.simulate(n.build(), x, method="gauss8", step=0.001, duration=10, record_every=0.01, limits={"balance": 1e-12}, progress=False)
    assert run.passed, run
    assert any("handed over to 'balance'" in note for note in run.notes), run.notes
    scene = ph.Scene(source / "examples/furuta_swing_up/scene.toml").run(tmp_path / "scene", progress=False)
    for joint in ("turn", "swing"):
        apart = np.abs(run[f"state/{joint}"] - scene[f"state/{joint}"]).max()
        print(f"{joint}: {apart:.1e} rad from the scene's (bound 1e-9)")
        assert apart < 1e-9
    alone = ph.Network("no hand-over")  # control: the swing-up alone does not stay
    alone.add("arm", furuta)
    swing.control(alone, "swing_up", "arm", period=1 / 500)
    other = ph.simulate(alone.build(), x, method="gauss8", step=0.001, duration=10, progress=False)
    assert np.abs(np.abs(other["state/swing"][-2000:]) - np.pi).max() > 0.1 > np.abs(np.abs(run["state/swing"][-100:]) - np.pi).max()


def test_certify_of_an_lqr_names_its_own_checks(furuta):
    balance = es.Lqr(furuta, ["turn.torque"], [0, pi], position=[0.3, 1], rate=[0.01, 0.01], effort=[100])
    hint = "; an Lqr has falling_level() and certify_sampled()"
    with pytest.raises(TypeError) as told:
        es.certify(balance, lower=[-1, -1], upper=[1, 1])
    assert str(told.value) == "certify(): 'loop' is of the type Lqr, expected ClosedLoop" + hint
    with pytest.raises(TypeError) as told:  # control: of other types
        es.certify(furuta, lower=[-1, -1], upper=[1, 1])
    assert "'loop' is" in str(told.value) and hint not in str(told.value)


def test_what_a_swing_up_needs_is_told(furuta):
    up = [0, np.pi]
    refused(lambda: es.swing_up(furuta, "turn.torque", up), "neither bandwidth nor energy is given")
    refused(lambda: es.swing_up(furuta, "turn.torque", up, bandwidth=8, energy=1), "given besides bandwidth")
    refused(lambda: es.swing_up(furuta, "turn.torque", up, energy=1, pump=1), "pump is given without bandwidth")
    assert es.swing_up(furuta, "turn.torque", up, bandwidth=8, pump=100).certificate.holds
    swing = es.swing_up(furuta, "turn.torque", up, bandwidth=8)
    balance = es.Lqr(furuta, ["turn.torque"], up, position=[0.3, 1], rate=[0.01, 0.01], effort=[100])
    n = ph.Network("furuta")
    n.add("arm", furuta)
    refused(lambda: es.hand_over(n, "arm", swing, balance, period=0), "period is not above 0")


def test_a_linearisation_in_rates_is_that_of_forward_dynamics(furuta):
    q, none = [0, pi], [0, 0]
    A, B = ph.linearise(furuta, furuta.state(q, none), rates=True)
    _, by_q, by_v, inverse = ph.aba_derivatives(furuta.mechanism, np.array(q), np.zeros(2), np.zeros(2))
    assert np.allclose(A[2:], np.hstack([by_q, by_v]), rtol=1e-10, atol=1e-9) and np.allclose(A[:2], np.eye(4)[2:])
    assert np.allclose(B[2:], inverse[:, : B.shape[1]], rtol=1e-10)
    p = ph.linearise(furuta, furuta.state(q, none))[0]
    assert np.abs(p - A).max() > 1  # control: of momenta it is another
    refused(lambda: ph.linearise(furuta, furuta.state(q, [0, 1]), rates=True), "at rest")
    refused(lambda: ph.linearise(furuta, [0, 0]), "x")
    held = ph.Network("held")
    held.add("arm", furuta)
    es.Lqr(furuta, ["turn.torque"], [0, pi], position=[0.3, 1], rate=[0.01, 0.01], effort=[100]).control(held, "law", "arm", period=0.01)
    held = held.build()
    refused(lambda: ph.linearise(held, furuta.state(q, none)), "takes no sampled law, and 'law' is one")


def test_a_linearisation_in_rates_beside_an_equilibrium_warns(furuta):
    none = [0, 0]
    with pytest.warns(UserWarning, match="linearise: the state is no equilibrium: a force or torque of .* is left at 'swing'"):
        ph.linearise(furuta, furuta.state([0, pi - 0.3], none), rates=True)
    with warnings.catch_warnings():  # controls: at rest, and of momenta, whose A is that of any state
        warnings.simplefilter("error")
        ph.linearise(furuta, furuta.state([0.4, pi], none), rates=True)
        ph.linearise(furuta, furuta.state([0, pi - 0.3], none))


def test_gains_of_a_numerical_matching_by_bandwidth(furuta):
    gains = es.numerical_matching_gains(furuta, bandwidth=10, damping_ratio=0.7, rest=[0, pi])
    loop = es.numerical_matching(furuta, actuator="turn.torque", half_width=0.4, rest=[0, pi], **gains)
    found = np.reshape(loop.certificate.item("modes").numbers, (-1, 2))
    assert np.abs(found - [10, 0.7]).max() < 0.05
    refused(lambda: es.numerical_matching_gains(furuta, bandwidth=0, rest=[0, pi]), "above 0")
