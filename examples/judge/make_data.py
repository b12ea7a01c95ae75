#!/usr/bin/env python3
"""Trajectories of examples/double_pendulum by other programs, for `porthos judge`: make_data.py [FOLDER]

rk4.csv, rk4_coarse.csv   a textbook Runge-Kutta method on the textbook's equations, in this file
dart.csv                  DART 6, semi-implicit Euler, where python3-dartpy is installed
mujoco.csv                MuJoCo 2, Runge-Kutta 4, where libmujoco-dev and a C compiler are installed
"""
import csv
import math
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
MODEL = HERE.parent / "double_pendulum" / "double_pendulum.urdf"
START, DURATION, EVERY = (2.0, 0.5, 0.0, 0.0), 10.0, 0.01   # shoulder, elbow [rad], their rates; [s]


def derivative(x):
    """Two rods of 1 kg, centre at 0.5 m, hinged 1 m apart; angles from hanging, the elbow's from the upper rod."""
    g, inertia = 9.81, 0.08343333333333333
    a, b, u, v = x
    c, s = math.cos(b), math.sin(b)
    m22 = inertia + 0.25
    m12 = m22 + 0.5 * c
    m11 = 2 * inertia + 1.5 + c
    f1 = 0.5 * s * v * (2 * u + v) - g * (1.5 * math.sin(a) + 0.5 * math.sin(a + b))
    f2 = -0.5 * s * u * u - g * 0.5 * math.sin(a + b)
    det = m11 * m22 - m12 * m12
    return u, v, (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det


def rk4(x, h):
    shifted = lambda k, f: [xi + f * h * ki for xi, ki in zip(x, k)]
    k1 = derivative(x)
    k2 = derivative(shifted(k1, 0.5))
    k3 = derivative(shifted(k2, 0.5))
    k4 = derivative(shifted(k3, 1))
    return [xi + h / 6 * (p + 2 * q + 2 * r + s) for xi, p, q, r, s in zip(x, k1, k2, k3, k4)]


def write(path, rows):
    with open(path, "w", newline="") as f:
        out = csv.writer(f)
        out.writerow(["t", "q1", "q2", "v1", "v2"])
        out.writerows([[repr(float(x)) for x in row] for row in rows])
    print(path)


def by_rk4(path, h):
    x, rows, a_record = list(START), [(0.0, *START)], max(1, round(EVERY / h))
    for i in range(1, round(DURATION / h) + 1):
        x = rk4(x, h)
        if i % a_record == 0:
            rows.append((i * h, *x))
    write(path, rows)


def by_dart(path, h=1e-3):
    import dartpy
    world = dartpy.simulation.World()
    robot = dartpy.utils.DartLoader().parseSkeleton(str(MODEL))
    world.addSkeleton(robot)
    world.setGravity([0, 0, -9.81])
    world.setTimeStep(h)
    first = robot.getNumDofs() - 2   # the root may have freedoms of its own
    if first > 0:
        robot.getRootJoint().setActuatorType(dartpy.dynamics.ActuatorType.LOCKED)
    for k in range(2):
        robot.getDof(first + k).setPosition(START[k])
        robot.getDof(first + k).setVelocity(START[2 + k])
    state = lambda: [*robot.getPositions()[first:], *robot.getVelocities()[first:]]
    rows, a_record = [(0.0, *state())], round(EVERY / h)
    for i in range(1, round(DURATION / h) + 1):
        world.step()
        if i % a_record == 0:
            rows.append((i * h, *state()))
    write(path, rows)


def by_mujoco(path, h=1e-3):
    program = path.with_suffix(".program")
    subprocess.run(["cc", "-O2", str(HERE / "mujoco.c"), "-o", str(program), "-lmujoco", "-lm"], check=True, capture_output=True)
    numbers = [*START, h, DURATION, EVERY]
    text = subprocess.run([str(program), str(MODEL), *map(str, numbers)], check=True, capture_output=True, text=True).stdout
    program.unlink()
    path.write_text(text)
    print(path)


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    by_rk4(folder / "rk4.csv", 1e-3)
    by_rk4(folder / "rk4_coarse.csv", 0.05)
    for name, make in [("dart", by_dart), ("mujoco", by_mujoco)]:
        try:
            make(folder / f"{name}.csv")
        except (ImportError, FileNotFoundError, subprocess.CalledProcessError) as why:
            print(f"no {name}.csv: {type(why).__name__}", file=sys.stderr)


if __name__ == "__main__":
    main()
