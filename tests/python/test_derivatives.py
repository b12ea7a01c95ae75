"""porthos.gradient: against differences of runs, in rates, by costs of Python; what it refuses."""
import math
import re

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused


def pendulum(mass=1.0, damping=0.125):
    m = ph.MechanismBuilder("pendulum")
    m.gravity((0, 0, -9.81))
    m.add(ph.BodySpec(name="rod", parent="world",
                      joint=ph.JointSpec(name="hinge", type="revolute", axis=(0, 1, 0), damping=damping),
                      mass=ph.MassProperties(mass=mass, com=(0, 0, -0.5), inertia=(0.1, 0, 0, 0.1, 0, 0.01))))
    return ph.MechanicalModel(m.build())


def end(t, x):
    return 0.5 * x[0] ** 2 + x[1], np.array([x[0], 1.0])


def running(t, x):
    return t * math.sin(x[0]), np.array([t * math.cos(x[0]), 0.0])


def sampled(t, x):
    return x[1] ** 2, np.array([0.0, 2 * x[1]])


def test_the_gradient_is_that_of_differences():
    def run(mass=1.0, damping=0.125, q=1.25, v=0.5):
        model = pendulum(mass, damping)
        return model, ph.gradient(model, model.state([q], [v]), 1 / 16, 40, end=end, running=running, sampled=sampled)

    model, g = run()
    dq, dv, by_start = ph.gradient_in_rates(model, np.array([1.25]), np.array([0.5]), g.start)
    # a mass with its centre c and the inertia about it kept: m, m c and the inertia about the origin change
    whole = {k: g.parameters[k] + by_start[k] for k in g.parameters}
    mass = whole["rod.mass"] - 0.5 * whole["rod.moment.z"] + 0.25 * (whole["rod.inertia.xx"] + whole["rod.inertia.yy"])
    by = 2.0 ** -17
    for name, mine, at in (("mass", mass, 1.0), ("damping", whole["hinge.damping"], 0.125), ("q", dq[0], 1.25), ("v", dv[0], 0.5)):
        up, down = (run(**{name: at + s * by})[1].cost for s in (1, -1))
        difference = (up - down) / (2 * by)
        print(f"  {name}: {mine:.12g}, off the difference by {abs(mine / difference - 1):.1e}, bound 1e-8")
        assert abs(mine - difference) < 1e-8 * max(1, abs(mine))
    def by_step(step):
        return ph.gradient(model, model.state([1.25], [0.5]), step, 40, end=end, sampled=sampled)

    by = 2.0 ** -22  # all steps are longer: the same change of the end as 2**-17 of one
    longer = (by_step(1 / 16 + by).cost - by_step(1 / 16 - by).cost) / (2 * by * 40)
    print(f"  duration: {by_step(1 / 16).duration:.12g}, off the difference by {abs(by_step(1 / 16).duration - longer):.1e}, bound 1e-8")
    assert abs(by_step(1 / 16).duration - longer) < 1e-8 * max(1, abs(longer))
    assert g.steps_taken == 40 and math.isfinite(g.growth)
    assert g.end.step == 40


def test_products_with_the_hessian_are_the_change_of_the_gradient():
    model = pendulum()
    x, along = np.array([1.25, 0.5]), np.array([0.3, -0.7])
    costs = dict(end=end, running=running, sampled=sampled)
    curvatures = dict(end_curvature=lambda t, x, v: np.array([v[0], 0.0]),
                      sampled_curvature=lambda t, x, v: np.array([0.0, 2 * v[1]]),
                      running_curvature=lambda t, x, v: np.array([-t * math.sin(x[0]) * v[0], 0.0]))

    def gradient(x, **more):
        return ph.gradient(model, x, 1 / 16, 40, **costs, **more)

    g, differenced = gradient(x, direction=along, **curvatures), gradient(x, direction=along)
    by = 2.0 ** -17
    up, down = gradient(x + by * along), gradient(x - by * along)
    change = (up.start - down.start) / (2 * by)
    of_moment = (up.parameters["rod.moment.z"] - down.parameters["rod.moment.z"]) / (2 * by)
    print(f"  off the difference by {np.abs(g.start_along - change).max():.1e} of {np.abs(change).max():.2g}, bound 1e-8; "
          f"the moment's by {abs(g.parameters_along['rod.moment.z'] - of_moment):.1e} of {of_moment:.2g}; "
          f"without curvatures {np.abs(differenced.start_along - g.start_along).max():.1e}")
    assert np.abs(g.start_along - change).max() < 1e-8 * np.abs(change).max()
    assert abs(g.parameters_along["rod.moment.z"] - of_moment) < 1e-8 * abs(of_moment)
    assert np.abs(differenced.start_along - g.start_along).max() < 1e-8 * np.abs(change).max()
    assert np.array_equal(g.start, gradient(x).start)
    assert gradient(x).start_along.size == 0 and gradient(x).parameters_along == {}
    for more, words in ((dict(direction=[1.0]), "direction"), (curvatures, "curvature is given without direction")):
        with pytest.raises(ValueError, match=words):
            gradient(x, **more)


