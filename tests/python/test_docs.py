"""The code of docs/python.md runs as it stands, from top to bottom."""
import os
import re

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
    out = capsys.readouterr().out
    assert "verdict  pass" in out and "FAIL" not in out, out
