"""Gradients of runs across events, and of runs with sampled controllers."""

import math

import numpy as np
import porthos as ph
import pytest
from test_dynamics import refused


def slider(damping=0.0):
    b = ph.MechanismBuilder("slider")
    b.add(ph.BodySpec(name="cart", parent="world",
                      joint=ph.JointSpec(name="rail", type="prismatic", axis=(1, 0, 0), damping=damping),
                      mass=ph.MassProperties(mass=2, com=(0, 0, 0), inertia=(1, 0, 0, 1, 0, 1))))
    return ph.MechanicalModel(b.build())


def place(t, x):
    return x[0], [1.0, 0.0]


def wall(**more):
    def bounce(t, x, n):
        return [x[0], -n["restitution"] * x[1]]

    return ph.RunEvent("wall", guard=lambda t, x, n: x[0] - n["place"], reset=bounce,
                       numbers={"place": 0.7, "restitution": 0.5}, **more)


def test_a_mass_that_hits_a_wall():
    q, p, T, w, e, m = 0.1, 3.0, 1.0, 0.7, 0.5, 2.0
    g = ph.gradient_across_events([(slider(), [wall()])], [q, p], 0.125, T, method="gauss4", end=place)
    v, t = p / m, (w - q) / (p / m)
    assert abs(g.cost - (w - e * v * (T - t))) < 1e-14
    # q(T) = w - e v T + e (w - q)
    assert np.allclose(g.start, [-e, -e * T / m], rtol=0, atol=1e-13)
    assert abs(g.parameters["wall.restitution"] + v * (T - t)) < 1e-13
    assert abs(g.parameters["wall.place"] - (1 + e)) < 1e-13
    assert abs(g.parameters["cart.mass"] - e * p * T / m**2) < 1e-13
    assert [(phase, event) for phase, event, _ in g.events] == [(0, 0)]
    assert abs(g.events[0][2] - t) < 1e-15 and g.time == T


def test_the_time_of_an_event_that_ends_the_run():
    g = ph.gradient_across_events([(slider(), [wall(ends=True)])], [0.1, 3.0], 0.125, 9, method="gauss4",
                                  end=lambda t, x: (t, [0, 0]), end_by_time=lambda t, x: 1)
    assert abs(g.cost - 0.4) < 1e-15 and g.time == g.cost
    assert np.allclose(g.start, [-1 / 1.5, -0.4 / 3], rtol=0, atol=1e-14)


def test_a_damper_from_a_given_time_on():
    at, d, m, T = 0.33, 1.5, 2.0, 1.0
    on = ph.RunEvent("on", at=at, then=1)
    g = ph.gradient_across_events([(slider(), [on]), (slider(d), [])], [0.1, 3.0], 0.125, T, end=place)
    left = math.exp(-d / m * (T - at))
    assert abs(g.cost - (0.1 + 1.5 * at + 1.5 * m / d * (1 - left))) < 1e-13
    assert abs(g.parameters["on.at"] - (1.5 - 1.5 * left)) < 1e-12


def test_what_is_refused():
    model = slider()
    refused(lambda: ph.RunEvent("a"), "the event 'a' has no guard and no time, expected one of them")
    refused(lambda: ph.RunEvent("a", at=1, direction="up"), "direction is 'up', expected 'rising', 'falling' or 'both'")
    refused(lambda: ph.gradient_across_events([], [0, 0], 0.1, 1), "phases is empty")
    short = ph.RunEvent("b", guard=lambda t, x, n: x[0] - 0.5, reset=lambda t, x, n: [x[0]])
    refused(lambda: ph.gradient_across_events([(model, [short])], [0.1, 3.0], 0.1, 1, end=place),
            "the reset of 'b' returned 1 numbers, expected 2")


def test_a_sampled_controller():
    k, d, m, h, steps = 40.0, 3.0, 2.0, 0.125, 30
    n = ph.Network("servo")
    n.add("mass", slider())
    n.control("pd", "mass.rail.force", ph.law(lambda t, x, y: -k * x[0] - d * y[0]), period=h)
    g = ph.gradient(n.build(), [0.3, -0.5], h, steps, method="gauss4", end=place)
    step = np.array([[1, h / m], [0, 1]]) + np.outer([h * h / (2 * m), h], [-k, -d / m])
    M = np.linalg.matrix_power(step, steps)
    assert np.allclose(g.start, M[0], rtol=0, atol=1e-13)


def test_a_scene_across_its_lock(source):
    scene = ph.Scene(source / "examples/deployment/scene.toml", duration=20)
    s = scene.sensitivity(["panel_1.position"])
    at = int(np.argmin(abs(scene.gradient(end=lambda t, x: (0.0, 0 * x)).end.x - s.values[0])))
    g = scene.gradient(end=lambda t, x: (x[at], np.eye(len(x))[at]))
    assert g.cost == pytest.approx(s.values[0], rel=1e-12)
    for name in ("event[0].above", "panel_1.stiffness", "spring.factor"):
        slope = s.slope("panel_1.position", name)
        assert abs(slope) > 1e-6 and g.parameters[name] == pytest.approx(slope, rel=1e-9)
    refused(lambda: scene.gradient(end=place, direction=g.start), "across events has no running cost and no direction")
