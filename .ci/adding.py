#!/usr/bin/env python3
"""Puts the examples of docs/adding.md into a copy of the project, builds it and runs a scene with all of them.

    .ci/adding.py FOLDER

A block `cpp add=FILE` is a new file, or goes behind what the file's namespace holds; of a block `diff add=FILE` the lines with a plus go
where the lines around them say."""
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Files an example may touch, the one with its list among them.
MOST = {"A joint": 2, "A method": 3, "A type of element": 2, "A family of springs of variable stiffness": 2}

URDF = """<robot name="adding"><link name="base"/>
<link name="pin"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="arm"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="hand"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slot" type="pin_slot"><parent link="base"/><child link="pin"/><axis xyz="1 0 0"/></joint>
<joint name="elbow" type="continuous"><parent link="pin"/><child link="arm"/><origin xyz="0 0.5 0"/><axis xyz="1 0 0"/></joint>
<joint name="wrist" type="continuous"><parent link="arm"/><child link="hand"/><origin xyz="0 0.5 0"/><axis xyz="0 1 0"/></joint>
</robot>"""
SCENE = """[model]
urdf = "adding.urdf"
base = "fixed"
[initial.joints]
"slot.slide" = { velocity = 0.2 }
elbow = { position = 0.3 }
wrist = { position = 0.4 }
[[element]]
type = "cogging"
joint = "elbow"
torque = 0.2
[[actuator]]
joint = "wrist"
family = "quartic"
parameters = { k = 2 }
theta = { drive = "fixed", start = 0.0 }
sigma = { drive = "fixed", start = 0.5 }
[integrator]
method = "METHOD"
step = 0.001
[run]
duration = 10
[verify]
energy = LIMIT
balance = LIMIT
"""


def sections(text):
    """(heading, [(kind, file, lines)]) of each section with examples."""
    for part in re.split(r"^## ", text, flags=re.M)[1:]:
        blocks = re.findall(r"^```(cpp|diff) add=(\S+)\n(.*?)^```$", part, re.M | re.S)
        if blocks:
            yield part.splitlines()[0], blocks


def patched(text, block, file):
    """The text with the block's lines of a plus among those without."""
    old = "".join(line[1:] + "\n" for line in block.splitlines() if line[0] == " ")
    new = "".join(line[1:] + "\n" for line in block.splitlines())
    if text.count(old) != 1:
        raise SystemExit(f"docs/adding.md: {file} has {text.count(old)} places like\n{old}expected one")
    return text.replace(old, new)


def add(copy):
    """Adds the examples. @return how many files each section touched"""
    touched = {}
    for heading, blocks in sections((copy / "docs/adding.md").read_text()):
        for kind, name, block in blocks:
            file = copy / name
            if kind == "diff":
                file.write_text(patched(file.read_text(), block, name))
            elif file.exists():
                head, tail = file.read_text().rsplit("}  // namespace", 1)
                file.write_text(head + block + "\n}  // namespace" + tail)
            else:
                file.write_text(block)
            touched.setdefault(heading, set()).add(name)
    return {heading: len(files) for heading, files in touched.items()}


def run(*command, **options):
    print(" ".join(map(str, command)), flush=True)
    return subprocess.run(list(map(str, command)), **options)


def main():
    work = Path(sys.argv[1]).resolve()
    copy, build = work / "porthos", work / "build"
    shutil.rmtree(copy, ignore_errors=True)
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    for name in listed:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, copy / name)
    touched = add(copy)
    for heading, most in MOST.items():
        print(f"  {heading}: {touched.get(heading, 0)} files   at most {most}")
        if not 0 < touched.get(heading, 0) <= most:
            raise SystemExit(f"'{heading}' of docs/adding.md touches {touched.get(heading, 0)} files, expected 1 to {most}")
    run("cmake", "-S", copy, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O0", "-DPORTHOS_BUILD_TESTS=OFF",
        "-DPORTHOS_BUILD_PYTHON=OFF", "-DPORTHOS_BUILD_BENCH=OFF", "-DPORTHOS_BUILD_EXAMPLES=OFF", "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=20", check=True, stdout=subprocess.DEVNULL)
    built = run("cmake", "--build", build, "--target", "porthos", capture_output=True, text=True)
    if built.returncode:
        raise SystemExit("\n".join([line for line in built.stdout.splitlines() if "error" in line][:20]) + "\nthe examples of docs/adding.md do not build")
    scenes = work / "scenes"
    scenes.mkdir(exist_ok=True)
    (scenes / "adding.urdf").write_text(URDF)
    for method, limit, expected in (("gauss8", "1e-13", 0), ("heun", "1e-5", 0), ("heun", "1e-13", 1)):  # the last: a control
        (scenes / "adding.toml").write_text(SCENE.replace("METHOD", method).replace("LIMIT", limit))
        code = run(build / "apps/porthos", "run", scenes / "adding.toml", "--out", scenes / f"{method}_{limit}", stdout=subprocess.DEVNULL).returncode
        if code != expected:
            raise SystemExit(f"{method} within {limit}: exit code {code}, expected {expected}")
    print("docs/adding.md: its joint, method, element and spring were built and run")


if __name__ == "__main__":
    main()
