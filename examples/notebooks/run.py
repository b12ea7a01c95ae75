#!/usr/bin/env python3
"""Runs notebooks from top to bottom and stores what their cells show: run.py NOTEBOOK... [--check]

Cells run in this process, in the folder of the notebook; nothing but Porthos, numpy and matplotlib is needed. A cell shows what it
prints and its last expression: a table (_repr_html_), a picture of matplotlib, or text. With --check nothing is stored.
"""
import ast
import base64
import contextlib
import io
import json
import os
import sys
from pathlib import Path


def shown(value):
    """The last expression of a cell as the output of a notebook; None: there is nothing to show."""
    if value is None:
        return None
    data = {"text/plain": repr(value).splitlines(keepends=True)}
    if hasattr(value, "savefig"):
        picture = io.BytesIO()
        value.savefig(picture, format="png", dpi=70)
        data = {"image/png": base64.b64encode(picture.getvalue()).decode(), "text/plain": ["<Figure>"]}
    elif hasattr(value, "_repr_html_"):
        data = {"text/html": value._repr_html_().splitlines(keepends=True), **data}
    return {"output_type": "execute_result", "metadata": {}, "data": data}


def run_cell(source, names, label):
    """Outputs of a cell."""
    tree = ast.parse(source, label)
    last = ast.Expression(tree.body.pop().value) if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, label, "exec"), names)
        if last is not None:
            value = eval(compile(last, label, "eval"), names)
    outputs = []
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue().splitlines(keepends=True)})
    if (output := shown(value)) is not None:
        outputs.append(output)
    return outputs


def run(path, store=True):
    """Runs a notebook; returns the names its cells made."""
    notebook, names = json.loads(path.read_text(encoding="utf-8")), {}
    os.chdir(path.parent)
    number = 0
    for at, cell in enumerate(notebook["cells"]):
        if cell["cell_type"] != "code":
            continue
        number += 1
        cell["outputs"] = run_cell("".join(cell["source"]), names, f"{path.name}, cell {at}")
        cell["execution_count"] = number
        for o in cell["outputs"]:
            if o["output_type"] == "execute_result":
                o["execution_count"] = number
    if store:
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return names


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    for given in [a for a in sys.argv[1:] if a != "--check"]:
        run(Path(given).resolve(), "--check" not in sys.argv)
