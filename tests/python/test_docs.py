"""The code of docs/python.md runs as it stands, from top to bottom."""
import os
import re
import subprocess

import pytest


def test_docs_python(source, tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    text = (source / "docs/python.md").read_text(encoding="utf-8")
    blocks = [(text[: m.start()].count("\n") + 2, m[1]) for m in re.finditer(r"```python\n(.*?)```", text, re.S)]
    assert len(blocks) >= 8
    (tmp_path / "examples").symlink_to(source / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    names = {}
    for line, code in blocks:
        exec(compile("\n" * (line - 1) + code, "docs/python.md", "exec"), names)
    assert os.path.getsize("results/ets_vii/plot.png") > 20000
    if cli := os.environ.get("PORTHOS_CLI"):  # the episode is judged by the command beside it
        judge = next(line for line in text.splitlines() if line.startswith("porthos judge episode.csv")).split()
        assert subprocess.run([cli, *judge[1:]], capture_output=True, check=False).returncode == 0
        (tmp_path / "episode.toml").write_text("[verify]\nenergy = 1e-9\n")
        assert subprocess.run([cli, *judge[1:-1], "off"], capture_output=True, check=False).returncode == 1  # control: without gravity
    out = capsys.readouterr().out
    assert "verdict  pass" in out and "FAIL" not in out, out


def test_docs_of_identification(source, tmp_path, monkeypatch):
    """Each block asserts that it finds what the log was made with."""
    pytest.importorskip("scipy")
    text = (source / "docs/identification.md").read_text(encoding="utf-8")
    (tmp_path / "examples").symlink_to(source / "examples")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) == 2
    for code in blocks:
        exec(compile(code, "docs/identification.md", "exec"), {})
    with pytest.raises(AssertionError):  # control: the log of another friction
        exec(compile(blocks[1].replace("angles([0.02, 0.01])", "angles([0.02, 0.02])"), "docs/identification.md", "exec"), {})


def test_docs_of_actuators(source, tmp_path, monkeypatch):
    """The Python of the tutorial, and its scene with the measured spring, which only Python makes."""
    import porthos

    text = (source / "docs/tutorials/actuator.md").read_text(encoding="utf-8")
    (tmp_path / "examples").symlink_to(source / "examples")
    monkeypatch.chdir(tmp_path)
    for code in re.findall(r"```python\n(.*?)```", text, re.S):
        exec(compile(code, "docs/tutorials/actuator.md", "exec"), {})
    scene = next(t for t in re.findall(r"```toml\n(.*?)```", text, re.S) if "spring.csv" in t)
    (tmp_path / "measured.toml").write_text(scene)
    assert porthos.Scene("measured.toml").run("measured", progress=False).passed
    (tmp_path / "rough.toml").write_text(scene.replace("smoothing = 0.1", "smoothing = 0.001"))
    with pytest.raises(porthos.InvalidArgument, match="with smoothing = 0.001 N m the stiffness is -"):
        porthos.Scene("rough.toml")
