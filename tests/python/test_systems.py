"""Systems, laws and networks: those of C++ and those written in Python, under one contract."""
import math

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused


def test_a_python_system_passes_the_checker(duffing):
    report = ph.check(ph.UserModel(duffing()))
    assert report.holds, report.text()
    names = {a.axiom for a in report.axioms}
    assert {"J skew", "R symmetric", "R >= 0", "gradient", "field", "power balance"} <= names
    print(report)


@pytest.mark.parametrize("method, axiom", [
    ("gradient", "gradient"), ("dissipation", "R >= 0"), ("structure", "J skew")])
def test_the_checker_catches_wrong_python_systems(duffing, method, axiom):
    class Wrong(duffing):
        pass

    wrong = {"gradient": lambda self, x: np.array([x[0] ** 3 - 1.01 * x[0], x[1]]),
             "dissipation": lambda self, x, e: np.array([0.0 * e[0], -0.1 * e[1]]),
             "structure": lambda self, x, e: np.array([e[1], -1.001 * e[0]])}
    setattr(Wrong, method, wrong[method])
    report = ph.check(ph.UserModel(Wrong()))
    assert not report.holds
    assert not next(a for a in report.axioms if a.axiom == axiom).holds


def test_a_gradient_left_out_is_taken_by_duals(duffing):
    class Bare:
        description = lambda self: ph.Description(name="bare", nx=2, traits=ph.Traits(canonical=True),
                                                  blocks=[ph.Block(name="q", momentum=1)])
        hamiltonian = lambda self, x: np.sin(x[0]) * np.exp(0.1 * x[1]) + x[1] ** 2 / np.sqrt(2 + np.cos(x[0])) + np.tanh(x[1]) ** 3

    s = ph.UserModel(Bare()).instantiate()
    x = np.array([0.3, -0.4])
    h = 1e-6
    central = [(s.hamiltonian(x + h * d) - s.hamiltonian(x - h * d)) / (2 * h) for d in np.eye(2)]
    assert np.abs(s.gradient(x) - central).max() < 1e-9
    batch = np.linspace(-1, 1, 22).reshape(11, 2)
    assert np.array_equal(s.gradient(batch), np.array([s.gradient(r.copy()) for r in batch]))


def test_a_python_system_runs_as_its_c_plus_plus_twin():
    """The harmonic oscillator, by Python and by an inertia on a spring: the same numbers but for rounding."""

    class Oscillator:
        def description(self):
            return ph.Description(name="oscillator", nx=2, traits=ph.Traits(canonical=True), blocks=[ph.Block(name="q", momentum=1)])

        def hamiltonian(self, x):
            return 5 * x[0] ** 2 + x[1] ** 2 / 4

        def gradient(self, x):
            return np.array([10 * x[0], x[1] / 2])

    ours = ph.simulate(ph.UserModel(Oscillator()), [0.1, 0.3], step=0.05, duration=20, limits={"energy": 1e-14})
    n = ph.Network("mass on a spring")
    n.add("spring", ph.spring_element(ph.spring(10), "translation")).add("mass", ph.inertia_element(2, "translation"))
    n.feedback("mass.body", "spring.ends")
    theirs = ph.simulate(n.build(), [0.1, 0.3], step=0.05, duration=20, limits={"energy": 1e-14})
    assert ours.passed and theirs.passed, f"{ours}\n{theirs}"
    assert np.abs(ours.x - theirs.x).max() < 1e-14
    assert ours.summary["energy"]["max_rel_error"] < 1e-15  # measured in longdouble: the Python code was given such


def test_a_comparison_needs_quads_and_gets_them(duffing):
    class Lossless(duffing):
        damping = 0.0

    c = ph.compare(ph.UserModel(Lossless()), [1.2, 0.0], step=0.1, duration=2, methods=["gauss4", "rk4"], budget=2, progress=False)
    assert {r["method"] for r in c.content["runs"]} == {"gauss4", "rk4"}
    assert c.content["trajectory"]["reference"]
    assert "gauss4" in str(c)


