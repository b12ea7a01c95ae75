"""Ensembles: run, opened, looked at, and their cases as scenes."""
import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused

VARY = """
[ensemble]
cases = 12
seed = 4
[ensemble.vary]
"initial.joints.*.position" = { uniform = [-2, 2] }
[[output]]
quantity = "joint_rate"
joint = "elbow"
name = "motion"
"""


@pytest.fixture(scope="module")
def scene(source, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ensemble")
    (folder / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    text = (source / "examples/double_pendulum/scene.toml").read_text().replace("duration = 10000.0", "duration = 5.0")
    (folder / "scene.toml").write_text(text.replace("record_every = 1.0", "record_every = 0.1") + VARY)
    return folder / "scene.toml"


@pytest.fixture(scope="module")
def ensemble(scene):
    return ph.Scene(scene).ensemble(scene.parent / "results", threads=2, progress=False)


def test_runs_and_opens(ensemble):
    e = ensemble
    assert e.passed and bool(e) and e.verdict == "pass" and e.cases == 12 and len(e.not_passed) == 0
    again = ph.open(e.folder)
    assert isinstance(again, ph.EnsembleResult) and again.summary == e.summary
    assert list(e.inputs) == ["initial.joints.shoulder.position", "initial.joints.elbow.position"]
    assert np.all(np.abs(e.inputs["initial.joints.elbow.position"]) < 2) and e.unit("energy_error_J") == "J"
    assert set(e.outputs()) == {"motion"} and np.all(e.outputs("largest")["motion"] >= e.outputs("end")["motion"])
    assert e.events == {} and e.final["shoulder"].shape == (12,)
    assert e.worst()[0] == e.summary["energy_error"]["case_of_max"] == np.argmax(e["energy_error"])
    assert e.worst("motion", 3)[0] == np.argmax(e.outputs()["motion"]) and len(e.worst("motion", 3)) == 3
    assert e.worst("motion", which="largest")[0] == np.argmax(e.outputs("largest")["motion"])
    assert e.worst("motion", which="least")[0] == np.argmin(e.outputs("least")["motion"])
    refused(lambda: e.worst("nothing", which="least"), "the ensemble has no output 'nothing'")
    assert "12 of 12 cases passed" in str(e) and "pass" in repr(e) and "<table>" in e._repr_html_()
    with pytest.raises(KeyError, match="has no 'nothing', it has .*energy_error"):
        e["nothing"]
    refused(lambda: e.outputs("mean"), "expected one of end")


def test_a_case_is_a_scene_with_its_bits(ensemble, scene, tmp_path):
    worst = int(ensemble.worst()[0])
    for s in (ensemble.case(worst), ph.Scene(scene, case=worst)):
        r = s.run(tmp_path / "one", progress=False)
        assert r.summary["energy"]["max_rel_error"] == ensemble["energy_error"][worst]
        assert r["state/elbow"][-1] == ensemble.final["elbow"][worst]
        assert f"case {worst}" in r.summary["title"]
    finer = ensemble.case(worst, step=0.005).run(tmp_path / "finer", progress=False)
    assert finer.summary["step_s"] == 0.005 and finer["state/elbow"][0] == r["state/elbow"][0]
    other = ensemble.case(worst - 1 if worst else 1).run(tmp_path / "other", progress=False)
    assert other["state/elbow"][0] != r["state/elbow"][0]  # control
    refused(lambda: ensemble.case(12), "there is no case 12, expected one from 0 to 11")
    refused(lambda: ph.Scene(tmp_path, case=0), "has no ensemble.h5")


def test_an_unfinished_one_says_so(tmp_path):
    (tmp_path / "parts").mkdir()
    refused(lambda: ph.open(tmp_path), "unfinished ensemble")


def test_pictures(ensemble, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    figure = ph.plot(ensemble, tmp_path / "all.svg")
    assert [a.get_title() for a in figure.axes if a.get_visible()] == ["energy error", "motion"]
    assert sum(p.get_height() for p in figure.axes[1].patches) == 12  # every case in one bar
    one = ph.plot(ensemble, what="initial.joints.elbow.position")
    assert len(one.axes) == 1
    refused(lambda: ph.plot(ensemble, what="speed"), "expected one of energy_error, motion")
    own, unit = type(ensemble).outputs, type(ensemble).unit
    monkeypatch.setattr(type(ensemble), "unit", lambda self, name: "kg" if name == "mass" else unit(self, name))
    for mass, titles, told in ((np.full(12, 3.0), ["energy error", "motion"], True), (np.arange(12.0), ["energy error", "motion", "mass"], False)):
        monkeypatch.setattr(type(ensemble), "outputs", lambda self, mass=mass: {**own(self), "mass": mass})
        figure = ph.plot(ensemble, tmp_path / "more.svg")
        assert [a.get_title() for a in figure.axes if a.get_visible()] == titles
        assert ("in every case: mass 3 kg" in figure._suptitle.get_text()) == told


@pytest.fixture(scope="module")
def judged(scene):
    """Of which some cases fail a requirement, and an event happens at the same time in all."""
    more = """
[[output]]
quantity = "formula"
name = "size"
formula = "abs(motion)"
unit = "rad/s"
[[stop]]
name = "too fast"
output = "size"
above = 6
outcome = "judge"
[[event]]
type = "lock"
joint = "elbow"
at = 4.0
"""
    path = scene.parent / "judged.toml"
    path.write_text(scene.read_text() + more)
    return ph.Scene(path).ensemble(scene.parent / "judged", progress=False)


def test_tells_the_cases_and_the_limit_of_each_kind(judged, ensemble):
    e = judged
    failed = e.cases_of("stop.too fast")
    assert 0 < len(failed) < 12 and set(failed) == set(np.flatnonzero(e.outputs("largest")["size"] > 6))
    assert list(failed[:8]) == e.summary["first_cases"]["failed_checks"]["stop.too fast"]
    text = str(e)
    assert "at most 6 rad/s" in text and ", ".join(map(str, failed[:8])) in text and "in every case: lock of elbow at 4 s" in text
    assert "at most 6 rad/s" in e._repr_html_() and "at most" not in str(ensemble)  # control: all passed
    assert len(e.cases_of("energy")) == len(e.cases_of("refused")) == 0
    refused(lambda: e.cases_of("ok"), "why is 'ok', expected one of stop.too fast")
    assert e.unit("initial.joints.elbow.position") == "rad" and e.unit("size") == e.unit("motion") == "rad/s" and e.unit("energy_error_J") == "J"


def test_pictures_have_the_limits_and_units(judged, tmp_path):
    pytest.importorskip("matplotlib")
    figure = ph.plot(judged, tmp_path / "judged.png")
    axes = {a.get_title(): a for a in figure.axes if a.get_visible()}
    assert list(axes) == ["energy error", "largest size at the records", "motion", "size"]
    limited = axes["largest size at the records"]
    assert limited.get_xlabel() == "rad/s" and axes["motion"].get_xlabel() == "rad/s" and axes["energy error"].get_xlabel() == "relative"
    assert [line.get_label() for line in limited.get_lines()] == ["stop.too fast: limit 6"] and limited.get_lines()[0].get_xdata()[0] == 6
    assert axes["motion"].get_lines()[:] == []  # control: nothing limits it
    assert "in every case: lock of elbow at 4 s" in figure._suptitle.get_text()
