"""Dynamics on numpy arrays: one state, batches, and what is refused."""
import re

import numpy as np
import pytest

import porthos as ph

KERNELS = {
    "aba": lambda m, q, v, p, **k: ph.aba(m, q, v, v, **k),
    "rnea": lambda m, q, v, p, **k: ph.rnea(m, q, v, v, **k),
    "crba": lambda m, q, v, p, **k: ph.crba(m, q, **k),
    "jacobian": lambda m, q, v, p, **k: ph.jacobian(m, q, m.bodies[-1], **k),
    "centroidal_momentum_matrix": lambda m, q, v, p, **k: ph.centroidal_momentum_matrix(m, q, **k),
    "momenta_from_rates": lambda m, q, v, p, **k: ph.momenta_from_rates(m, q, v, **k),
    "rates_from_momenta": lambda m, q, v, p, **k: ph.rates_from_momenta(m, q, p, **k),
    "coordinate_rates": lambda m, q, v, p, **k: ph.coordinate_rates(m, q, v, **k),
    "momentum": lambda m, q, v, p, **k: ph.momentum(m, q, p, **k),
    "centre_of_mass": lambda m, q, v, p, **k: ph.centre_of_mass(m, q, **k),
    "kinetic_energy": lambda m, q, v, p, **k: ph.kinetic_energy(m, q, p, **k),
    "potential_energy": lambda m, q, v, p, **k: ph.potential_energy(m, q, **k),
}


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("n", [1, 2, 3, 8, 13, 101])
def test_a_batch_equals_its_rows_bit_for_bit(kernel, n, ets_vii, states):
    f = KERNELS[kernel]
    q, v, p = states(ets_vii, n)
    whole = f(ets_vii, q, v, p)
    rows = np.array([f(ets_vii, q[i].copy(), v[i].copy(), p[i].copy()) for i in range(n)])
    assert whole.shape == rows.shape
    assert np.array_equal(whole, rows)
    out = np.full_like(whole, np.nan)
    f(ets_vii, q, v, p, out=out)
    assert np.array_equal(out, whole)


def test_pairs_of_outputs(ets_vii, states):
    q, v, p = states(ets_vii, 11)
    for f in (lambda q, p, **k: ph.hamiltonian_field(ets_vii, q, p, **k), lambda q, p, **k: ph.forward_kinematics(ets_vii, q, **k),
              lambda q, p, **k: ph.body_pose(ets_vii, q, ets_vii.bodies[-1], **k)):
        a, b = f(q, p)
        for i in range(11):
            c, d = f(q[i].copy(), p[i].copy())
            assert np.array_equal(a[i], c) and np.array_equal(b[i], d)
        out = np.empty_like(a), np.empty_like(b)
        got = f(q, p, out=out)
        assert got[0] is out[0] and np.array_equal(out[1], b)


def test_the_algorithms_agree(ets_vii, states):
    m = ets_vii
    q, v, p = states(m)
    tau = np.linspace(-1, 1, m.nv)
    wrench = np.random.default_rng(3).uniform(-1, 1, (m.body_count, 6))
    vdot = ph.aba(m, q, v, tau, wrench)
    scale = np.abs(vdot).max()
    assert np.abs(ph.rnea(m, q, v, vdot, wrench) - tau).max() < 1e-11 * max(1, scale)
    assert np.abs(ph.rnea(m, q, v, vdot) - tau).max() > 1e-3  # negative control: the wrenches do count
    M = ph.crba(m, q)
    assert np.array_equal(M, M.T)
    assert 0.5 * v @ M @ v == pytest.approx(ph.kinetic_energy(m, q, p), rel=1e-12)
    assert np.abs(ph.rates_from_momenta(m, q, p) - v).max() < 1e-11
    R, r = ph.body_pose(m, q, m.bodies[-1])
    J = ph.jacobian(m, q, m.bodies[-1])  # world axes: its linear rows are the derivative of r
    dq = 1e-6 * ph.coordinate_rates(m, q, v)
    moved = (ph.body_pose(m, q + dq, m.bodies[-1])[1] - ph.body_pose(m, q - dq, m.bodies[-1])[1]) / 2e-6
    assert np.abs(J[3:] @ v - moved).max() < 1e-7
    A = ph.centroidal_momentum_matrix(m, q)
    assert np.abs(A[3:] @ v - ph.momentum(m, q, p)[3:]).max() < 1e-10 * np.abs(p).max()


def test_a_system_in_batches(pendulum, states):
    model = ph.MechanicalModel(pendulum)
    s = model.instantiate()
    q, v, p = states(pendulum, 21)
    x = np.hstack([q, p])
    u = np.ones((21, 2))
    for f in (s.hamiltonian, s.gradient, lambda x: s.field(0.0, x), s.stored, s.invariants):
        assert np.array_equal(f(x), np.array([f(row.copy()) for row in x]))
    assert np.array_equal(s.field(0.0, x, u), np.array([s.field(0.0, a.copy(), np.ones(2)) for a in x]))
    H = s.hamiltonian(x)
    V, T = ph.potential_energy(pendulum, q), ph.kinetic_energy(pendulum, q, p)
    assert np.abs(H - V - T).max() < 1e-12 * np.abs(H).max()
    e = s.gradient(x)
    assert np.abs(np.einsum("ij,ij->i", e, s.field(0.0, x))).max() < 1e-12  # lossless
    y = s.output(x, e)
    assert np.abs(y - v).max() < 1e-12


