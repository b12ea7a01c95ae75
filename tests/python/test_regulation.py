"""Arms with degrees of freedom to spare, bases on wheels, moving targets, sweeps of gains."""
import math

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused

es = ph.energy_shaping


def body(name, parent, axis, position=(0, 0, 0), mass=1.0, com=(0, 0, 0), inertia=(0.02, 0, 0, 0.02, 0, 0.02), type="revolute"):
    joint = ph.JointSpec(type=type) if type == "free" else ph.JointSpec(type=type, axis=axis)
    return ph.BodySpec(name=name, parent=parent, position=position, joint=joint,
                       mass=ph.MassProperties(mass=mass, com=com, inertia=inertia))


@pytest.fixture(scope="module")
def arm():
    """Five joints, of which a place of the hand needs three."""
    b = ph.MechanismBuilder("arm")
    parent = "world"
    for k, axis in enumerate([(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)]):
        b.add(body(f"link_{k}", parent, axis, position=(0, 0, 0.3 if k else 0), com=(0, 0, 0.15)))
        parent = f"link_{k}"
    return ph.MechanicalModel(b.build())


def test_a_posture_the_hand_does_not_feel(arm):
    m, q = arm.mechanism, np.array([0.3, -0.5, 0.4, -0.8, 0.2])
    hand = ph.body_pose(m, q, "link_4")[1]
    task = es.PotentialShaping(name="hand", poses=[es.PoseSpring(link="link_4", stiffness=300, position=tuple(hand))],
                               damping=[es.PortDamping(port=f"link_{k}.torque", damping=[4]) for k in range(5)], rest=list(q))
    loop = es.NullSpaceLoop(arm, task, es.NullSpacePosture(stiffness=[5], rest=[0, 0.3, -0.2, 0.6, 0]))
    assert loop.certificate.holds, loop.certificate.text()
    assert loop.task_size == 3
    tau = np.array([1.0, -2, 0.5, 0.3, 1])
    felt = np.abs(loop.task_acceleration(q, loop.projected(q, tau))).max()
    free = np.abs(loop.task_acceleration(q, tau)).max()
    print(f"leak {felt / free:.1e} (bound 1e-12)")
    assert felt < 1e-12 * free and free > 0.1  # the control: not projected it is felt
    refused(lambda: es.NullSpaceLoop(arm, task, es.NullSpacePosture(stiffness=[5], rest=[0] * 5, level=3)), "least <= level <= most")
    refused(lambda: es.NullSpacePosture(stifness=[5]), "no 'stifness'")


def satellite(axes):
    b = ph.MechanismBuilder("satellite")
    b.add(body("base", "world", None, mass=12, inertia=(3, 0.2, -0.1, 2, 0.1, 1.5), type="free"))
    for k, axis in enumerate(axes):
        a = np.array(axis) / np.linalg.norm(axis)
        J = 0.011 * np.eye(3) + 0.009 * np.outer(a, a)
        b.add(body(f"wheel_{k}", "base", tuple(a), position=(0.1, 0.05 * k, -0.1),
                   inertia=(J[0, 0], J[0, 1], J[0, 2], J[1, 1], J[1, 2], J[2, 2])))
    return ph.MechanicalModel(b.build())


def test_a_base_on_wheels():
    model = satellite([(1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)])
    m = model.mechanism
    shaping = es.PotentialShaping(name="pose", poses=[es.PoseSpring(link="base", stiffness=4, attitude_stiffness=(1, 1.5, 2))],
                                  damping=[es.PortDamping(port="base.wrench", damping=[3, 3, 3, 6, 6, 6])],
                                  actuators=["base.wrench"], rest=list(m.neutral()))
    wheels = [f"wheel_{k}.torque" for k in range(4)]
    base = es.WheelBase(es.PotentialLoop(model, shaping), wheels)
    assert base.certificate.holds
    assert "all conditions hold" in base.certificate._repr_html_()
    assert "<td>wheel_0.torque</td><td>N m → rad/s</td>" in model._repr_html_()
    n = ph.Network("satellite under its law")
    n.add("satellite", model).main("satellite")
    base.control(n, "pose", "satellite")
    q = m.neutral()
    q[:3] = 1, -2, 0.5
    q[3:7] = math.cos(0.7), math.sin(0.7) * 0.6, 0, math.sin(0.7) * 0.8
    v = np.zeros(m.nv)
    v[6:9] = 40, -20, 30
    start = model.state(q, v)
    r = ph.simulate(n.build(), start, step=0.02, duration=60, limits={"balance": 1e-8})
    assert r.passed, str(r)
    H = [base.hamiltonian(x) for x in r.x[::50]]
    assert np.diff(H).max() < 1e-12 * H[0] and H[-1] < 1e-3 * H[0], H
    assert base.dissipation(r.x[0]) > 0
    u = base.law(start)
    assert u.shape == (model.description.nu,) and np.abs(u[:3]).max() == 0  # no moment but by the wheels
    refused(lambda: es.WheelBase(es.PotentialLoop(model, shaping), wheels[:2]), "axes", most=400)


