"""Calls whose arguments do not fit: one sentence that names the argument, its value and what was expected."""

import inspect
import os
import subprocess
import sys

import numpy as np
import porthos as ph
import pytest
from porthos import _core, arguments, energy_shaping, vsa

ARM = ph.MechanismBuilder("arm").add(ph.BodySpec(name="rod", parent="world", joint=ph.JointSpec(type="revolute", axis=(0, 1, 0)),
                                                 mass=ph.MassProperties(mass=1, com=(0, 0, -0.5), inertia=(0.1, 0, 0, 0.1, 0, 0.1)))).build()

SENTENCES = [
    (lambda: vsa.make_elastic(3), "make_elastic(): 'family' is int 3, expected a text"),
    (lambda: vsa.make_elastic(), "make_elastic(): 'family' is missing, expected a text"),
    (lambda: vsa.make_elastic("cubic", limits=3), "make_elastic(): 'limits' is int 3, expected Limits"),
    (lambda: vsa.Limits(3), "Limits(): it got 1 argument, expected keywords only"),
    (lambda: vsa.Limits(deflection="much"), "deflection is str 'much', expected a number"),
    (lambda: vsa.formula("k*phi^2", k="2"), "k is a str, expected a number"),
    (lambda: vsa.make_elastic("cubic", k="2"), "k is a str, expected a number"),
    (lambda: energy_shaping.inertia_wheel_pendulum(3), "inertia_wheel_pendulum(): 'design' is int 3, expected InertiaWheelPendulum"),
    (lambda: ph.MechanicalModel(), "MechanicalModel(): 'mechanism' is missing, expected Mechanism"),
    (lambda: ph.MechanicalModel("arm", portz=[]), "MechanicalModel(): it has no argument 'portz', expected 'ports'"),
    (lambda: ph.MechanicalModel("arm", "arm", "arm", "arm"), "MechanicalModel(): it got 4 arguments, expected at most 3: mechanism, ports, constraints"),
    (lambda: ph.Network(np.zeros((2, 3))), "Network(): 'name' is an array of shape (2, 3) of float64, expected a text"),
    (lambda: ph.Network("arm").add("a"), "add(): 'member' is missing, expected Model"),
    (lambda: ph.Network("arm").add("a", 3), "add(): 'member' is int 3, expected Model"),
    (lambda: ph.Network("arm").add("a", ARM), "add(): 'member' is of the type Mechanism, expected Model: porthos.MechanicalModel(mechanism)"),
    (lambda: ph.error_statistics([0.0], 2.0), "error_statistics(): it got 2 arguments, expected at most 1: errors, and by name: scale"),
    (lambda: ph.sine(None), "sine(): 'amplitude' is None, expected a number"),
]


def test_a_law_in_python_that_calls_one_without_derivatives():
    """gauss8 asks a continuous law for derivatives. Control: with a period it is called with numbers alone."""
    loop = energy_shaping.cart_pole(energy_shaping.CartPole())

    def run(period):
        n = ph.Network("cart and pole")
        n.add("arm", energy_shaping.cart_pole_plant(energy_shaping.CartPole()))
        n.control("law", "arm.cart.force", ph.law(lambda t, x, y: loop.law(t, x)), period=period)
        return ph.simulate(n.build(), [0.1, 0, 0, 0], step=0.01, duration=0.1, progress=False)

    with pytest.raises(TypeError) as error:
        run(0)
    assert str(error.value) == ("law() takes no numbers that carry derivatives: systems and continuous laws are also called with such; "
                                "compute with them, or give the law a period > 0")
    assert len(run(0.01).x) > 1
    with pytest.raises(TypeError, match=r"^law\(\): 'x' is missing"):
        loop.law(0)


def test_an_error_of_a_method_has_its_place():
    def step():
        return 1 / 0

    with pytest.raises(ZeroDivisionError) as caught:
        step()
    _, error, _ = caught._excinfo
    line = step.__code__.co_firstlineno + 1
    arguments.tell_place(error, "method 'mine'", 0.25)
    assert str(error) == f"division by zero (method 'mine' at t = 0.25 s, test_arguments.py:{line})"
    two = OSError(2, "no file")  # control: of several arguments the text stays
    arguments.tell_place(two, "method 'mine'", 0.25)
    assert str(two) == "[Errno 2] no file" and two.__notes__ == ["method 'mine' at t = 0.25 s"]


