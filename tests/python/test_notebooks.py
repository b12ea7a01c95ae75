"""The notebooks of the examples run from top to bottom and say what is stored in them."""
import importlib.util
import json
import os
import re
import shutil

import pytest


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
