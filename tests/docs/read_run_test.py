"""examples/read_results in Octave, the script and the lines of its README: the numbers are those of summary.json.

read_run_test.py PORTHOS SOURCE OCTAVE WORK
"""
import json
import re
import subprocess
import sys
from pathlib import Path

porthos, source, octave, work = sys.argv[1:]
out = Path(work) / "read_run"
subprocess.run([porthos, "run", f"{source}/examples/dzhanibekov/scene.toml", "--duration", "50", "--out", out], check=True, capture_output=True)
said = subprocess.run([octave, "--eval", f"addpath('{source}/examples/read_results'); read_run('{out}');"], capture_output=True, text=True).stdout
summary = json.loads((out / "summary.json").read_text())

assert f"{summary['title']}: {summary['verdict']}" in said, said
error = float(re.search(r"energy error at a record (\S+) J", said)[1])
assert 0 < error <= summary["energy"]["max_abs_error_J"] * (1 + 1e-6), (error, summary["energy"])
for name, numbers in summary["final_state"]["q"].items():
    found = [float(x) for x in re.search(rf"{name.replace('.', '_')} at 50 s: (.*)", said)[1].split()]
    assert len(found) == len(numbers) and all(abs(a - b) <= 1e-14 for a, b in zip(found, numbers)), (name, found, numbers)

page = (Path(source) / "examples/read_results/README.md").read_text()
lines = [l for l in re.search(r"```octave\n(.*?)```", page, re.S)[1].replace("results/dzhanibekov", str(out)).splitlines()
         if not l.startswith("semilogy")]  # which needs a screen
check = "disp(size(q, 1)); printf('%.6e\\n', max(abs(r.energy_error)) / s.energy.scale_J); disp(s.verdict)"
told = subprocess.run([octave, "--eval", "\n".join([*lines, check])], capture_output=True, text=True)
rows, relative, verdict = told.stdout.split() if told.returncode == 0 else (told.stderr, 1, "")
assert rows == "4" and verdict == summary["verdict"] and abs(float(relative) * summary["energy"]["scale_J"] / error - 1) < 1e-5, told
print(said, told.stdout)
