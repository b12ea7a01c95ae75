"""Plans of scenes: Scene.plan()."""
import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused

URDF = """<robot name="wheel"><link name="world"/>
  <joint name="axle" type="continuous"><parent link="world"/><child link="rotor"/><axis xyz="0 0 1"/></joint>
  <link name="rotor"><inertial><mass value="1"/><inertia ixx="2" iyy="2" izz="2" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""
SCENE = """title = "A wheel turns from rest to rest"
[model]
urdf = "wheel.urdf"
base = "fixed"
[integrator]
method = "gauss4"
step = 0.1
[run]
duration = 2.0
record_every = 0.1
"""


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "wheel.urdf").write_text(URDF)
    (tmp_path / "scene.toml").write_text(SCENE + "[plan]\n[plan.joints]\naxle = { position = 1.3 }\n")
    return tmp_path / "scene.toml"


def test_a_wheel_from_rest_to_rest_is_its_closed_form(scene, tmp_path):
    plan = ph.Scene(scene).plan(tmp_path / "plan")
    inertia, angle, T, intervals = 2.0, 1.3, 2.0, 20
    least = 12 * (inertia * angle) ** 2 / (T**3 * (1 - 1 / intervals**2))  # torques held over the intervals
    assert plan.optimal and bool(plan)
    assert plan.cost == pytest.approx(least, rel=1e-13)
    assert list(plan) == ["time", "axle", "p.axle", "axle.torque"] and len(plan) == 4
    assert plan["time"][-1] == T and plan["axle"][-1] == pytest.approx(angle, abs=1e-14)
    assert np.sum(plan["axle.torque"][:-1] ** 2) * T / intervals == pytest.approx(least, rel=1e-13)
    value, multiplier = plan.goals["axle.position"]
    assert value == angle and abs(multiplier) == pytest.approx(2 * least / angle, rel=1e-12)
    assert plan.costates["axle"] == pytest.approx(np.full(intervals + 1, plan.costates["axle"][0]))
    replay = ph.Scene(plan.replay).run(tmp_path / "replay", progress=False)
    assert replay.passed and replay["state/axle"][-1] == pytest.approx(angle, abs=1e-13)
    assert "optimal" in str(plan) and "20 intervals" in repr(plan) and "<table>" in plan._repr_html_()
    with pytest.raises(KeyError, match="has no 'knee', it has time, axle"):
        plan["knee"]


def test_without_a_plan_it_is_refused(scene, tmp_path):
    scene.write_text(SCENE)
    refused(lambda: ph.Scene(scene).plan(tmp_path / "none"), "[plan]")