def test_exceptions_of_python_systems_come_through(duffing):
    class Broken(duffing):
        def gradient(self, x):
            if x[0] < 0.5:
                raise ZeroDivisionError("beyond the model")
            return duffing.gradient(self, x)

    with pytest.raises(ZeroDivisionError, match="beyond the model"):
        ph.simulate(ph.UserModel(Broken()), [0.6, -1.0], step=0.01, duration=10)

    class Short(duffing):
        def gradient(self, x):
            return np.zeros(3)

    refused(lambda: ph.UserModel(Short()).instantiate().gradient(np.zeros(2)), "system 'Duffing': gradient returned 3 numbers, expected 2")

    class Silent(duffing):
        def hamiltonian(self, x):
            pass

    refused(lambda: ph.UserModel(Silent()).instantiate().hamiltonian(np.zeros(2)), "hamiltonian returned a NoneType, expected a number")
    refused(lambda: ph.UserModel(object()), "description")


def test_what_a_system_lacks_is_said():
    class NoInput:
        description = lambda self: ph.Description(name="x", nx=2, nu=1)
        hamiltonian = lambda self, x: x[0]

    refused(lambda: ph.UserModel(NoInput()), "1 inputs", "input(x, u)")

    class Odd:
        description = lambda self: ph.Description(name="x", nx=3)
        hamiltonian = lambda self, x: x[0]

    refused(lambda: ph.UserModel(Odd()), "3 states", "structure(x, e)")


def test_slices_that_do_not_fit_are_refused():
    block = lambda name="q", **at: ph.Block(name=name, **{"at": 0, "momentum": 2, **at})
    port = lambda **at: ph.Port(name="f", kind=ph.PortKind.effort_in, **at)

    def model(blocks, ports=()):
        class Masses:
            description = lambda self: ph.Description(name="masses", nx=4, nu=1, traits=ph.Traits(canonical=True), blocks=blocks, ports=list(ports))
            hamiltonian = lambda self, x: 0.5 * (x[2] ** 2 + x[3] ** 2)
            input = lambda self, x, u: np.array([0 * u[0], 0 * u[0], u[0], 0 * u[0]])

        return ph.UserModel(Masses())

    beyond = "expected a slice within 0..4 of x (nx=4)"
    for blocks, ports, *said in (([block(momentum=400000)], [], "block 'q' has momentum=400000 and size=1", beyond),
                                 ([block(at=7)], [], "block 'q' has at=7 and size=1", beyond), ([block(at=-2)], [], "block 'q' has at=-2", beyond),
                                 ([block(size=5)], [], "block 'q' has at=0 and size=5", beyond),
                                 ([block(), block("r", momentum=-1)], [], "block 'r' has at=0 and size=1 in x, where block 'q'", "do not overlap"),
                                 ([block(momentum=3), block("r", at=1, momentum=2)], [], "block 'q' has at=0 and momentum=3, expected momentum=2"),
                                 ([], [port(at=3)], "port 'f' has at=3 and size=1, expected a slice within 0..1 of u (nu=1)"),
                                 ([], [port(size=4)], "port 'f' has at=0 and size=4")):
        refused(lambda: model(blocks, ports), "system 'masses': ", *said)
    fits = model([block(), block("r", at=1, momentum=3)], [port()])  # control
    assert ph.check(fits).holds and ph.simulate(fits, [0, 0, 1, 0], step=0.1, duration=1)["state/q"][-1] == pytest.approx(1, rel=1e-14)


def test_a_gradient_is_asked_for_where_duals_do_not_replace_it():
    class Bare:
        description = lambda self: ph.Description(name="bare", nx=2, traits=ph.Traits(canonical=True), blocks=[ph.Block(name="q", momentum=1)])
        hamiltonian = lambda self, x: 0.5 * (x[0] ** 2 + x[1] ** 2)

    class Whole(Bare):
        gradient = lambda self, x: np.array([x[0], x[1]])

    for call in (lambda m: ph.compare(m, [1.0, 0.0], step=0.1, duration=1, methods=["gauss4"], budget=1, progress=False),
                 lambda m: ph.monodromy(m, [1.0, 0.0], step=0.1, steps=5, method="gauss4")):
        refused(lambda: call(ph.UserModel(Bare())), "system 'bare' has no gradient(x), expected a gradient(x) for compare, monodromy, derivatives and 113 bits")
        call(ph.UserModel(Whole()))  # control
    assert ph.simulate(ph.UserModel(Bare()), [1.0, 0.0], step=0.1, duration=1)["state/q"][-1] == pytest.approx(math.cos(1.0), abs=1e-12)