@pytest.mark.parametrize("call, sentence", SENTENCES, ids=[s for _, s in SENTENCES])
def test_sentence(call, sentence):
    with pytest.raises(TypeError) as error:
        call()
    assert str(error.value) == sentence


def test_names_of_methods(source):
    scene = ph.Scene(source / "examples/dc_motor_arm/scene.toml")
    with pytest.raises(ph.InvalidArgument, match="unknown method 'gauss88'"):
        scene.compare(methods="gauss88")
    with pytest.raises(TypeError, match="'methods' is list .'gauss8', 3., expected a list of texts"):
        scene.compare(methods=["gauss8", 3])
    with pytest.raises(TypeError, match="'step' is str '1 ms', expected a number or None"):
        ph.Scene(source / "examples/dc_motor_arm/scene.toml", step="1 ms")


def every(member, seen):
    """Each function and class of the compiled part."""
    for value in vars(member).values():
        if id(value) in seen:
            continue
        seen.add(id(value))
        if inspect.ismodule(value) or inspect.isclass(value) and value.__module__.startswith("porthos._core"):
            yield from every(value, seen)
        if callable(value) and not inspect.ismodule(value):
            yield value


def errors_of_calls(counts, what):
    """The texts of the errors of each of them, called with as many of `what`."""
    for function in every(_core, set()):
        for n in counts:
            try:
                function(*[what] * n)
            except Exception as error:
                yield str(error)


def test_every_function_of_the_compiled_part():
    errors = list(errors_of_calls([14], object()))
    told = [e for e in errors if "expected" in e]
    assert len(told) > 300  # measured: 339 of 458; the others take anything, or are abstract
    assert not [e for e in errors if "are supported" in e]


NONE = "import test_arguments as t; print(len(list(t.errors_of_calls(range(1, 9), None))))"


def test_none_in_place_of_every_argument_ends_no_process():
    done = subprocess.run([sys.executable, "-c", NONE], capture_output=True, text=True, timeout=300, cwd=os.path.dirname(__file__))
    assert done.returncode == 0, done.stderr[-500:]  # the control: before, 25 functions ended it by signal 11
    assert int(done.stdout) > 2000


def test_none_names_its_argument(pendulum):
    with pytest.raises(TypeError, match="kinetic_energy.*'mechanism' is None, expected Mechanism"):
        ph.kinetic_energy(None, np.zeros(2), np.zeros(2))


def test_a_state_of_another_model_is_refused(pendulum):
    one, other = ph.MechanicalModel(pendulum), ph.UserModel(Oscillator())
    method = ph.integrator("gauss8", other, 0.01)
    for call in (lambda s: method.run(s, 10), method.step):
        with pytest.raises(ph.InvalidArgument, match="state"):
            call(ph.State(one, np.zeros(one.description.nx)))


class Oscillator:
    def description(self):
        return ph.Description(name="oscillator", nx=2, traits=ph.Traits(canonical=True))

    def hamiltonian(self, x):
        return 0.5 * (x[0] ** 2 + x[1] ** 2)


@pytest.mark.parametrize("step, duration, words", [(0.01, 1e18, "at most 1e.15"), (float("nan"), 1, "step is nan"), (0.01, -1, "duration is -1"),
                                                   (0, 1, "step is 0")])
def test_times_that_no_run_has(step, duration, words):
    model = ph.UserModel(Oscillator())
    with pytest.raises(ph.InvalidArgument, match=words):
        ph.simulate(model, [1, 0], step=step, duration=duration)
    with pytest.raises(ph.InvalidArgument, match=words):
        ph.compare(model, [1, 0], step=step, duration=duration)


def test_the_error_of_a_function_of_the_user_stays():
    def potential(q):
        raise TypeError("potential(): incompatible function arguments of mine")

    with pytest.raises(TypeError, match="incompatible function arguments of mine"):
        vsa.formula(lambda phi: potential(phi))


def test_a_measured_spring_from_a_file(tmp_path):
    file = tmp_path / "spring.csv"
    file.write_text("deflection,sigma,torque\n" + "".join(f"{x},0,{5 * x}\n" for x in (-1, -0.5, 0, 0.5, 1)))
    spring = vsa.table(str(file))
    assert abs(spring.slopes(0.3, 0.0, 0.0)[0] - 1.5) < 1e-12
    file.write_text("deflection,sigma,torque\n-1,0,1\n0,0,0\n1,0,-1\n")
    with pytest.raises(ph.InvalidArgument, match="torque"):
        vsa.table(str(file))
