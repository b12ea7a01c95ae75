"""Builds the wheel: CMake builds the module, setuptools packs it.

Environment: PORTHOS_PYTHON_BUILD names a build folder that is configured already, whose libraries are then used; without
it everything is built anew in build/wheel. CMAKE_ARGS are passed on.
"""
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent


class CMakeModule(build_ext):
    def build_extension(self, ext):
        folder = os.environ.get("PORTHOS_PYTHON_BUILD")
        if folder is None:
            folder = ROOT / "build" / "wheel"
            options = {"PORTHOS_BUILD_PYTHON": "ON", "PORTHOS_PYTHON_EXECUTABLE": sys.executable,
                       "PORTHOS_BUILD_APPS": "OFF", "PORTHOS_BUILD_TESTS": "OFF", "PORTHOS_BUILD_EXAMPLES": "OFF",
                       "PORTHOS_BUILD_BENCH": "OFF"}
            if not (shutil.which("cmake") and shutil.which("ninja")):
                sys.exit("porthos: building needs cmake, ninja and C++ libraries; on Debian 12 ./dev for-python installs them")
            subprocess.run(["cmake", "--preset", "release", "-B", folder, *(f"-D{k}={v}" for k, v in options.items()),
                            *shlex.split(os.environ.get("CMAKE_ARGS", ""))], check=True, cwd=ROOT)
            # the page of report.html, where node and npm are
            subprocess.run(["cmake", "--build", folder, "--target", "porthos_report_page"], check=False)
        subprocess.run(["cmake", "--build", folder, "--target", "porthos_python"], check=True)
        built = next((Path(folder) / "python" / "porthos").glob("_core*.so"))
        target = Path(self.get_ext_fullpath(ext.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        self.copy_file(str(built), str(target))
        page = Path(folder) / "report" / "report_template.html"  # there if node and npm were
        if page.exists():
            self.copy_file(str(page), str(target.with_name(page.name)))


version = re.search(r"project\(porthos VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
setup(
    version=version,
    packages=["porthos"],
    package_dir={"porthos": "python/porthos"},
    package_data={"porthos": ["py.typed", "_core/*.pyi"]},
    ext_modules=[Extension("porthos._core", [])],
    cmdclass={"build_ext": CMakeModule},
)