def test_a_direction_along_parameters_is_the_change_of_the_gradient():
    x, by = np.array([1.25, 0.5]), 2.0 ** -15

    def gradient(damping, **more):
        return ph.gradient(pendulum(damping=damping), x, 1 / 16, 40, end=end, **more)

    g = gradient(0.125, parameter_direction={"hinge.damping": 2.0})
    up, down = gradient(0.125 + by), gradient(0.125 - by)
    change = (up.start - down.start) / by
    of_damping = (up.parameters["hinge.damping"] - down.parameters["hinge.damping"]) / by
    assert np.abs(g.start_along - change).max() < 1e-7 * np.abs(change).max()
    assert abs(g.parameters_along["hinge.damping"] - of_damping) < 1e-7 * abs(of_damping)
    refused(lambda: gradient(0.125, parameter_direction={"hinge.dampin": 1.0}), "'hinge.dampin', which is none of")
    refused(lambda: gradient(0.125, parameter_direction=[1.0]), "expected numbers by name")


def test_no_cost_is_no_gradient():
    model = pendulum()
    g = ph.gradient(model, model.state([1.0], [0.0]), 0.1, 3)
    assert g.cost == 0 and not g.start.any() and math.isnan(g.growth)


def test_what_it_does_not_cover_is_refused():
    model = pendulum()
    x = model.state([1.0], [0.0])
    refused(lambda: ph.gradient(model, x, 0.1, 3, method="spark8"), "not for 'spark8'")
    refused(lambda: ph.gradient(model, np.zeros(3), 0.1, 3), "x has 3 numbers, expected 2")
    refused(lambda: ph.gradient(model, x, 0.1, 3, end=lambda t, x: 1.0), "end(t, x) returned", "expected (value, gradient)")
    refused(lambda: ph.gradient(model, x, 0.1, 3, end=lambda t, x: (1.0, [1.0])), "gradient")

    class Fails(Exception):
        pass

    def fails(t, x):
        raise Fails

    with pytest.raises(Fails):
        ph.gradient(model, x, 0.1, 3, end=fails)


def test_a_scene_has_the_gradient_of_its_model(source, tmp_path):
    scene = ph.Scene(source / "examples/ets_vii/scene.toml", duration=10)
    cost = lambda t, x: (x[6], np.eye(26)[6])  # noqa: E731
    g = scene.gradient(end=cost)
    same = ph.gradient(scene.model, scene.assembly.initial.x.copy(), 0.5, 20, end=cost)
    assert g.cost == same.cost and np.array_equal(g.start, same.start) and g.parameters == same.parameters
    folder = source / "examples"
    refused(lambda: ph.Scene(folder / "ets_vii_orbit/scene.toml").gradient(end=cost), "takes no")
    shorter = ph.Scene(folder / "ets_vii/scene.toml", duration=10.3)  # with a last step of 0.3 s
    assert shorter.gradient(end=cost).cost == pytest.approx(shorter.run(out=tmp_path)["state/base.attitude"][-1, 3], abs=1e-13)
    assert shorter.gradient(end=cost).cost != g.cost
    by_midpoint = ph.Scene(folder / "ets_vii/scene.toml", duration=10, method="kahan_li8").gradient(end=cost)
    assert np.allclose(by_midpoint.start, g.start, rtol=0, atol=1e-4 * np.abs(g.start).max())
    refused(lambda: ph.Scene(folder / "four_bar/scene.toml").gradient(end=cost), "no constraints: loops")


def test_a_step_control_keeps_the_steps_of_its_run(source, tmp_path):
    folder = source / "examples/ets_vii"
    text = (folder / "scene.toml").read_text().replace('urdf = "', f'urdf = "{folder}/')
    path = tmp_path / "scene.toml"
    path.write_text(text.replace("step = 0.5", 'step = 0.5\nstep_control = "reversible"\nstep_control_rate = 0.1'))
    cost = lambda t, x: (x[6], np.eye(26)[6])  # noqa: E731
    g, plain = (ph.Scene(p, duration=10).gradient(end=cost) for p in (path, folder / "scene.toml"))
    assert g.steps_taken > plain.steps_taken and not np.array_equal(g.start, plain.start)
    assert np.allclose(g.start, plain.start, rtol=0, atol=1e-9 * np.abs(g.start).max())
    s = ph.Scene(path, duration=10).sensitivity("base.position.x")
    assert any("the steps are those of the run" in note for note in s.notes)