# --- what is refused ------------------------------------------------------------------------------------------------------
def refused(call, *words, most=220):
    with pytest.raises(ph.InvalidArgument) as e:
        call()
    text = str(e.value)
    assert all(w in text for w in words), text
    text = re.sub(r"/\S*/", "", text)  # as long in every folder
    assert "\n" not in text and len(text) < most, text


def test_wrong_arrays_are_refused_with_name_got_and_expected(ets_vii, states):
    m = ets_vii
    q, v, p = states(m, 10)
    one_q, one_v, _ = states(m)
    refused(lambda: ph.aba(m, one_q.astype("f4"), one_v), "q has dtype float32", "expected float64")
    refused(lambda: ph.aba(m, one_q, one_v.astype(int)), "v has dtype int64", "expected float64")
    refused(lambda: ph.aba(m, one_q.astype(">f8"), one_v), "q has dtype >f8", "expected float64")
    refused(lambda: ph.aba(m, list(one_q), one_v), "q is a list", "expected a numpy array of float64")
    refused(lambda: ph.aba(m, None, one_v), "q is a NoneType")
    refused(lambda: ph.aba(m, q[:, :5], v), "q has shape (10, 5)", "(13,) or (n, 13)")
    refused(lambda: ph.aba(m, q[None], v), "q has shape (1, 10, 13)")
    refused(lambda: ph.aba(m, np.asfortranarray(q), v), "q is not contiguous in C order", "strides")
    refused(lambda: ph.aba(m, np.repeat(q, 2, axis=0)[::2], v), "q is not contiguous in C order")
    refused(lambda: ph.aba(m, q.T.copy().T, v), "q is not contiguous in C order")
    refused(lambda: ph.aba(m, q, v[:9]), "v has shape (9, 12)", "expected (10, 12)", "q")
    refused(lambda: ph.aba(m, q, one_v), "v has shape (12,)", "expected (10, 12)")
    refused(lambda: ph.aba(m, one_q, v), "v has shape (10, 12)", "expected (12,)")
    refused(lambda: ph.aba(m, q, v, wrench=np.zeros((10, 6))), "wrench has shape (10, 6)", "expected (10, 7, 6)")
    refused(lambda: ph.aba(m, q, v, out=np.empty((10, 13))), "out has shape (10, 13)", "expected (10, 12)")
    refused(lambda: ph.aba(m, q, v, out=v), "out shares memory with v")
    frozen = np.empty((10, 12))
    frozen.flags.writeable = False
    refused(lambda: ph.aba(m, q, v, out=frozen), "out is read-only")
    refused(lambda: ph.jacobian(m, q, "hand"), "hand")
    refused(lambda: ph.jacobian(m, q, m.bodies[0], axes="local"), "'local'", "'body' or 'world'")
    refused(lambda: ph.hamiltonian_field(m, q, p, out=q), "out is", "a tuple of two arrays")
    misaligned = np.frombuffer(bytearray(8 * 13 + 1), dtype="u1")[1:].view("f8")
    refused(lambda: ph.aba(m, misaligned, one_v), "q")


def test_nothing_is_written_where_something_is_refused(pendulum, states):
    q, v, _ = states(pendulum, 4)
    out = np.full((4, 2), 7.0)
    refused(lambda: ph.aba(pendulum, q, v, np.zeros((4, 3)), out=out), "tau")
    assert (out == 7).all()


def test_empty_batches(pendulum):
    assert ph.aba(pendulum, np.empty((0, 2)), np.empty((0, 2))).shape == (0, 2)


def test_a_fixed_base_without_gravity_has_a_note(source):
    urdf = source / "examples/ets_vii/ets_vii.urdf"
    notes = lambda **given: " ".join(map(str, ph.read_urdf(urdf, accept_unphysical_inertia=True, **given).notes))
    says = "there is no gravity, for none is stated: expected gravity=(0, 0, -9.81)"
    assert says in notes() and not any(says in notes(**given) for given in (dict(gravity=(0, 0, 0)), dict(gravity=(0, 0, -9.81)), dict(base="free")))


def test_builders_and_readers_refuse(source, tmp_path):
    refused(lambda: ph.BodySpec(nane="a"), "BodySpec", "nane")
    refused(lambda: ph.JointSpec(axis=(0, 1)), "axis has 2 numbers, expected 3")
    refused(lambda: ph.JointSpec(axis="xyz"), "axis is a str")
    refused(lambda: ph.MassProperties(axes=[[1, 0], [0, 1]]), "axes has shape (2, 2), expected (3, 3)")
    b = ph.MechanismBuilder("m")
    b.add(ph.BodySpec(name="a", parent="world", joint=ph.JointSpec(type="hinge")))
    refused(b.build, "hinge")
    refused(lambda: ph.read_urdf(tmp_path / "none.urdf"), "none.urdf")
    refused(lambda: ph.read_urdf(source / "examples/ets_vii/ets_vii.urdf", base="floating"), "'floating'", "'fixed' or 'free'")


