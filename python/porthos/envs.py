"""Environments with the interface of Gymnasium, over the batch of Environment. Gymnasium itself is not needed: spaces are its own
where it is installed, else of the same members.
"""

from __future__ import annotations

import tempfile
from typing import Any, Callable, Mapping, Sequence

import numpy as np

from ._core import Assembly, Environment, InvalidArgument, LivePicture, Mechanism, Model, momenta_from_rates, rates_from_momenta
from .env_observed import Sight
from .env_options import check_look, check_options, driven, limits, of_each, read_only, refuse_jumps
from .env_scenes import assemblies_of, scene_of
from .results import PathLike
from .runs import Scene

try:
    import gymnasium
except ImportError:
    gymnasium = None

Reward = Callable[[np.ndarray, np.ndarray], np.ndarray]
Terminated = Callable[[np.ndarray, np.ndarray], np.ndarray]


class Box:
    """What is used of gymnasium.spaces.Box, where gymnasium is not installed."""

    def __init__(self, low: Any, high: Any, shape: tuple[int, ...], dtype: Any = np.float32):
        self.low, self.high = np.full(shape, low, dtype), np.full(shape, high, dtype)
        self.shape, self.dtype = shape, np.dtype(dtype)
        self._random = np.random.default_rng()

    def seed(self, seed: int | None = None) -> None:
        self._random = np.random.default_rng(seed)

    def sample(self) -> np.ndarray:
        if not (np.isfinite(self.low).all() and np.isfinite(self.high).all()):
            return self._random.normal(size=self.shape).astype(self.dtype)
        return self._random.uniform(self.low, self.high).astype(self.dtype)

    def contains(self, x: Any) -> bool:
        x = np.asarray(x)
        return x.shape == self.shape and bool((x >= self.low).all() and (x <= self.high).all())

    def __repr__(self) -> str:
        return f"Box({self.low.min():g}, {self.high.max():g}, {self.shape}, {self.dtype})"


class _Plain:
    """What is used of gymnasium.Env, where gymnasium is not installed: wrappers of one's own ask for it."""

    spec = None
    np_random: np.random.Generator = np.random.default_rng()

    @property
    def unwrapped(self) -> Any:
        return self

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        if seed is not None:
            self.np_random = np.random.default_rng(seed)


def _box(low: Any, high: Any, shape: tuple[int, ...], dtype: Any) -> Any:
    return (gymnasium.spaces.Box if gymnasium else Box)(low, high, shape=shape, dtype=dtype)


def _picture_of(given: PathLike | Scene, mechanism: Any, look: dict[str, Any]) -> LivePicture:
    """Of the report of a run of one step."""
    scene = scene_of(given, None)
    duration = scene.data.duration
    with tempfile.TemporaryDirectory() as folder:
        try:
            scene.data.duration = scene.data.step
            scene.run(folder + "/run", progress=False)
        finally:
            scene.data.duration = duration
        return LivePicture(mechanism, folder + "/run/report.html", **look)


def _in_rates(m: Mechanism, x: np.ndarray) -> np.ndarray:
    """What is observed of a state."""
    return np.concatenate([x[: m.nq], rates_from_momenta(m, x[: m.nq], x[m.nq : 2 * m.nq]), x[2 * m.nq :]])


def _made_by(cls: type, path: PathLike, options: dict[str, Any]) -> Any:
    return cls.from_scene(path, **options)


_VectorBase = gymnasium.vector.VectorEnv if gymnasium else _Plain
_EnvBase = gymnasium.Env if gymnasium else _Plain