def test_tangents_along_a_run():
    model = pendulum()
    x = model.state([1.0], [0.0])
    M, end = ph.monodromy(model, x, 0.1, 50)
    for i in range(2):
        g = ph.gradient(model, x, 0.1, 50, end=lambda t, x, i=i: (x[i], np.eye(2)[i]))
        assert np.allclose(M[i], g.start, rtol=0, atol=1e-12 * np.abs(M).max())
    assert np.allclose(end.x, g.end.x)
    s = ph.lyapunov_spectrum(model, x, 0.1, 200, settle=10, every=2)
    assert s.exponents.shape == s.of_second_half.shape == (2,) and s.time == pytest.approx(20)
    assert np.log(np.linalg.det(M)) / 5 == pytest.approx(s.exponents.sum(), abs=1e-12)  # the damping, one body
    assert len(ph.lyapunov_spectrum(model, x, 0.1, 20, count=1).exponents) == 1
    assert re.fullmatch(r"LyapunovSpectrum\(\[\S+, \S+\] 1/s over \d+ s\)", repr(s))
    refused(lambda: ph.lyapunov_spectrum(model, x, 0.1, 20, count=3), "count is 3, expected 1 to 2")
    refused(lambda: ph.monodromy(model, x, 0.1, 3, method="spark8"), "not for 'spark8'")
    refused(lambda: ph.monodromy(model, np.zeros(3), 0.1, 3), "x has 3 numbers, expected 2")


def test_a_scene_tells_what_its_end_depends_on(source):
    scene = ph.Scene(source / "examples/ets_vii/scene.toml", duration=10)
    s = scene.sensitivity(["base.position.x", "joint_1.velocity"], uncertainty=0.01)
    assert s.of == ["base.position.x", "joint_1.velocity"] and s.units == ["m", "rad/s"]
    assert s.slopes.shape == (2, len(s.inputs)) and s.is_start.sum() == 12 + 12
    assert s.slope("base.position.x", "base.position.x") == pytest.approx(1, abs=1e-12)
    assert s.slope("base.position.x", "base.linear_velocity.x") == pytest.approx(10, abs=1e-11)
    whole = np.where(s.is_start, 0, s.slopes * s.input_values)
    assert np.allclose(s.deviation, 0.01 * np.sqrt((whole**2).sum(axis=1)), rtol=1e-14)
    assert "base.position.x = " in str(s) and s.growth.shape == (2,) and not s.notes
    assert [q for q in scene.sensitivity().of if q.startswith("joint")] == [f"joint_{k}.position" for k in range(1, 7)]
    with pytest.raises(ValueError):
        s.slope("base.position.x", "nothing")
    refused(lambda: s.slope("base.position.x", "joint_1.velocty"), "there is no input 'joint_1.velocty', the nearest is 'joint_1.velocity'")
    refused(lambda: s.slope("base", "joint_1.velocity"), "there is no quantity 'base', the nearest is 'base.position.x'")
    refused(lambda: scene.sensitivity(["knee"]), "there is no 'knee' at the end of a run")
    refused(lambda: ph.Scene(source / "examples/vsa_throw/scene.toml").sensitivity(), "takes no")


def test_differences_of_runs_are_for_every_scene(source):
    scene = ph.Scene(source / "examples/ets_vii/scene.toml", duration=5)
    name, of = "joint_3.velocity", "base.attitude.z"
    whole, by = scene.sensitivity(of), scene.sensitivity(of, by=name)
    assert by.runs == 25 and whole.runs == 0 and np.isnan(whole.errors).all()
    assert by.inputs == [name] and by.is_start.all() and np.isnan(by.growth).all()
    assert abs(by.slope(of, name) - whole.slope(of, name)) <= 3 * by.errors[0, 0] + 1e-14
    capture = ph.Scene(source / "examples/capture/scene.toml", duration=210)
    s = capture.sensitivity("wheel_z.velocity", by=["target.mass"], threads=2)
    assert s.errors[0, 0] < 1e-6 * abs(s.slopes[0, 0]) and "differences of 25 runs" in str(s)


def test_the_page_runs(source, tmp_path, monkeypatch, capsys):
    text = (source / "docs/derivatives.md").read_text(encoding="utf-8")
    blocks = [(text[: m.start()].count("\n") + 2, m[1]) for m in re.finditer(r"```python\n(.*?)```", text, re.S)]
    assert len(blocks) >= 2
    (tmp_path / "examples").symlink_to(source / "examples")
    monkeypatch.chdir(tmp_path)
    names = {}
    for line, code in blocks:
        exec(compile("\n" * (line - 1) + code, "docs/derivatives.md", "exec"), names)
    assert abs(names["damping"] - 0.2) < 1e-9


def test_what_takes_the_slopes_by_parameters_away_is_named(source):
    s = ph.Scene(source / "examples/dc_motor_arm/scene.toml", duration=0.1).sensitivity()
    assert all(s.is_start)
    assert s.notes[0].startswith("no slopes by parameters with 'motor', only by start values")