def test_duals_and_quads():
    d = ph.Dual(0.7, 1.0)
    for f, derivative in [(np.sin, math.cos(0.7)), (np.cos, -math.sin(0.7)), (np.exp, math.exp(0.7)), (np.log, 1 / 0.7),
                          (np.sqrt, 0.5 / math.sqrt(0.7)), (np.tanh, 1 - math.tanh(0.7) ** 2), (np.tan, 1 / math.cos(0.7) ** 2),
                          (np.sinh, math.cosh(0.7)), (np.cosh, math.sinh(0.7)), (np.square, 1.4)]:
        assert f(np.array([d], dtype=object))[0].d == pytest.approx(derivative, rel=1e-14)
    assert (d ** 3).d == pytest.approx(3 * 0.49) and (d ** -0.5).d == pytest.approx(-0.5 * 0.7 ** -1.5)
    assert (2 / d - 1).d == pytest.approx(-2 / 0.49)
    third = 1 / ph.Quad(3)
    assert float(third * 3 - 1) == 0 and abs(float(third - 1 / 3)) > 1e-18  # the double is 1.9e-17 away
    A = np.array([[2.0, 1.0], [1.0, 3.0]])
    x = np.array([ph.Dual(1, 1), ph.Dual(2)], dtype=object)
    assert (x @ A @ x).v == 18 and (x @ A @ x).d == 8


# --- networks -------------------------------------------------------------------------------------------------------------
def two_masses(law=None, period=0.0):
    n = ph.Network("two masses")
    n.add("a", ph.inertia_element(2, "translation")).add("b", ph.inertia_element(3, "translation"))
    n.add("spring", ph.spring_element(ph.spring(10), "translation"))
    n.zero_junction("ends", ["spring.ends", "a.body", ("b.body", -1)])
    n.resist("damper", ["a.body", "b.body"], [[0.5, -0.5], [-0.5, 0.5]])
    n.source("push", "a.body", ph.sine(1.0, 0.5))
    if law:
        n.control("servo", "b.body", law, period=period)
    return n.build()


def test_a_network_closes_its_ledger():
    model = two_masses()
    assert ph.check(model).holds
    r = ph.simulate(model, [0, 0, 0.1], step=0.01, duration=20, limits={"balance": 1e-12})
    assert r.passed, str(r)
    supplied, lost = r["supplied/push"][-1], r["dissipated/damper"][-1]
    stored = sum(v[-1] - v[0] for v in r.group("stored").values())
    assert abs(stored - supplied + lost) < 1e-12 and lost > 1e-3
    assert set(r.group("stored")) == {"a.energy", "b.energy", "spring.energy"}


def test_python_laws_are_controllers_and_elements():
    damper = two_masses(ph.law(lambda t, x, y: -0.4 * y))
    r = ph.simulate(damper, [0, 0, 0.1], step=0.01, duration=10, limits={"balance": 1e-12})
    assert r.passed and r["supplied/servo"][-1] < 0
    n = ph.Network("the same as an element")
    n.add("m", ph.inertia_element(2, "translation")).source("push", "m.body", ph.function(lambda t: np.sin(3 * t)))
    n.resist("damper", "m.body", ph.function(lambda v: 0.4 * v + 0.1 * v ** 3))
    assert ph.check(n.build()).holds
    r = ph.simulate(n.build(), [0.0], step=0.01, duration=10, limits={"balance": 1e-10})
    assert r.passed, str(r)
    held = ph.simulate(two_masses(ph.law(lambda t, x, y: -0.4 * y), period=0.05), [0, 0, 0.1], step=0.01, duration=10)
    assert "supplied/servo.hold" in held.names


class Integral:
    """u = 8 e - y + 6 (the sum of e over the instants) period, e = 1 - x[0]."""

    def __init__(self):
        self.sum, self.calls = 0.0, 0

    def __call__(self, t, x, y):
        self.sum += 0.02 * (1 - x[0])
        self.calls += 1
        return np.array([8 * (1 - x[0]) - y[0] + 6 * self.sum])


