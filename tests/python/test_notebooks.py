"""The notebooks of the examples run from top to bottom and say what is stored in them."""
import importlib.util
import json
import os
import re
import shutil

import pytest

import porthos as ph


@pytest.fixture
def examples(source, tmp_path):
    shutil.copytree(source / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("results"))
    return tmp_path / "examples"


def runner(examples):
    spec = importlib.util.spec_from_file_location("run_notebook", examples / "notebooks/run.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def words(notebook):
    """The text of each cell's outputs; numbers with exponents, and those of rounding errors, are left out."""
    for cell in notebook["cells"]:
        for output in cell.get("outputs", []):
            text = "".join(output.get("text", output.get("data", {}).get("text/html", [])))
            yield re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "#", text)


@pytest.mark.parametrize("name", ["space_arm", "controller", "periodic_orbits"])
def test_notebook(examples, name, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    here, path = os.getcwd(), examples / f"notebooks/{name}.ipynb"
    stored = json.loads(path.read_text(encoding="utf-8"))
    try:
        names = runner(examples).run(path)
    finally:
        os.chdir(here)
    if name != "periodic_orbits":  # that one has no scene of its own; its cells assert what they say
        assert names["result"].passed
    again = json.loads(path.read_text(encoding="utf-8"))
    assert list(words(again)) == list(words(stored))
    assert [c["source"] for c in again["cells"]] == [c["source"] for c in stored["cells"]]
    pictures = [o for c in again["cells"] for o in c.get("outputs", []) if "image/png" in o.get("data", {})]
    assert len(pictures) >= 3 and all(len(o["data"]["image/png"]) > 5000 for o in pictures)
    if name == "controller":  # the worst case goes farther than the rail, the nominal run does not
        assert names["way"].max() > names["rail"] > 0 and 0 < (~names["fits"]).sum() < 100


def test_a_cell_that_fails_stops(examples, tmp_path):
    path = tmp_path / "bad.ipynb"
    path.write_text(json.dumps({"cells": [{"cell_type": "code", "source": ["1 / 0"], "outputs": []}]}))
    here = os.getcwd()
    try:
        with pytest.raises(ZeroDivisionError):
            runner(examples).run(path)
    finally:
        os.chdir(here)


def test_scenes_and_mechanisms_are_tables(source, tmp_path, monkeypatch):
    """The facts of `porthos info`, escaped; what is refused says why."""
    text = (source / "examples/dc_motor_arm/scene.toml").read_text()
    shutil.copy(source / "examples/dc_motor_arm/arm.urdf", tmp_path)
    file = tmp_path / "scene.toml"
    file.write_text(re.sub("^title = .*", 'title = "A <b>motor</b> & arm"', text, count=1, flags=re.M))
    scene = ph.Scene(file)
    page = scene._repr_html_()
    assert "A &lt;b&gt;motor&lt;/b&gt; &amp; arm" in page and "<b>motor" not in page
    shown = [re.findall("<td>(.*?)</td>", row) for row in re.findall("<tr>(.*?)</tr>", page)]
    told = scene.info()
    assert ["shoulder", "angle", "rad", "kg m^2/s", "0.4"] in shown and ["motor.supply", "1", "V", "A"] in shown
    for name, value in (("mass", "2 kg (moving)"), ("links", "2, in 2 moving bodies"), ("degrees of freedom", "2")):
        assert [name, value] in shown and re.search(f"{name} +{re.escape(value)}", told)
    def refuse(self):
        raise ph.InvalidArgument("no <such> joint")
    with monkeypatch.context() as m:
        m.setattr(ph.Scene, "assembly", property(refuse))
        assert "<td>refused</td><td>no &lt;such&gt; joint</td>" in ph.Scene(file)._repr_html_() and "refused" not in page
    model = tmp_path / "<i>.urdf"
    model.write_text((tmp_path / "arm.urdf").read_text().replace('name="arm"', 'name="&lt;i&gt;arm"', 1))
    urdf = ph.read_urdf(model)
    for page in (urdf._repr_html_(), urdf.mechanism._repr_html_()):
        assert "&lt;i&gt;arm" in page and "<i>" not in page
        assert "<td>elbow</td><td>q[1:2]</td><td>rad</td>" in page
    assert "root link" in urdf._repr_html_() and "root link" not in urdf.mechanism._repr_html_()
    free = ph.Scene(source / "examples/ets_vii/scene.toml")._repr_html_()
    assert "<td>base.position</td><td>linear</td><td>m</td><td>kg m/s</td><td>0 0 0</td>" in free and "<td>linear_momentum</td><td>kg m/s</td>" in free and "triangle inequality" in free