def test_an_arm_follows_a_trajectory(arm):
    goal = es.rest_to_rest([0, 0, 0, 0, 0], [0.5, -0.4, 0.3, 0.6, -0.2], 2.0)
    q, v, a = goal.at(2.0)
    assert np.allclose(q, [0.5, -0.4, 0.3, 0.6, -0.2]) and np.abs(v).max() < 1e-12 and np.abs(a).max() < 1e-12
    pd = es.PdPlus(arm, goal, [40.0] * 5, [12.0] * 5)
    n = ph.Network("arm and its law")
    n.add("arm", arm).main("arm")
    pd.control(n, "tracking", "arm")
    x0 = arm.state([0.1, 0, 0, 0.05, 0], [0] * 5)
    r = ph.simulate(n.build(), x0, step=0.01, duration=4, limits={"balance": 1e-8})
    assert r.passed, str(r)
    first, last = pd.error(0.0, list(x0)), pd.error(4.0, list(r.x[-1]))
    assert first == pytest.approx(0.1) and last < 1e-3 * first
    energy = [pd.error_energy(t, list(x)) for t, x in zip(r["time"], r.x)]
    assert np.diff(energy).max() <= 1e-12 * energy[0] and pd.error_power(0.5, list(r.x[len(r.x) // 8])) > 0
    refused(lambda: es.sines([0] * 5, [1] * 4, [1] * 5), "amplitude has 4 entries, expected 5")
    refused(lambda: es.PdPlus(arm, goal, [40.0] * 4, [12.0] * 5), "4", most=400)
    refused(lambda: es.PdPlus(arm, es.rest_to_rest([0] * 6, [1] * 6, 2.0), [40.0] * 5, [12.0] * 5), "trajectory has 6 entries, expected 5")
    refused(lambda: pd.error(0.0, [0.0] * 9), "x", "9")


def test_a_sweep_finds_gains():
    loop = es.inertia_wheel_pendulum()
    kv = es.logarithmic(0.1, 10, 5)
    assert kv[0] == pytest.approx(0.1) and kv[-1] == pytest.approx(10)
    values = {"kv": kv}
    design = es.InertiaWheelPendulum()
    rows = es.grid([values.get(name, [getattr(design, name)]) for name in loop.gain_names])
    runs = es.sweep(loop, rows, start=[0.5, 0, 0, 0], duration=20, threads=1)
    assert [r.gains for r in runs] == rows and all(r.finite for r in runs)
    again = es.sweep(loop, rows, start=[0.5, 0, 0, 0], duration=20, threads=2)
    assert [(r.settling, r.peak, r.residual) for r in runs] == [(r.settling, r.peak, r.residual) for r in again]
    for old, now in (("left", "residual"), ("travel", "max_excursion")):
        with pytest.warns(DeprecationWarning, match=f"SweepResult.{old} is now {now}"):
            assert getattr(runs[0], old) == getattr(runs[0], now)
    best = es.fastest(runs, math.inf)
    assert runs[best].settling == min(r.settling for r in runs)
    assert es.fastest(runs, 1e-9) is None
    limit = 0.5 * runs[0].peak
    assert es.sweep(loop, rows[:1], start=[0.5, 0, 0, 0], limits=[limit])[0].peak == limit
    refused(lambda: es.sweep(loop, [[1.0]], start=[0.5, 0, 0, 0]), "gain", most=400)


def test_limits_in_a_certificate():
    """They act in its runs and their shares are told. Control: without limits the peak exceeds them, and no share is told."""
    loop = es.cart_pole()
    certify = lambda **more: es.certify(loop, lower=[-1.4, -10], upper=[1.4, 10], samples=200, starts=[[0.5, 0, 0, 0]], duration=1, **more)
    peak = "run, continuous, input peak"
    for limits in (5, [5.0]):
        c = certify(limits=limits)
        assert c.item(peak).value == 5
        assert c.item(peak).text == "100 % of its limit"
    free = certify()
    assert free.item(peak).value > 5
    assert free.item(peak).text == "" and not free.item(peak).numbers
    assert es.simulate(loop, [0.5, 0, 0, 0], duration=1, limits=5)["peak"] == [5]
    refused(lambda: certify(limits=-5), "limits[0] is -5, expected the largest |u| of an actuated input, above 0")
    refused(lambda: certify(limits=[5, 5]), "limits")


def test_the_numbers_of_a_design_are_explained():
    for design in (es.InertiaWheelPendulum, es.BallAndBeam, es.CartPole, es.Acrobot):
        for name, field in vars(design).items():
            if isinstance(field, property):
                assert field.__doc__, f"{design.__name__}.{name}"
    assert es.InertiaWheelPendulum.m3.__doc__.startswith("No mass: m g l")
