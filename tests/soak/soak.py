#!/usr/bin/env python3
"""Watches a long run: python3 tests/soak/soak.py PORTHOS SCENE OUT [SECONDS]

Runs `PORTHOS run SCENE --out OUT --no-report` and looks at the process every SECONDS (10): resident
memory, open handles, processor time and the sizes of the checkpoint's files. At the end it writes
OUT/soak.json. Needs Linux (/proc), and Python's own library only.
"""
import json
import os
import pathlib
import subprocess
import sys
import time


def sample(pid, out):
    """One look at the process and at its checkpoint; None when it is gone."""
    proc = pathlib.Path("/proc") / str(pid)
    try:
        status = dict(line.split(":", 1) for line in (proc / "status").read_text().splitlines())
        handles = len(os.listdir(proc / "fd"))
        ticks = (proc / "stat").read_text().rsplit(")", 1)[1].split()
        state = out / "checkpoint" / "state.bin"
        records = out / "checkpoint" / "records.bin"
        return {
            "memory_kb": int(status["VmRSS"].split()[0]),
            "handles": handles,
            "cpu_s": (int(ticks[11]) + int(ticks[12])) / os.sysconf("SC_CLK_TCK"),
            "state_bytes": state.stat().st_size if state.exists() else None,
            "records_bytes": records.stat().st_size if records.exists() else None,
        }
    except (OSError, KeyError, ValueError):
        return None


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    program, scene, out = sys.argv[1:4]
    every = float(sys.argv[4]) if len(sys.argv) > 4 else 10.0
    out = pathlib.Path(out)
    run = subprocess.Popen([program, "run", scene, "--out", str(out), "--no-report"],
                           stdout=subprocess.DEVNULL)
    samples = []
    while run.poll() is None:
        now = sample(run.pid, out)
        if now is not None:
            samples.append(now)
        time.sleep(every)
    summary = json.loads((out / "summary.json").read_text())
    (out / "soak.json").write_text(
        json.dumps({"scene": scene, "exit_code": run.returncode, "summary": summary,
                    "samples": samples}, indent=1))
    memory = [s["memory_kb"] for s in samples]
    late = samples[len(samples) // 10:]
    print(f"{len(samples)} looks, memory {memory[0]} to {max(memory)} kB, "
          f"handles {sorted({s['handles'] for s in late})}, "
          f"checkpoint {sorted({s['state_bytes'] for s in late}, key=str)} bytes")
    return run.returncode


if __name__ == "__main__":
    sys.exit(main())
