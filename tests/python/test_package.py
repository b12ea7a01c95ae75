"""The package as it is built, typed and installed."""
import ast
import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

import porthos as ph


def test_every_public_thing_has_a_docstring():
    def missing(module):
        for name in dir(module):
            thing = getattr(module, name)
            if name.startswith("_") or not (inspect.isbuiltin(thing) or isinstance(thing, type)):
                continue
            doc = (thing.__doc__ or "").strip()
            if inspect.isbuiltin(thing):
                doc = "\n".join(doc.splitlines()[1:]).strip()  # behind the signature
            if not doc:
                yield f"{module.__name__}.{name}"

    # what says all there is by its name
    plain = {"constant", "assemble", "devices", "Cost", "CheckReport", "Traits", "Finding", "UrdfResult"}
    bare = [n for m in (ph._core, ph.energy_shaping, ph.vsa) for n in missing(m) if n.split(".")[-1] not in plain]
    bare = [n for n in bare if "ball_and_beam" not in n and "_plant" not in n and not n.endswith(".acrobot")]
    assert bare == []


def test_without_numpy_one_sentence_names_the_package():
    def after(code):
        return subprocess.run([sys.executable, "-c", f"import sys; {code}; import porthos"], capture_output=True, text=True)

    r = after("sys.modules['numpy'] = None")
    last = r.stderr.strip().splitlines()[-1]
    assert r.returncode == 1 and last.startswith("ModuleNotFoundError: porthos needs numpy") and "python3-numpy" in last, r.stderr
    assert "During handling" not in r.stderr
    assert after("pass").returncode == 0  # control
    other = after("sys.modules['porthos._core'] = None").stderr.strip().splitlines()[-1]  # another module that is missing is named
    assert "numpy" not in other, other


def test_stubs_know_every_name(source):
    for name, module in {"__init__": ph._core, "energy_shaping": ph._core.energy_shaping, "vsa": ph._core.vsa}.items():
        tree = ast.parse((source / f"python/porthos/_core/{name}.pyi").read_text())
        known = {n.name for n in tree.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
        public = {n for n, v in vars(module).items() if not n.startswith("__") and not inspect.ismodule(v)}
        assert known == public, known ^ public


def test_mypy_reads_the_stubs(source, tmp_path):
    pytest.importorskip("mypy", reason="mypy is not installed")
    program = tmp_path / "program.py"
    program.write_text("import porthos\nm = porthos.read_urdf('a').mechanism\nreveal_type(m.nq)\nporthos.aba(m)\n")
    r = subprocess.run([sys.executable, "-m", "mypy", str(program)], capture_output=True, text=True,
                       env={**os.environ, "MYPYPATH": str(source / "python")})
    assert '"builtins.int"' in r.stdout and 'Missing positional arguments "q", "v"' in r.stdout, r.stdout


def test_the_wheel_installs_and_imports(source, tmp_path):
    """The wheel with the libraries of this build, into an environment of its own; without PORTHOS_PYTHON_BUILD pip builds all of it."""
    build = os.environ.get("PORTHOS_PYTHON_BUILD")
    if not build:
        pytest.skip("PORTHOS_PYTHON_BUILD does not name a build folder")
    pytest.importorskip("setuptools")
    venv = pytest.importorskip("venv")
    tree = tmp_path / "source"  # pip leaves its traces there
    tree.mkdir()
    for name in ("python", "setup.py", "pyproject.toml", "README.md", "CMakeLists.txt", "LICENSE"):
        (tree / name).symlink_to(source / name)
    env = {**os.environ, "PYTHONPATH": "", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    # the same module, copied: setup.py would build it, and does nothing as it is there
    run = lambda *a, **k: subprocess.run([str(x) for x in a], check=True, capture_output=True, text=True, env=env, **k)
    try:
        run(sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "--no-index", "-w", tmp_path, tree, cwd=tmp_path)
    except subprocess.CalledProcessError as e:
        if "No module named pip" in e.stderr:
            pytest.skip("pip is not installed")
        raise AssertionError(e.stdout + e.stderr)
    wheel = next(tmp_path.glob("porthos-*.whl"))
    assert f"-{ph.__version__}-cp" in wheel.name and "linux" in wheel.name
    environment = tmp_path / "venv"
    venv.create(environment, system_site_packages=True, with_pip=False, symlinks=True)
    site = next(environment.glob("lib/python*/site-packages"))
    run(sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "--target", site, wheel, cwd=tmp_path)
    code = "import porthos, pathlib; p = pathlib.Path(porthos.__file__).parent; print(p); print((p / 'py.typed').exists(), (p / '_core/vsa.pyi').exists()); print(len(porthos.methods()))"
    r = run(environment / "bin/python", "-c", code, cwd=tmp_path)
    where, typed, methods = r.stdout.split("\n")[:3]
    assert Path(where) == site / "porthos" and typed == "True True" and int(methods) == len(ph.methods())
