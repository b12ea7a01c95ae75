"""Controllers of scenes in Python, by the interpreter that runs the module."""
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused

LAW = """
import numpy as np

class Law:
    def __init__(self, joints, settings):
        self.joints, self.gain, self.sum = joints, settings["gain"], np.zeros(2)

    def __call__(self, t, q, v):
        assert q.shape == v.shape == (2,)
        self.sum += 0.02 * (np.array([1.0, -0.4]) - q)
        return self.gain * (np.array([1.0, -0.4]) - q) - 4 * v + 5 * self.sum
"""
SCENE = """
[model]
urdf = "{source}/examples/double_pendulum/double_pendulum.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[integrator]
method = "gauss8"
step = 0.005
[run]
duration = 2
[[controller]]
type = "python"
name = "mine"
python = "law.py:Law"
joints = ["shoulder", "elbow"]
rate = 100
settings = {{ gain = 20 }}
"""


elbow = "state/elbow"


@pytest.fixture
def scene(source, tmp_path):
    (tmp_path / "law.py").write_text(LAW)
    (tmp_path / "scene.toml").write_text(SCENE.format(source=source))
    return tmp_path / "scene.toml"


def test_a_law_runs_in_this_interpreter_and_in_that_of_the_command(scene):
    here = ph.Scene(scene).run(scene.parent / "here", progress=False)
    assert here.passed
    known = os.environ.get("PORTHOS_CLI")
    if not known or not (Path(known).parent / "porthos_python_law.so").exists():
        pytest.skip("built without the command and its library")
    subprocess.run([known, "run", scene, "--out", scene.parent / "there", "--no-report"], check=True, stdout=subprocess.DEVNULL)
    there = ph.open(scene.parent / "there")
    assert np.array_equal(here[elbow], there[elbow])
    # Negative control: another gain moves it elsewhere.
    scene.write_text(scene.read_text().replace("gain = 20", "gain = 21"))
    assert not np.array_equal(ph.Scene(scene).run(scene.parent / "other", progress=False)[elbow], here[elbow])


def test_a_law_that_was_edited_is_read_again(scene):
    first = ph.Scene(scene).run(scene.parent / "first", progress=False)
    (scene.parent / "law.py").write_text(LAW.replace("- 4 * v", "- 5 * v"))
    assert not np.array_equal(ph.Scene(scene).run(scene.parent / "second", progress=False)[elbow], first[elbow])


def test_an_exception_is_that_of_the_law_with_its_place(scene):
    (scene.parent / "law.py").write_text(LAW.replace("        assert q", "        if t > 0.99: {}['x']\n        assert q"))
    refused(lambda: ph.Scene(scene).run(scene.parent / "out", progress=False), "controller 'mine' at t = 1 s: KeyError: 'x' (law.py:9)")


def test_a_delay_of_a_part_of_a_period(source, tmp_path, monkeypatch):
    """The law of the page that answers some calls later has the bits of the same law at a fifth of the rate, and of its delay of a period."""
    text = (source / "docs/own_laws.md").read_text(encoding="utf-8")
    files = dict(re.findall(r"```\w+ file=(\S+)\n(.*?)```", text, re.S))
    for name in ("law.py", "late.py"):
        (tmp_path / name).write_text(files[name])
    (tmp_path / "examples").symlink_to(source / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)  # before the law.py of other scenes
    monkeypatch.delitem(sys.modules, "law", raising=False)

    def end(*changes):
        scene = files["late.toml"].replace("duration = 20.0", "duration = 2.0")
        for old, new in changes:
            assert old in scene
            scene = scene.replace(old, new)
        Path("scene.toml").write_text(scene)
        return ph.Scene("scene.toml").run("results", progress=False)[elbow][-1]

    late = {k: end(("late = 2", f"late = {k}")) for k in (0, 2, 5)}
    own = ("late.py:Late", "law.py:Law")
    assert late[0] == end(own, ("rate = 500.0", "rate = 100.0"))
    assert late[5] == end(own, ("rate = 500.0", "rate = 100.0\ndelay = 1"))
    assert len(set(late.values())) == 3, "control"
