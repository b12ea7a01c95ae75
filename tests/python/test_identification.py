"""Scene.identify: from a file and from arrays, what is returned, what is refused."""
import math

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused


@pytest.fixture
def joint(source):
    return source / "examples/identification"


def test_a_spring_from_a_file(joint, tmp_path):
    names = ["spring.stiffness", "bearing.coulomb", "bearing.viscous"]
    found = ph.Scene(joint / "scene.toml").identify(joint / "log.csv", names, sigma=1e-3, out=tmp_path / "out")
    truth = np.array([9.3, 0.14, 0.011])  # of the run behind the log
    e = found.values - truth
    size = e @ np.linalg.solve(found.covariance, e)
    print(f"  chi^2 of the errors {size:.2f} of 3 degrees of freedom, bound 16.3 (1 in 1000)")
    assert found.converged and size < 16.3
    wrong = np.array([8.0, 0.1, 0.02]) - truth  # control: the first guesses
    assert wrong @ np.linalg.solve(found.covariance, wrong) > 1e4
    assert found.parameters == names and found.units[0] == "N m/rad"
    assert np.allclose(found.deviations, np.sqrt(np.diag(found.covariance)))
    assert found["spring.stiffness"] == found.values[0]
    with pytest.raises(KeyError):
        found["spring.rest"]
    assert found.before.shape == found.after.shape == (601, 1) and found.times.shape == (601,)
    assert math.isclose((found.after**2).sum(), found.chi_square)
    assert found.combinations.shape == (3, 3) and found.told.all()
    assert "chi^2" in str(found)
    again = ph.Scene(tmp_path / "out/found.toml").run(progress=False)
    assert np.isfinite(again["state/joint"]).all()


def test_arrays_and_noise_by_name(joint):
    scene = ph.Scene(joint / "scene.toml", duration=2)
    run = scene.run(progress=False)
    log = {"time": run["time"], "joint.position": run["state/joint"]}
    found = scene.identify(log, "payload", sigma={"joint.position": 1e-4})
    # Of its ten numbers a hinge tells two combinations: those of the mass times the centre, and the inertia.
    assert found.told.sum() <= 3 and not found.told.all()
    assert np.isnan(found.deviations).any()
    assert "untold" in str(found)


def test_what_is_refused(joint):
    scene = ph.Scene(joint / "scene.toml")
    log = {"time": [0, 1, 2], "joint.position": [1.0, 0.5, 0.2]}
    refused(lambda: scene.identify(log, "spring.cubic"), "is no number of the scene")
    refused(lambda: scene.identify(log, "spring.stiffness", sigma=0), "sigma is 0", "expected a positive number")
    refused(lambda: scene.identify(log | {"tip.x": [0, 0, 0]}, "spring.stiffness"), "'tip.x', which a run has not")
    refused(lambda: scene.identify(log | {"time": [0, 1]}, "spring.stiffness"), "has 3 entries, expected 2")
    refused(lambda: ph.Scene(joint / "scene.toml", method="rk4").identify(log, "spring.stiffness"), "not for 'rk4'")
