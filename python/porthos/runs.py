"""Runs: scenes, systems of one's own, checks and comparisons."""

from __future__ import annotations

import json
import math
import os
import tempfile
import warnings
from pathlib import Path
from typing import Any, Callable, Mapping, Sequence, Union

import numpy as np

from . import _core, notebook
from ._core import InvalidArgument, Model, SceneData
from .ensembles import EnsembleResult, open_ensemble
from .plans import Plan
from .progress import chosen
from .results import Comparison, Identification, PathLike, Result, Sensitivity

Tell = Union[bool, None, Callable[[float, float, float], None]]
CostPart = Union[None, Callable[[float, Any], "tuple[float, Any]"]]
Curvature = Union[None, Callable[[float, Any, Any], Any]]


def _name_of(path: Path) -> str:
    """examples/ets_vii/scene.toml -> "ets_vii", arm.toml -> "arm"."""
    folder = path.resolve().parent.name
    return folder if path.name == "scene.toml" and folder else path.stem


def _numbers(change: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers, and lists of them."""
    try:
        rows = {key: np.asarray(value, dtype=np.float64) for key, value in change.items()}
    except (TypeError, ValueError, AttributeError):
        rows = {"": np.empty((0, 0))}
    if any(row.ndim > 1 for row in rows.values()):
        raise InvalidArgument(f"change is {change!r}, expected numbers, or rows of them, by key: " + '{"controller[0].joints.elbow.effort": 20}')
    return {key: row.tolist() for key, row in rows.items()}


class Scene:
    """A scene file: one TOML file that describes a run completely (docs/scene.md).

    method, step [s] and duration [s] replace those of the file. `data` holds the rest, to be changed before a run.
    change: numbers, or rows of them, in place of those of the file, by keys as [ensemble.vary] has them:
    {"controller[0].joints.elbow.effort": 20}; places in [[...]] count from 0. Results have them in their scene.
    case: one of its [ensemble], from 0, as a scene by itself; then path may also be the results folder of the ensemble.
    Raises InvalidArgument, one sentence "file:line:column: ...".
    """

    def __init__(self, path: PathLike, *, method: str | None = None, step: float | None = None, duration: float | None = None,
                 case: int | None = None, change: Mapping[str, float | Sequence[float]] | None = None):
        self.path = Path(path)
        self._suffix = "" if case is None else f"_case_{case}"
        if change and case is not None:
            raise InvalidArgument("change is given besides case, expected one of both")
        self.data: SceneData = (_core.read_scene(self.path, method=method, step=step, duration=duration, change=_numbers(change or {})) if case is None else
                                _core.scene_of_case(self.path, case, method=method, step=step, duration=duration))
        self._assembly: _core.Assembly | None = None

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in ("path", "data", "_suffix", "_assembly"):
            raise InvalidArgument(f"a Scene has no '{name}' to be set, expected Scene(path, method=, step=, duration=, change=), or data.{name} where there is one")
        super().__setattr__(name, value)

    @property
    def assembly(self) -> _core.Assembly:
        """The model, its mechanism and the state at the start."""
        if self._assembly is None:
            self._assembly = _core.assemble(self.data)
        return self._assembly

    @property
    def model(self) -> Model:
        return self.assembly.model

    @property
    def certificates(self) -> list[_core.energy_shaping.Certificate]:
        """The conditions that were checked of each controller, in the order of the scene."""
        return self.assembly.certificates

    def info(self) -> str:
        """States, ports, invariants, plan and the measured cost of one evaluation."""
        return _core.info_text(self.data, self.assembly)

    def run(self, out: PathLike | None = None, *, resume: bool = False, memory: bool = False, progress: Tell = None) -> Result:
        """Runs the scene into the folder `out` (default: results/<name of the scene>) and judges it.

        memory: no folder and no files; the records, outputs too, stay in memory, with the same bits: for fits that run many times.
        Raises InvalidArgument then for scenes with events or an orbit.
        resume: continue from the checkpoint in the folder. progress: True, False, None (in terminals and notebooks), or a
        function of (fraction, spent, left). Ctrl-C saves a checkpoint and raises KeyboardInterrupt.
        """
        if not memory:
            return _into(self.data, self.assembly, out or self._out(), resume, False, progress)
        if out is not None or resume:
            raise InvalidArgument(f"{'resume' if out is None else 'out'} is given with memory=True, which has no folder, expected one of both")
        result = _in_memory(self.data, self.assembly, False, progress)
        result.mechanism = self.assembly.mechanism
        return result

    def _out(self, suffix: str = "") -> Path:
        return Path("results") / (_name_of(self.path) + self._suffix + suffix)

    def ensemble(self, out: PathLike | None = None, *, threads: int = 0, resume: bool = False, progress: Tell = None) -> EnsembleResult:
        """Runs the cases of the scene's [ensemble] into the folder `out` (default: results/<name of the scene>): docs/ensemble.md.

        threads: 0, as many as the machine has. resume: run the cases that are missing in the folder. Ctrl-C keeps the finished
        cases and raises KeyboardInterrupt. Raises InvalidArgument for a scene without [ensemble].
        """
        out = Path(out) if out is not None else self._out()
        tell, line = chosen(progress)
        try:
            interrupted = _core.run_ensemble(self.data, str(out), threads, resume, tell)
        finally:
            line.finish()
        if interrupted:
            raise KeyboardInterrupt(f"interrupted; continue with resume=True from {out}")
        report_beside(out)
        return open_ensemble(out)

    def extend(self, to: float, out: PathLike | None = None, *, progress: Tell = None) -> Result:
        """Continues the finished run in the folder `out` (default: as run()) to the time `to` [s], bit for bit.

        Raises InvalidArgument where the folder has no run of this scene that can be continued, and for scenes with events or
        a step control, whose runs begin anew from a last state with [initial] from.
        """
        return _into(self.data, self.assembly, out or self._out(), False, False, progress, to)

    def verify(self, out: PathLike | None = None, *, progress: Tell = None) -> Result:
        """The same with every check: also symmetry in time and the axioms of the system."""
        return _into(self.data, self.assembly, out or self._out("-verify"), False, True, progress)

    def compare(self, *, methods: Union[str, Sequence[str]] = (), budget: float = 120.0, duration: float | None = None,
                out: PathLike | None = None, progress: Tell = None) -> Comparison:
        """Speed against error of every applicable method, over a range of steps. budget: CPU seconds for everything."""
        return _compare(self.data, self.assembly, methods, budget, duration, out, progress)

    def plan(self, out: PathLike | None = None) -> Plan:
        """Torques that bring the scene to the goals of its [plan] at least cost, into the folder `out` (default:
        results/<name of the scene>-plan): docs/planning.md.

        Ctrl-C keeps what was found so far in the folder and raises KeyboardInterrupt. Raises InvalidArgument for a scene without
        [plan], and for what cannot be planned.
        """
        out = Path(out) if out is not None else self._out("-plan")
        summary, stopped = _core.plan_into(self.data, self.assembly, str(out))
        if stopped:
            raise KeyboardInterrupt(f"interrupted; the last iterate is in {out}")
        return Plan(json.loads(summary), out)

    def gradient(self, *, end: CostPart = None, sampled: CostPart = None, running: CostPart = None,
                 memory: int = 64 << 20, direction: Any = None, parameter_direction: Mapping[str, float] | None = None,
                 end_curvature: Curvature = None, sampled_curvature: Curvature = None, running_curvature: Curvature = None) -> _core.Gradient:
        """The gradient of the scene's run from its start, see gradient().

        Costs get the state that is integrated: of a craft that floats relative to its centre of mass, unless
        scene.data.centre_stays = True was set before.

        With a step control the steps are those of the run; their own change is not in the derivative, of the order of the
        method's error. Across events the parts of the cost get the state of the phase that runs; there is no running cost and
        no direction, and `parameters` has the numbers of the events too, "event[0].above". Raises InvalidArgument for an orbit,
        and all that gradient() refuses.
        """
        return _core.gradient_of_scene(self.data, self.assembly, end, sampled, running, memory, direction, parameter_direction,
                                       end_curvature, sampled_curvature, running_curvature)

    def sensitivity(self, of: str | Sequence[str] = (), *, by: str | Sequence[str] = (), uncertainty: float | None = None, threads: int = 0) -> Sensitivity:
        """On which parameters and start values the end of the scene's run depends, in the time of a few runs for each quantity.

        of: numbers of outputs ("tip.x"), "joint_1.position", ".velocity", "base.position.x", ".attitude.x", ".linear_velocity.x",
        ".angular_velocity.x", "energy"; without any, the scene's outputs, or else the places. uncertainty: relative standard
        deviation of every parameter. docs/derivatives.md.

        by: inputs by name, as identify() names parameters, and numbers of controllers, events and orbits ("hold.kp",
        "event[0].at"). Then the slopes are differences of 24 whole runs for each, over threads (0: as many as the machine has),
        and come with their errors: of any scene, with events, sampled controllers, actuators, stops, an orbit. All outputs, over
        the run as "tip.x.least" and ".largest" too, are then quantities.

        With a step control the steps are those of the run, as in gradient(). Raises InvalidArgument for an unknown name and,
        without by, for all that gradient() refuses, and RuntimeError where a step or its adjoint fails.
        """
        of, by = ([names] if isinstance(names, str) else list(names) for names in (of, by))
        return Sensitivity(uncertainty, **_core.sensitivity_of_scene(self.data, of, by, uncertainty, threads))

    def identify(self, log: PathLike | Mapping[str, Any], parameters: str | Sequence[str], *,
                 sigma: float | Mapping[str, float] | None = None, out: PathLike | None = None) -> Identification:
        """Finds parameters of the scene so that its run has what a log says, in least squares over the whole run.

        log: a file, CSV or HDF5, or columns by name: "time" [s] and any of "joint_1.position", ".velocity",
        "base.angular_velocity.x", numbers of the scene's outputs ("tip.x"). parameters: "link_6" (its ten inertial numbers),
        "link_6.mass", "spring.stiffness" of an element by its name, "joint_1.velocity" at the start, or a key of the scene.
        sigma: the standard deviation of the noise, of all columns or by name; without it the residual tells it. out: a folder
        for found.toml, the scene with the values found, identify.json and report.html. docs/identification.md.

        Bodies begin where their momenta put them, if the log has all rates and that run is nearer to it than the scene's.
        Raises InvalidArgument for unknown names, a log that does not fit, a step control, and all that gradient() refuses, and
        RuntimeError where the run from the scene's values fails.
        """
        names = [parameters] if isinstance(parameters, str) else list(parameters)
        columns = {k: list(map(float, v)) for k, v in log.items()} if isinstance(log, Mapping) else str(log)
        by_name = dict(sigma) if isinstance(sigma, Mapping) else {}
        of_all = None if sigma is None or isinstance(sigma, Mapping) else float(sigma)
        found = _core.identify_scene(self.data, columns, names, of_all, by_name, None if out is None else str(out))
        if out is not None:
            report_beside(out)
        return Identification(**found)

    def _repr_html_(self) -> str:
        return notebook.of_scene(self)

    def __repr__(self) -> str:
        return f"<porthos.Scene '{self.data.title}': {self.data.method}, step {self.data.step:g} s, {self.data.duration:g} s>"


def _into(data, assembly, out: PathLike, resume: bool, symmetry: bool, progress: Tell, extend: float | None = None) -> Result:
    if (resume or extend) and _core.method_version(data.method).endswith("not checked"):
        warnings.warn(f"'{data.method}' was added in Python and uses objects of its own, not checked: the run goes on with what they are now", stacklevel=4)
    tell, line = chosen(progress)
    try:
        summary, interrupted = _core.run_into(data, assembly, str(out), resume, symmetry, tell, extend)
    finally:
        line.finish()
    if interrupted:
        raise KeyboardInterrupt(f"interrupted; continue with resume=True from {out}")
    report_beside(out, _core.model_folders(data))
    return Result(json.loads(summary), Path(out))


def report_beside(out: PathLike, models: Sequence[PathLike] = ()) -> None:
    """report.html into a folder of results, where there is a template of the page."""
    if report_template() is None:
        return
    try:
        report(out, models=models)
    except InvalidArgument as e:
        warnings.warn(f"no report: {e}", stacklevel=4)


def report_template() -> Path | None:
    """The page of report.html without its data: of PORTHOS_REPORT_TEMPLATE, of this package, of the build or installation."""
    mine = Path(__file__).with_name("report_template.html")
    if mine.exists() and "PORTHOS_REPORT_TEMPLATE" not in os.environ:
        return mine
    found = _core.find_template()
    return Path(found) if found else None


def report(folder: PathLike, out: PathLike | None = None, *, models: Sequence[PathLike] = ()) -> Path:
    """Writes report.html, one self-contained page, from the results in a folder (docs/report.md); runs into a folder do so.

    out: another place for it. models: the folders of the model files, to show their meshes. Raises InvalidArgument if the folder holds no results or there is no template of the page.
    """
    page = report_template()
    if page is None:
        raise InvalidArgument("there is no report_template.html: build Porthos with node and npm, or name one by PORTHOS_REPORT_TEMPLATE")
    out = Path(out) if out is not None else Path(folder) / "report.html"
    if missing := _core.write_report(str(folder), str(out), str(page), list(models)):
        warnings.warn(f"playback: {missing}", stacklevel=2)
    return out


def film(results: PathLike, out: PathLike | None = None, *, start: float | None = None, end: float | None = None, speed: float | None = None,
         size: tuple[int, int] = (1280, 720), camera: str = "iso", follow: str | None = None, orbit: bool = False, arrows: bool = False,
         dark: bool = False, trail: bool = False, trail_of: Union[str, Sequence[str]] = (), text: bool = True) -> Path:
    """Writes a film (.mp4) of the playback, or the picture at `start` (.png), by a Chromium without a window: docs/report.md.

    results: a folder of results, of a part of which the records are shown, or a report.html, as it is. out: film.mp4 in that folder unless given. start, end [s]; speed in simulated seconds per second, the
    whole in 20 s unless given. camera: iso, x, y or z. follow: place, base or world; unless given the world
    with trail and where a contact touches it, else the place. trail: whole paths, not their last part; of the last links' centres of mass, or
    trail_of: of the origins of these links.
    text: the time in a corner. Raises InvalidArgument for a report without a playback, a bad option, or if no browser is found.
    """
    source = Path(results)
    if source.is_dir():
        if not (source / "report.html").exists():
            report(source)
    elif not source.is_file():
        raise InvalidArgument(f"{source} is no folder of results and no report.html")
    out = Path(out) if out is not None else (source if source.is_dir() else source.parent) / "film.mp4"
    remark = _core.write_film(str(source), str(out), size, start, end, speed, camera, follow or ("world" if trail else ""), orbit, arrows, dark, trail, [trail_of] if isinstance(trail_of, str) else list(trail_of), text)
    if remark:
        warnings.warn(remark, stacklevel=2)
    return out


def _in_memory(data, assembly, symmetry: bool, progress: Tell) -> Result:
    tell, line = chosen(progress)
    try:
        summary, columns, states = _core.run_in_memory(data, assembly, symmetry, tell)
    finally:
        line.finish()
    result = Result(json.loads(summary), None, columns, states)
    result.angles = [b.name for b in assembly.model.description.blocks if b.kind == _core.BlockKind.angle]
    return result


def _compare(data, assembly, methods, budget, duration, out, progress) -> Comparison:
    methods = [methods] if isinstance(methods, str) else methods
    tell, line = chosen(progress)
    try:
        content, table = _core.compare_methods(data, assembly, methods, budget, duration, str(out or ""), tell)
    finally:
        line.finish()
    return Comparison(json.loads(content), table, Path(out) if out else None)


def _refuse_links_elsewhere(model: Model, x) -> None:
    """An actuator's state has the joint's angle as its own: their difference is a Casimir, so a wrong start stays wrong."""
    names = {b.at: b.name for b in model.description.blocks if b.size == 1}
    for casimir in getattr(model, "casimirs", []):
        if sorted(casimir.terms.values()) != [-1, 1] or not all(at in names for at in casimir.terms):
            continue
        own, joint = sorted(casimir.terms, key=lambda at: not names[at].endswith(".link"))
        name = names[own].removesuffix(".link")
        if name + ".theta" not in names.values():
            continue
        link, angle = float(x[own]), float(x[joint])
        if abs(link - angle) > 1e-9 * max(1, abs(angle)):
            raise InvalidArgument(f"actuator '{name}' starts with link = {link:.6g} rad and its joint '{names[joint]}' at {angle:.6g} rad, "
                                  "expected the same: actuator_start(..., link=) takes the joint's angle")


def _scene_of(model: Model, x, step, duration, method, record_every, limits, title, options) -> tuple[SceneData, _core.Assembly]:
    if not isinstance(model, Model):
        raise InvalidArgument(f"model is a {type(model).__name__}, expected a Model, as MechanicalModel(mechanism); a scene file is run by Scene(path).run()")
    if x is None:
        raise InvalidArgument("x is None, expected the state at the start")
    if limits is not None and not isinstance(limits, Mapping):
        raise InvalidArgument(f"limits are {limits!r}, expected a dictionary, as {{'energy': 1e-12}}")
    data = SceneData()
    data.title = title if title is not None else model.description.name
    data.method, data.step, data.duration = method, step, duration
    for name, value in (("step", step), ("duration", duration)):
        if not 0 < value < math.inf:
            raise InvalidArgument(f"{name} is {value} s, expected a finite number above 0")
    if duration / step > 1e15:
        raise InvalidArgument(f"{duration:g} s are {duration / step:g} steps of {step:g} s, expected at most 1e+15")
    data.record_every = record_every if record_every is not None else step
    known = {"rtol", "iteration_tolerance"}
    for name, value in options.items():
        if name not in known:
            raise InvalidArgument(f"there is no option '{name}', expected one of: {', '.join(sorted(known))}")
        setattr(data, name, value)
    data.verify = _core.Limits(**(limits or {}))
    assembly = _core.assembly_of(model, x)
    _refuse_links_elsewhere(model, x)
    return data, assembly


def simulate(model: Model, x, *, step: float, duration: float, method: str = "gauss16", record_every: float | None = None,
             limits: Mapping[str, float] | None = None, out: PathLike | None = None, title: str | None = None,
             progress: Tell = None, **options: Any) -> Result:
    """Runs a model from the state x: steps of one size, the last shorter where the duration asks for it; a record every `record_every` [s] (default: every step).

    limits: of the verdict, relative: {"energy": 1e-12, "balance": 1e-12}; see Limits. out: a folder for the files of a run
    (docs/results.md); without it the run stays in memory. options: rtol, iteration_tolerance.
    """
    data, assembly = _scene_of(model, x, step, duration, method, record_every, limits, title, options)
    if out is not None:
        result = _into(data, assembly, out, False, False, progress)
        result.mechanism = getattr(model, "mechanism", None)
        return result
    result = _in_memory(data, assembly, False, progress)
    result.mechanism = getattr(model, "mechanism", None)
    return result


def _scene_or_path(what: Scene | PathLike, elsewhere: Mapping[str, Any], **given: Any) -> Scene:
    """The scene; of a path with what is given. elsewhere: arguments that only a model has."""
    for name, value in elsewhere.items():
        if value is not None:
            raise InvalidArgument(f"{name} is given with a scene, expected it of a model only: a scene states its own")
    given = {name: value for name, value in given.items() if value is not None}
    if not isinstance(what, Scene):
        return Scene(what, **given)
    for name in given:
        raise InvalidArgument(f"{name} is given with a Scene, expected it where the Scene is made: Scene(path, {name}=...)")
    return what


def verify(what: Model | Scene | PathLike, x=None, *, step: float | None = None, duration: float | None = None,
           method: str | None = None, limits: Mapping[str, float] | None = None, progress: Tell = None, **options: Any) -> Result:
    """A run with every check: the limits, symmetry in time and the axioms of the system.

    what: a model with the state x, step and duration (method: gauss16 unless given), or a scene or its path. With a path step, duration and
    method replace those of the scene; a Scene has them already, and both have their own limits.
    """
    if not isinstance(what, Model):
        scene = _scene_or_path(what, {"x": x, "limits": limits, **options}, step=step, duration=duration, method=method)
        with tempfile.TemporaryDirectory() as folder:
            return Result(scene.verify(Path(folder) / "verify", progress=progress).summary)
    if x is None or step is None or duration is None:
        raise InvalidArgument("verify of a model needs the state x, step and duration")
    data, assembly = _scene_of(what, x, step, duration, method or "gauss16", None, limits, None, options)
    return _in_memory(data, assembly, True, progress)


def compare(what: Model | Scene | PathLike, x=None, *, step: float | None = None, duration: float | None = None,
            methods: Union[str, Sequence[str]] = (), budget: float = 120.0, out: PathLike | None = None, progress: Tell = None) -> Comparison:
    """Speed against error of every applicable method, over a range of steps (docs/compare.md).

    what: a scene (or its path), or a model with the state x, step (the trials begin there) and duration. budget: CPU seconds
    for everything. out: a folder for compare.json, compare.txt and work_precision.svg.
    """
    if not isinstance(what, Model):
        scene = _scene_or_path(what, {"x": x}, step=step)
        return scene.compare(methods=methods, budget=budget, duration=duration, out=out, progress=progress)
    if x is None or step is None or duration is None:
        raise InvalidArgument("compare of a model needs the state x, step and duration")
    data, assembly = _scene_of(what, x, step, duration, "gauss16", None, None, None, {})
    return _compare(data, assembly, methods, budget, duration, out, progress)