SLIDER = """<robot name="slider"><link name="base"/>
<link name="m"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="rail" type="prismatic"><parent link="base"/><child link="m"/><axis xyz="1 0 0"/></joint></robot>"""


def slider(joined):
    """A mass of 2 kg on a rail, x = (place, momentum), in a network with its controllers."""
    n = ph.Network("slider")
    n.add("m", ph.MechanicalModel(ph.parse_urdf(SLIDER, base="fixed").mechanism))
    return joined(n).build()


def test_a_law_that_remembers_acts_at_the_instants_alone():
    law = Integral()
    model = slider(lambda n: n.control("law", ["m.rail.force"], law, period=0.02))
    r = ph.simulate(model, [0.0, 0.0], method="gauss8", step=0.005, duration=5, limits={"balance": 1e-9})
    assert r.passed and law.calls == 0, "runs use copies"
    x, v, total = 0.0, 0.0, 0.0
    for _ in range(250):  # a mass alone: exact under a held force
        total += 0.02 * (1 - x)
        u = 8 * (1 - x) - v + 6 * total
        x, v = x + 0.02 * v + 0.5 * 0.02 ** 2 * u / 2.0, v + 0.02 * u / 2.0
    assert abs(r["state/rail"][-1] - x) < 1e-11, (r["state/rail"][-1], x)
    again = ph.simulate(model, [0.0, 0.0], method="gauss8", step=0.005, duration=5)
    assert again["state/rail"][-1] == r["state/rail"][-1], "each run begins with the object as it was given"
    refused(lambda: slider(lambda n: n.control("law", ["m.rail.force"], ph.law(lambda t, x, y: -y), period=0.02)), "one port")
    refused(lambda: slider(lambda n: n.control("law", ["m.rail.force"], lambda t, x, y: -y, period=0.02)), "stateless")
    refused(lambda: slider(lambda n: n.control("law", ["m.rail.force"], 5, period=0.02)), "no method __call__(self, t, x, y)")
    law.file = open(__file__)
    refused(
        lambda: slider(lambda n: n.control("law", ["m.rail.force"], law, period=0.02)),
        "a run copies Integral and its attributes, its state, and cannot (cannot pickle '_io.TextIOWrapper' object), ",
        "expected such things outside the object, as globals",
    )


def test_a_function_that_remembers_is_no_law():
    model = slider(lambda n: n.control("law", "m.rail.force", ph.law(Integral()), period=0.02))
    refused(lambda: ph.simulate(model, [0.0, 0.0], method="gauss8", step=0.005, duration=5), "it remembers something", "[ports]")
    control = slider(lambda n: n.control("law", "m.rail.force", ph.law(lambda t, x, y: 8 * (1 - x[:1]) - y), period=0.02))
    assert ph.simulate(control, [0.0, 0.0], method="gauss8", step=0.005, duration=1).passed


def test_networks_refuse():
    n = ph.Network("n")
    n.add("a", ph.inertia_element(2)).add("b", ph.inertia_element(2))
    refused(lambda: n.feedback("a.body", "b.body"), "a.body", "b.body", most=400)
    refused(lambda: n.source("s", "c.body", ph.constant(1)), "c.body")
    refused(lambda: n.couple(["a.body", "b.body"], [[0, 1], [1, 0]]), "skew")
    refused(lambda: n.couple(["a.body", "b.body"], [[0, 1], [1]]), "row 1 of K has 1 numbers, expected 2")
    refused(lambda: n.one_junction("j", [5]), "an end is a int")
    refused(lambda: ph.inertia_element(2, "rotaton"), "'rotaton'")


