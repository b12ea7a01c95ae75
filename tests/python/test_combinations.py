"""The column "Python" of docs/combinations.md: every feature of tests/combinations by the module."""
import os
import subprocess
from pathlib import Path

import porthos as ph
from porthos.runs import report_template
import pytest


@pytest.fixture(scope="session")
def scenes(tmp_path_factory):
    """One folder a feature, written by the test program that runs all other pairs."""
    program = Path(os.environ.get("PORTHOS_PYTHON_BUILD", "")) / "tests/test_combinations"
    if not program.exists():
        pytest.skip(f"there is no {program}")
    folder = tmp_path_factory.mktemp("combinations")
    subprocess.run([program, "--gtest_filter=Combinations.ScenesForPython"], env=dict(os.environ, PORTHOS_SCENES=str(folder)), check=True,
                   stdout=subprocess.DEVNULL)
    return sorted(folder.iterdir())


def test_every_feature_runs_in_python(scenes):
    assert len(scenes) > 40
    failed = []
    for folder in scenes:
        r = ph.Scene(folder / "scene.toml").run(folder / "out", progress=False)
        if not (r.passed and r.summary["steps"] >= 20):
            failed.append(f"{folder.name}: {r.verdict}")
        if report_template() is not None and not (folder / "out/report.html").exists():
            failed.append(f"{folder.name}: no report")
    assert not failed


def test_a_run_that_is_not_resolved_fails(scenes):
    """Negative control."""
    r = ph.Scene(next(f for f in scenes if f.name == "uniform gravity") / "scene.toml", method="rk4", step=0.1, duration=5)
    assert not r.run(scenes[0].parent / "coarse", progress=False).passed
