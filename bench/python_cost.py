#!/usr/bin/env python3
"""What Python costs: PYTHONPATH=build/native/python python3 bench/python_cost.py. Exit code 1 where a bound is missed.

A run may cost 1 ms + 1 % beside what the same run takes in C++; a batch reaches 0.9 of a C++ loop over packs. Both sides take
turns in one run and the fastest of each counts, so that other work on the machine is on both.
"""
import sys
import time
from pathlib import Path

import numpy as np
import porthos as ph

ROOT = Path(__file__).resolve().parents[1]
STATES = 1000
failed = []


def least(f, repeats=5):
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        f()
        times.append(time.perf_counter() - start)
    return min(times)


def say(name, value, bound, holds):
    print(f"{name:34s} {value:9.3f}  bound {bound:6.3f}  {'ok' if holds else 'MISSED'}")
    if not holds:
        failed.append(name)


def overhead():
    """Everything but the seconds that the run itself says it took."""
    rod = lambda name, parent, z: ph.BodySpec(
        name=name, parent=parent, position=(0, 0, z), joint=ph.JointSpec(type="revolute", axis=(0, 1, 0)),
        mass=ph.MassProperties(mass=1, com=(0, 0, -0.5), inertia=(0.0834, 0, 0, 0.0834, 0, 0.0002)))
    builder = ph.MechanismBuilder("double pendulum").add(rod("upper", "world", 0)).add(rod("lower", "upper", -1))
    model = ph.MechanicalModel(builder.gravity((0, 0, -9.81)).build())
    x = model.state([2.0, 0.5], [0, 0])
    for steps in (10, 2000):
        spent, own = [], []
        for _ in range(50):
            start = time.perf_counter()
            r = ph.simulate(model, x, step=0.005, duration=0.005 * steps, progress=False)
            spent.append(time.perf_counter() - start - r.summary["wall_s"])
            own.append(r.summary["wall_s"])
        bound = 1 + 1e3 * 0.01 * min(own)
        say(f"a run of {steps} steps beside C++ [ms]", 1e3 * min(spent), bound, 1e3 * min(spent) <= bound)


def batches():
    m = ph.read_urdf(ROOT / "examples/ets_vii/ets_vii.urdf", base="free", accept_unphysical_inertia=True).mechanism
    rng = np.random.default_rng(1)
    q = m.neutral() + 0.3 * rng.uniform(-1, 1, (STATES, m.nq))
    v = rng.uniform(-1, 1, (STATES, m.nv))
    p = ph.momenta_from_rates(m, q, v)
    matrices, vectors = np.empty((STATES, m.nv, m.nv)), np.empty_like(v)
    fields = (np.empty_like(q), np.empty_like(q))
    calls = {"aba": lambda: ph.aba(m, q, v, v, out=vectors), "rnea": lambda: ph.rnea(m, q, v, v, out=vectors),
             "crba": lambda: ph.crba(m, q, out=matrices), "hamiltonian_field": lambda: ph.hamiltonian_field(m, q, p, out=fields)}
    for kernel, call in calls.items():
        cpp = python = float("inf")
        for _ in range(25):
            cpp = min(cpp, ph._core._cpp_seconds(m, kernel, STATES, True, 5))
            python = min(python, least(call))
        say(f"batch of {kernel}, C++ loop / Python", cpp / python, 0.9, cpp / python >= 0.9)


overhead()
batches()
sys.exit(1 if failed else 0)