# --- controllers and actuators --------------------------------------------------------------------------------------------
def test_a_design_in_python():
    es = ph.energy_shaping
    loop = es.inertia_wheel_pendulum()
    assert loop.certificate.holds and "M_d > 0" in loop.certificate.text()
    r = es.simulate(loop, [3.0, 0, 0, 0], duration=30, step=0.005)
    assert r["finished"] and r["H"][-1] < 1e-2 * r["H"][0] + 1e-12 or r["H"][-1] - loop.instantiate().hamiltonian(np.zeros(4)) < 1e-2
    u = loop.law(0.0, np.array([0.1, 0, 0, 0]))
    assert u.shape == (1,) or u.shape == (loop.plant.description.nu,)
    refused(lambda: es.inertia_wheel_pendulum(es.InertiaWheelPendulum(a2=-0.5)), "a1 + a2")


def test_regulation_of_an_arm_on_its_ports(pendulum):
    es = ph.energy_shaping
    model = ph.MechanicalModel(pendulum)
    shaping = es.joint_regulation(model, [0.4, -0.2], 3.0, 0.8)
    loop = es.PotentialLoop(model, shaping)
    assert loop.certificate.holds
    n = ph.Network("arm under its law")
    n.add("arm", model)
    es.control(n, "law", "arm", loop)
    r = ph.simulate(n.build(), model.state([0, 0], [0, 0]), step=0.02, duration=12, limits={"balance": 1e-9})
    assert r.passed, str(r)
    assert np.abs(r.x[-1, :2] - [0.4, -0.2]).max() < 1e-3
    assert es.joint_regulation(model, [0, 0], 3, 0.8, skip=["lower"]).actuators == ["upper.torque"]
    refused(lambda: es.joint_regulation(model, [0, 0], 3, 0.8, skip=["lowr"]), "skip 'lowr'", "upper.torque, lower.torque")
    wrong = es.PotentialShaping(joints=[es.JointSpring(port="upper.torque", stiffness=1)], rest=[0.4, -0.2], actuators=["upper.torque"])
    refused(lambda: es.PotentialLoop(model, wrong), "joint 'lower' needs a force no actuator provides: choose a rest at which it hangs", "expected at most", most=400)


def test_actuators_of_the_catalogue(pendulum):
    vsa = ph.vsa
    assert "qbmove_advanced" in [d.name for d in vsa.devices()]
    elastic = vsa.elastic_of(vsa.device("qbmove_advanced"))
    h = 1e-5
    E = lambda q: elastic.energy(q, 0.1, 0.2)
    assert elastic.slopes(0.3, 0.1, 0.2)[0] == pytest.approx((E(0.3 + h) - E(0.3 - h)) / (2 * h), rel=1e-8)
    assert elastic.hessian(0.3, 0.1, 0.2)[0, 0] == elastic.stiffness(0.3, 0.1, 0.2)
    q, sigma = np.linspace(-0.3, 0.3, 7), np.array([[0.1], [0.2]])
    for many in (elastic.energy, elastic.stiffness, lambda *at: elastic.slopes(*at)[2], elastic.hessian):
        grid = many(q, 0.1, sigma)  # broadcast as numpy does
        assert grid.shape[:2] == (2, 7) and all(np.array_equal(grid[j, i], many(q[i], 0.1, sigma[j, 0])) for j in range(2) for i in range(7))
    assert type(elastic.stiffness(0.3, 0)) is float and elastic.hessian(0.3, 0).shape == (3, 3) and elastic.loop == 0
    with pytest.raises(ValueError, match="broadcast"):
        elastic.energy(q, np.zeros(3))
    refused(lambda: vsa.device("qbmove"), "qbmove_advanced", most=500)
    assert vsa.families()["series_elastic"]["k"] == "N m/rad"
    spring = vsa.make_elastic("series_elastic", k=100.0)
    assert spring.energy(0.1, 0) == pytest.approx(0.5)
    refused(lambda: vsa.make_elastic("series_elastic", kk=100.0), "kk", most=500)
    a = vsa.Actuator(elastic=spring, theta=vsa.Drive(kind=vsa.Drive.Kind.torque, inertia=0.01, command=ph.sine(1.0, 0.5)))
    n = ph.Network("elastic arm")
    n.add("arm", ph.MechanicalModel(pendulum)).main("arm")
    vsa.attach(n, "motor", "arm.upper.torque", a)
    model = n.build()
    x = np.concatenate([np.zeros(4), vsa.actuator_start("motor", a, 0.0, 0.0)])
    r = ph.simulate(model, x, step=0.01, duration=5, limits={"balance": 1e-10})
    elsewhere = np.concatenate([np.zeros(4), vsa.actuator_start("motor", a, 0.2, 0.2)])  # control: x above
    refused(lambda: ph.simulate(model, elsewhere, step=0.01, duration=5), "starts with link = 0.2 rad and its joint 'upper' at 0 rad")
    assert r.passed and "stored/motor.spring" in r.names and abs(r["supplied/motor.theta.torque"][-1]) > 1e-3, str(r)