class VectorEnv(_VectorBase):
    """Many environments of one model, as gymnasium.vector.VectorEnv.

    Observations are the coordinates and the joint rates of a mechanism (of other models the state); `names` says what stands
    where: "rate of base.attitude[0]" is an angular rate, "rate of base.position[0]" a velocity of a free body, both along its own
    axes. observed: some of these names instead, and of the scene's [[output]]s ("tip", or one of its numbers, "tip.x"); begin and
    ended take all. Angles are in [-pi, pi]: one that passes pi goes on from -pi, so a reward takes its sine and cosine.
    Actions are inputs of `ports` (where none are named, all but the wrenches on free bodies, the base and targets; where there are no others, these), in [-limit, limit];
    what is beyond is cut off. limit: a number, one for each port, or by their names, {"elbow.torque": 3}. Joint limits of the model file do not act without elements of type "limits". reward(observations, actions) -> (n,); both may not be written.
    terminated(observations, actions) -> (n,) of bool, also called once in a step: which episodes end at what reward sees.
    A copy whose method fails, whose observation is not finite in dtype, or whose reward is not at an observation beyond 1e9, ends as
    terminated with info["failed"]; it observed last what it did before the step. info["failure"] says why and when in the episode:
    a sentence of each copy, "" where it did not fail.
    An episode that ends begins anew in the same step: its last observation is then in info["final_obs"], by info["_final_obs"].
    mechanism: the one in the model, whose state comes first, where the model does not name it (from_scene does).
    scene: a scene file of the same mechanism, by which render() draws (from_scene gives it). render_mode: "rgb_array" or None.
    picture: size in pixels (640, 480), camera, follow and dark, as in film().
    A start off the constraints is refused; a quaternion that begin gives is normed.
    options: those of Environment (step, substeps, longest, method, begin, ended, threads, ...); begin and ended take states.
    rates: begin(uniform, x) and ended(x) take what is observed, coordinates and rates in float64, and begin gives that.
    One from a scene may be pickled and copied, as far as its functions may: the other one begins anew with reset().
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP
                                if gymnasium and hasattr(gymnasium.vector, "AutoresetMode") else "SameStep"}
    render_mode = None
    _recipe: tuple[PathLike, dict[str, Any]] | None = None  # of from_scene with a path

    def __init__(self, model: Model, start, *, reward: Reward, limit: float | Sequence[float] | Mapping[str, float], num_envs: int = 1, dtype: Any = np.float32, mechanism: Any = None,
                 terminated: Terminated | None = None, scene: PathLike | None = None, render_mode: str | None = None, picture: dict[str, Any] | None = None, rates: bool = False, observed: Sequence[str] | None = None,
                 _cases: Sequence[Assembly] = (), **options: Any):
        if render_mode not in (None, "rgb_array"):
            raise InvalidArgument(f"render_mode is {render_mode!r}, expected 'rgb_array' or None")
        check_options(options)
        check_look(picture or {})
        if not callable(reward):
            raise InvalidArgument(f"reward is {reward!r}, expected a function of observations and actions")
        if not (terminated is None or callable(terminated)):
            raise InvalidArgument(f"terminated is {terminated!r}, expected a function of observations and actions")
        if not np.issubdtype(np.dtype(dtype), np.floating):
            raise InvalidArgument(f"dtype is {np.dtype(dtype)}, expected one of floating point, as float32")
        if not isinstance(model, Model):
            raise InvalidArgument(f"model is a {type(model).__name__}, expected a Model, as MechanicalModel(mechanism); of a scene file: from_scene(path)")
        self._mechanism = mechanism if mechanism is not None else getattr(model, "mechanism", None)
        if render_mode is not None and (scene is None or self._mechanism is None):
            raise InvalidArgument("render_mode is 'rgb_array', but there is no scene to draw by, expected one: from_scene(path), or scene=path")
        self._reward, self._terminated, self._dtype = reward, terminated, np.dtype(dtype)
        description = model.description
        mechanisms = [a.mechanism for a in _cases] or [self._mechanism]
        data = scene.data if isinstance(scene, Scene) else None
        sizes = driven(options.get("ports"), description, self._mechanism)
        self._sight = Sight(mechanisms, description, sizes, observed, data, _cases if data else ())
        self.names: list[str] = self._sight.names
        options["ports"] = list(sizes)
        if rates:
            if self._mechanism is None:
                raise InvalidArgument("rates is True, but the model has no mechanism that is known, expected mechanism=")
            self._begin_in_rates(options)
        ended = options.get("ended")
        endings = [self._ended_in_rates(ended, m) if ended and rates else ended for m in mechanisms]
        if _cases:
            options["cases"] = [(a.model, a.start, e) for a, e in zip(_cases, endings)]
        options["ended"] = endings[0]
        self._limit = limits(limit, sizes)
        refuse_jumps(model)
        self._batch = Environment(model, start, count=num_envs, **options)
        number = lambda name, n: [name] if n == 1 else [f"{name}[{k}]" for k in range(n)]
        self.action_names: list[str] = [n for p, size in sizes.items() for n in number(p, size)]
        self.num_envs = num_envs
        self.single_observation_space = _box(-np.inf, np.inf, (len(self.names),), self._dtype)
        most = self._limit.astype(self._dtype)
        self.single_action_space = _box(-most, most, most.shape, self._dtype)
        self.observation_space = _box(-np.inf, np.inf, (num_envs, len(self.names)), self._dtype)
        most = np.tile(most, (num_envs, 1))
        self.action_space = _box(-most, most, most.shape, self._dtype)
        self._scene, self.render_mode, self._look, self._picture, self._begun = scene, render_mode, picture or {}, None, False

    def _ended_in_rates(self, ended: Callable[[np.ndarray], bool], m: Mechanism) -> Callable[[np.ndarray], bool]:
        """Of observations, as a function of states."""
        return lambda x: ended(_in_rates(m, x))

    def _begin_in_rates(self, options: dict[str, Any]) -> None:
        m = self._mechanism
        bodies, rest = m.nq + m.nv, 2 * m.nq  # what is no mechanism's, as of actuators, follows

        def state(o: Any, x: np.ndarray) -> np.ndarray:
            if o is None:
                raise InvalidArgument("begin returns None, expected that it returns the coordinates and rates it changed")
            o = np.asarray(o, dtype=np.float64)
            if o.shape not in ((bodies,), (bodies + len(x) - rest,)):
                raise InvalidArgument(f"begin gave shape {o.shape}, expected ({bodies},): coordinates and rates")
            o = o.copy()
            for q in (o[c.q] for c in m.coordinates if c.q.stop - c.q.start == 4):
                q /= np.linalg.norm(q) or 1.0  # rates are of the attitude that is meant
            return np.concatenate([o[: m.nq], momenta_from_rates(m, o[: m.nq], o[m.nq : bodies]), o[bodies:] if len(o) > bodies else x[rest:]])

        if begin := options.get("begin"):
            options["begin"] = lambda uniform, x: state(begin(uniform, _in_rates(m, x)), x)

    @classmethod
    def from_scene(cls, scene: PathLike | Scene, *, cases: int = 0, change: Mapping[str, float | Sequence[float]] | None = None, **options: Any):
        """The model, the start, the method and the step of a scene, a file or a Scene; options replace them.

        change: numbers in place of those of the file, as Scene has it.
        cases: every episode begins as one of the first `cases` of the scene's [ensemble], drawn with the seed: its start and, where
        cases differ in other numbers than of [initial], its model (`cases` says which). 0: as the scene. It excludes begin.
        """
        for name, what in (("reward", "a function of observations and actions"), ("limit", "the largest input of each port: a number, one for each, or by names")):
            if name not in options:
                raise TypeError(f"from_scene(): '{name}' is missing, expected {what}")
        known = scene_of(scene, change)
        found = assemblies_of(known, cases, options)
        start = {"method": known.data.method, "step": known.data.step, "mechanism": found[0].mechanism, "scene": known, "_cases": found}
        env = cls(found[0].model, found[0].start, **{**start, **options})
        if known is not scene:
            env._recipe = scene, {"cases": cases, "change": change, **options}
        return env

    def __reduce__(self):
        if self._recipe is None:
            raise TypeError("an environment of a model is not pickled or copied, expected one by from_scene(path, change=...), or one that is made where it is used")
        return _made_by, (type(self), *self._recipe)

    @property
    def batch(self) -> Environment:
        """The environments below: states, energies, lengths of episodes."""
        return self._batch

    @property
    def mechanism(self) -> Mechanism | None:
        """The one whose coordinates are the first nq numbers of an observation, for body_pose(mechanism, q, body); None: the model names none."""
        return self._mechanism

    @property
    def cases(self) -> np.ndarray:
        """The case of from_scene(cases=...) that each environment is, from 0, at what reward sees: in the step that ends an episode, the ended one's."""
        return self._batch.final_cases.copy()

    @property
    def energies(self) -> np.ndarray:
        """H of each environment [J] at what reward sees: in the step that ends an episode, at its end."""
        return self._batch.final_energies.copy()

    def _seen(self, x: np.ndarray, cases: np.ndarray, steps: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        with np.errstate(over="ignore"):  # what is not finite then has failed
            return self._sight.see(x, cases, steps * self._batch.interval, u).astype(self._dtype)

    def _last(self, steps: np.ndarray, u: np.ndarray) -> np.ndarray:
        """What was observed at the end of the step with the actions u, before a next episode."""
        return self._seen(self._batch.final_observations, self._batch.final_cases, steps - self._batch.failed, u)

    def _rewards(self, last: np.ndarray, u: np.ndarray) -> np.ndarray:
        return of_each("reward", self._reward(read_only(last), read_only(u)), self.num_envs).astype(np.float64)

    def _fail(self, wrong: np.ndarray, whys: list[str], why: Callable[[int], str]) -> None:
        self._batch.end(wrong, failed=True)
        for i in np.flatnonzero(wrong):
            whys[i] = whys[i] or why(i)

    def _judged(self, u: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """What was observed last, the rewards, and why copies failed. Ends the episodes that have blown up and those that `terminated` names."""
        last, whys = self._last(steps, u), self._batch.outcomes
        if (wrong := ~np.isfinite(last).all(axis=1)).any():
            seen = last
            self._fail(wrong, whys, lambda i: f"'{self.names[int(np.argmin(np.isfinite(seen[i])))]}' is not finite in {self._dtype}")
            last = self._last(steps, u)
        rewards = self._rewards(last, u)
        if (wrong := ~np.isfinite(rewards) & (np.abs(last) > 1e9).any(axis=1)).any():
            far, gave, names = np.abs(last).argmax(axis=1), rewards, self.names
            seen = last
            self._fail(wrong, whys, lambda i: f"the reward is {gave[i]} where '{names[far[i]]}' is {seen[i, far[i]]:.3g}")
            last = self._last(steps, u)
            rewards = self._rewards(last, u)
        if (wrong := ~np.isfinite(rewards) & ~self._batch.failed).any():
            where = f" for environment {int(np.flatnonzero(wrong)[0])}" if self.num_envs > 1 else ""
            raise InvalidArgument(f"reward gave {rewards[wrong][0]}{where}, expected a finite number")
        if self._terminated:
            over = of_each("terminated", self._terminated(read_only(last), read_only(u)), self.num_envs)
            if over.dtype != bool:
                raise InvalidArgument(f"terminated gave {over.dtype}, expected True or False of each environment")
            self._batch.end(over)
        return last, rewards, whys

    def reset(self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None):
        """(observations, info): the first episode of the seed, or the next, which a copy whose episode has just ended has begun. Of a number, environment i has the seed + i, as in Gymnasium; a list has one for each."""
        if options:
            raise InvalidArgument(f"reset() has options {', '.join(map(repr, options))}, expected none: begin says where episodes begin")
        several = isinstance(seed, (list, tuple, np.ndarray))
        super().reset(seed=None if several else seed)
        seeds = list(seed) if several else None if seed is None else [(int(seed) + i) % 2**64 for i in range(self.num_envs)]
        x = self._batch.reset(None) if seeds is None else self._batch.reset_each(seeds)
        self._begun = True
        return self._seen(x, self._batch.cases, self._batch.lengths, None), {}

    def step(self, actions):
        """(observations, rewards, terminated, truncated, info). Before the first reset() it is refused."""
        if not self._begun:
            raise InvalidArgument("no episode is running, expected reset() before step()")
        given = np.asarray(actions, dtype=np.float64)
        if given.shape != self.action_space.shape:
            raise InvalidArgument(f"actions have shape {given.shape}, expected {self.action_space.shape}")
        u = np.ascontiguousarray(np.clip(given, -self._limit, self._limit))
        steps = self._batch.lengths + 1
        self._batch.step(u)
        last, rewards, whys = self._judged(u, steps)
        observations, info = last, {}
        terminated, truncated, failed = (flags.copy() for flags in (self._batch.terminated, self._batch.truncated, self._batch.failed))
        if (ended := terminated | truncated).any():
            acting = np.where(ended[:, None], 0, u)  # an episode begins without
            observations = self._seen(self._batch.observations, self._batch.cases, self._batch.lengths, acting)
            info = {"final_obs": last, "_final_obs": ended}
        if failed.any():
            end = steps * self._batch.interval
            told = [why and f"the step from {t - self._batch.interval:.6g} s to {t:.6g} s of the episode: {why}" for why, t in zip(whys, end)]
            info["failed"], info["failure"] = failed, np.array(told, dtype=object)
        return observations, rewards, terminated, truncated, info

    def render(self) -> tuple[np.ndarray, ...]:
        """A picture of each environment, (height, width, 3), by a Chromium without a window: some tens of milliseconds each."""
        return self._draw([self._batch.state(i).x for i in range(self.num_envs)])

    def _draw(self, states: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        if self.render_mode is None:
            raise InvalidArgument("render_mode is None, expected render_mode='rgb_array' when the environment is made")
        if self._picture is None:
            self._picture = _picture_of(self._scene, self._mechanism, self._look)
        return tuple(self._picture.picture(x[: self._mechanism.nq]) for x in states)

    def close(self, **_: Any) -> None:
        """Ends the browser that drew pictures."""
        self._picture = None


class Env(_EnvBase):
    """One environment, as gymnasium.Env: see VectorEnv for the arguments. reward(observation, action) -> float, and terminated(observation, action) -> bool.

    An episode begins with reset(); before the first and after the end of one step() is refused.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}
    render_mode = None
    _recipe: tuple[PathLike, dict[str, Any]] | None = None

    def __init__(self, model: Model, start, *, reward: Callable[[np.ndarray, np.ndarray], float], limit: float | Sequence[float] | Mapping[str, float],
                 terminated: Callable[[np.ndarray, np.ndarray], bool] | None = None, **options: Any):
        if "num_envs" in options:
            raise InvalidArgument("num_envs is of VectorEnv, an Env is one")
        if not callable(reward):
            raise InvalidArgument(f"reward is {reward!r}, expected a function of an observation and an action")
        self._reward, self._ended, self._end = reward, True, None
        each = (lambda o, u: np.reshape(terminated(o[0], u[0]), -1)) if callable(terminated) else terminated
        self._vector = VectorEnv(model, start, reward=self._rewards, terminated=each, limit=limit, **options)
        self.observation_space = self._vector.single_observation_space
        self.action_space = self._vector.single_action_space
        self.names, self.action_names, self.render_mode = self._vector.names, self._vector.action_names, self._vector.render_mode

    from_scene = classmethod(VectorEnv.from_scene.__func__)
    __reduce__ = VectorEnv.__reduce__

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        """(observation, info)."""
        super().reset(seed=seed)
        observations, info = self._vector.reset(seed=seed, options=options)
        self._ended, self._end = False, None
        return observations[0], info

    def _rewards(self, observations: np.ndarray, actions: np.ndarray) -> list[float]:
        given = np.asarray(self._reward(observations[0], actions[0]), dtype=np.float64)
        if given.ndim > 0:
            raise InvalidArgument(f"reward gave {given}, expected a finite number")
        return [float(given)]

    def step(self, action):
        """(observation, reward, terminated, truncated, info)."""
        if self._ended:
            raise InvalidArgument("no episode is running, expected reset() before step(): at the start, and after an episode has ended")
        if np.shape(action) != self.action_space.shape:
            raise InvalidArgument(f"the action has shape {np.shape(action)}, expected {self.action_space.shape}")
        observations, rewards, terminated, truncated, info = self._vector.step(np.asarray(action)[None])
        self._ended = bool(terminated[0] or truncated[0])
        self._end = self.batch.final_observations[0].copy() if self._ended else None
        return info.get("final_obs", observations)[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), {"failed": True, "failure": info["failure"][0]} if "failed" in info else {}

    @property
    def batch(self) -> Environment:
        """The environment below: state, energy, length of the episode."""
        return self._vector.batch

    @property
    def mechanism(self) -> Mechanism | None:
        """As VectorEnv.mechanism."""
        return self._vector.mechanism

    @property
    def case(self) -> int:
        """As VectorEnv.cases, at the last observation."""
        return int(self._vector.cases[0])

    @property
    def energy(self) -> float:
        """H [J] at the last observation."""
        return float(self._vector.energies[0])

    def render(self) -> np.ndarray:
        """A picture, (height, width, 3); after an episode has ended that of its end, until reset()."""
        return (self._vector.render() if self._end is None else self._vector._draw([self._end]))[0]

    def close(self) -> None:
        """Ends the browser that drew pictures."""
        self._vector.close()