def test_workspaces_of_many_mechanisms(states):
    from conftest import rod

    made = []
    for k in range(20):  # more than are kept per thread
        b = ph.MechanismBuilder(f"m{k}")
        for i in range(k % 4 + 1):
            b.add(rod(f"b{i}", "world" if i == 0 else f"b{i - 1}", 0 if i == 0 else -1))
        made.append(b.gravity((0, 0, -9.81)).build())
    for m in made + made[::-1]:
        q, v, p = states(m)
        assert np.abs(ph.rnea(m, q, v, ph.aba(m, q, v))).max() < 1e-10


def test_threads_share_a_mechanism_and_a_system(ets_vii, states):
    from concurrent.futures import ThreadPoolExecutor

    q, v, p = states(ets_vii, 64)
    s = ph.MechanicalModel(ets_vii).instantiate()
    x = np.hstack([q, p])
    want = ph.aba(ets_vii, q, v), s.field(0.0, x)
    with ThreadPoolExecutor(4) as pool:
        got = list(pool.map(lambda _: (ph.aba(ets_vii, q, v), s.field(0.0, x)), range(40)))
    assert all(np.array_equal(a, want[0]) and np.array_equal(b, want[1]) for a, b in got)


def test_derivatives_of_the_dynamics(ets_vii, states):
    m = ets_vii
    q, v, _ = states(m)
    given = np.linspace(-1, 1, m.nv)
    wrench = np.random.default_rng(4).uniform(-1, 1, (m.body_count, 6))
    tau, dq, dv = ph.rnea_derivatives(m, q, v, given, wrench)
    vdot, aq, av, inverse = ph.aba_derivatives(m, q, v, given, wrench)
    assert np.abs(tau - ph.rnea(m, q, v, given, wrench)).max() < 1e-12 * np.abs(tau).max()
    assert np.array_equal(vdot, ph.aba(m, q, v, given, wrench))
    assert np.abs(inverse @ ph.crba(m, q) - np.eye(m.nv)).max() < 1e-11
    # along a direction of all twists, against central differences: 6e-10 of their own
    e, h = np.random.default_rng(5).uniform(-1, 1, m.nv), 1e-5
    step = h * ph.coordinate_rates(m, q, e)
    for value, by_q, by_v in ((lambda q, v: ph.rnea(m, q, v, given, wrench), dq, dv),
                              (lambda q, v: ph.aba(m, q, v, given, wrench), aq, av)):
        moved = (value(q + step, v) - value(q - step, v)) / (2 * h)
        assert np.abs(by_q @ e - moved).max() < 1e-7 * np.abs(moved).max()
        pushed = (value(q, v + h * e) - value(q, v - h * e)) / (2 * h)
        assert np.abs(by_v @ e - pushed).max() < 1e-7 * np.abs(pushed).max()
        assert np.abs(by_q.T @ e - moved).max() > 1e-2 * np.abs(moved).max()  # control: not symmetric
    Q, V, A = np.tile(q, (11, 1)), np.tile(v, (11, 1)), np.tile(given, (11, 1))
    W = np.tile(wrench, (11, 1, 1))
    for one, all_rows in zip(ph.aba_derivatives(m, q, v, given, wrench), ph.aba_derivatives(m, Q, V, A, W)):
        assert all(np.array_equal(row, one) for row in all_rows)


def test_the_inertial_regressor(states):
    b = ph.MechanismBuilder("two")
    bodies = (("a", "world", (0.1, 0.2, -0.3), 2.0), ("b", "a", (0.0, -0.1, 0.4), 3.0))
    for name, parent, com, mass in bodies:
        b.add(ph.BodySpec(
            name=name, parent=parent, position=(0, 0, -1), joint=ph.JointSpec(type="revolute", axis=(1, 2, 0)),
            mass=ph.MassProperties(mass=mass, com=com, inertia=(0.3, 0.02, -0.01, 0.4, 0.03, 0.5))))
    m = b.gravity((0, 0, -9.81)).build()
    q, v, _ = states(m)
    vdot = np.array([0.4, -1.1])
    theta = []
    for _, _, c, mass in bodies:
        c, I = np.array(c), np.array([[0.3, 0.02, -0.01], [0.02, 0.4, 0.03], [-0.01, 0.03, 0.5]])
        I = I + mass * (c @ c * np.eye(3) - np.outer(c, c))
        theta += [mass, *(mass * c), *I[np.triu_indices(3)]]
    Y = ph.inertial_regressor(m, q, v, vdot)
    assert Y.shape == (2, 20)
    tau = ph.rnea(m, q, v, vdot)
    assert np.abs(Y @ theta - tau).max() < 1e-14 * np.abs(tau).max()
    assert np.abs(Y[:, :10] @ theta[:10] - tau).max() > 0.1 * np.abs(tau).max()  # control: one body left out