def test_energies_by_formula_and_by_function(pendulum):
    vsa = ph.vsa
    limits = vsa.Limits(sigma_lower=-0.8, sigma_upper=0.8)
    device = vsa.make_elastic("cosh", a=6.7328, k=0.0222, limits=limits)
    a, k = 6.7328, np.float64(0.0222)
    text = vsa.formula("k/a*(cosh(a*(phi - sigma)) + cosh(a*(phi + sigma)) - 2)", a=a, k=k, limits=limits)
    traced = vsa.formula(lambda phi, sigma: k / a * (np.cosh(a * (phi - sigma)) + np.cosh(a * (phi + sigma)) - 2), limits=limits)
    places = [(q, 0.1, sigma) for q in np.linspace(-0.6, 0.6, 13) for sigma in (-0.5, 0.0, 0.7)]
    for p in places:
        assert traced.hessian(*p).tolist() == text.hessian(*p).tolist()  # the same signs in the same order
    off = max(np.abs(np.subtract(text.slopes(*p), device.slopes(*p))).max() for p in places)
    assert off < 1e-13 * max(np.abs(device.slopes(*p)).max() for p in places), off  # formula_test.cpp derives it
    other = vsa.formula(lambda phi, sigma: k / a * (np.cosh(a * (phi - sigma)) + np.cosh(a * phi) - 2), limits=limits)
    assert abs(other.slopes(0.3, 0, 0.2)[0] - device.slopes(0.3, 0, 0.2)[0]) > 1e-3  # control
    assert text.sigma and not vsa.formula("k*phi^2", k=2.0).sigma

    # Every sign and function as numpy has it.
    small = vsa.Limits(deflection=0.5, stop_stiffness=1)
    functions = [lambda x: 5 * x**2 - -x - 1 / (3 + x) + abs(x)**3 + (+x), lambda x: np.exp(x) + np.sin(x) + 9 * np.square(x),
                 lambda x: np.log(3 + x) + np.sqrt(2 + x) + 4 * x * x, lambda x: np.tan(x / 2) + np.sinh(x) + 9 * x**2,
                 lambda x: np.tanh(x) + np.arctan(x) + 9 * x**2 - np.cos(x), lambda x: np.maximum(x, 0)**3 + np.minimum(0, x)**4 + x**2,
                 lambda x: np.polyval([3, 1, 4, 0, 0], x), lambda x: np.cosh(np.array([x, 2 * x])).sum()]
    for i, f in enumerate(functions):
        e = vsa.formula(f, limits=small)
        for x in (-0.4, 0.1, 0.3):
            assert e.energy(x, 0) == pytest.approx(f(x), rel=1e-14), (i, e.title)

    refused(lambda: vsa.formula("k*ph^2", k=2.0), "unknown name 'ph' at character 3, the nearest known one is 'phi'", most=400)
    refused(lambda: vsa.formula(lambda phi: -phi * phi), "the stiffness is -2 N m/rad", most=400)
    for wrong, words in ((lambda phi: phi if phi > 0 else -phi, "instead of a comparison"),
                         (lambda phi: math.sin(phi), "numpy's functions, numpy.sin"),
                         (lambda phi: np.arcsin(phi), "numpy.arcsin is not in an energy"),
                         (lambda phi: phi * "k", "not str"), (lambda phi: np.array([1.0, 2.0]) * phi, r"not an array of shape \(2,\), expected its terms"),
                         (lambda phi: np.array([phi]), r"not an array of shape \(1,\)"), (lambda a, b, c: a, "the energy takes 3 arguments, expected .phi. or .phi, sigma."), (5, "the energy is 5, expected a text or a function")):
        with pytest.raises(TypeError, match=words):
            vsa.formula(wrong)

    e = vsa.formula(lambda phi: 5 * phi**2 + 40 * phi**4)
    motor = vsa.Actuator(elastic=e, theta=vsa.Drive(kind=vsa.Drive.Kind.torque, inertia=0.01, command=ph.sine(1.0, 0.5)))
    n = ph.Network("elastic arm")
    n.add("arm", ph.MechanicalModel(pendulum)).main("arm")
    vsa.attach(n, "motor", "arm.upper.torque", motor)
    x = np.concatenate([np.zeros(4), vsa.actuator_start("motor", motor, 0.0, 0.0)])
    assert ph.simulate(n.build(), x, step=0.01, duration=5, limits={"balance": 1e-10}).passed


def test_springs_on_an_attitude_and_on_a_place():
    ball = ph.BodySpec(name="body", parent="world", joint=ph.JointSpec(name="tether", type="free"),
                       mass=ph.MassProperties(mass=2, com=(0, 0, 0), inertia=(0.3, 0, 0, 0.3, 0, 0.3)))
    m = ph.MechanicalModel(ph.MechanismBuilder("ball").add(ball).build())
    n = ph.Network("ball on springs")
    n.add("m", m).main("m")
    n.potential("turning", "m.tether.attitude", ph.attitude_spring(4.0, rest=(0.8, 0.6, 0, 0)))
    n.potential("place", "m.tether.position", ph.place_spring(5.0, rest=(0.1, 0, 0)))
    model = n.build()
    assert ph.check(model).holds, ph.check(model).text()
    # Turned by the angle of the rest attitude, and a metre from the rest.
    x = m.state(np.array([1.1, 0, 0, 1, 0, 0, 0]), np.zeros(6))
    angle = 2 * math.acos(0.8)
    assert model.instantiate().hamiltonian(x) == pytest.approx(4 * (1 - math.cos(angle)) + 2.5, rel=1e-14)
    refused(lambda: n.potential("again", "m.tether.position", ph.attitude_spring(1.0)),
            "expected one of 4 numbers")


def test_a_derivative_is_never_lost_without_a_word():
    def by_array(x):
        a = np.zeros(2)
        a[0], a[1] = x[0], x[1]
        return 0.5 * a @ a

    for energy in (lambda x: math.sqrt(1 + x[0] ** 2 + x[1] ** 2), lambda x: sum(0.5 * float(v) ** 2 for v in x), by_array):
        class Bare:
            description = lambda self: ph.Description(name="bare", nx=2, traits=ph.Traits(canonical=True), blocks=[ph.Block(name="q", momentum=1)])
            hamiltonian = lambda self, x, energy=energy: energy(x)

        with pytest.raises(TypeError, match="carries a derivative"):
            ph.simulate(ph.UserModel(Bare()), [0.6, -1.0], step=0.01, duration=0.1)


def test_a_bristle_holds_and_what_would_make_energy_is_refused():
    law = dict(coulomb=1.0, breakaway=1.5, stribeck=0.01, viscous=10, bristle_stiffness=1e4, bristle_damping=20)

    def block(push, **changes):
        n = ph.Network("block")
        n.add("mass", ph.inertia_element(1, "translation")).source("push", "mass.body", ph.constant(push))
        return n.lugre("rub", "mass.body", **{**law, **changes}).build()

    held, slid = (ph.simulate(block(push), [0, 0], step=0.01, duration=10.0, limits={"balance": 1e-10}) for push in (0.9, 2.0))
    assert abs(held.x[-1, 0]) < 1e-15 and abs(1e4 * held.x[-1, 1] - 0.9) < 1e-12
    assert abs(slid.x[-1, 0] - 0.1) < 1e-12 and slid["dissipated/rub.loss"][-1] > 1   # 2 = coulomb + viscous v
    assert abs(held["stored/rub.energy"][-1] - 0.9 ** 2 / 2e4) < 1e-12
    refused(lambda: block(1, viscous=9.9), "viscous is 9.9", "= 10 or more: with less it would make energy")
    block(1, viscous=9.9, bristle_damping=0)   # Dahl's bristle needs none: the control
