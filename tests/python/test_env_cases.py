"""Domain randomisation: episodes begin as cases of a scene, with models of their own."""
import pickle

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused

KW = dict(limit=5.0, step=0.01, substeps=2, method="gauss4", dtype=np.float64)
VARY = """
[[element]]
type = "friction"
joint = "elbow"
coulomb = 0.1
smoothing = 0.05
[ensemble]
cases = 6
[ensemble.vary]
"model.mass_factor.lower" = { uniform = [0.5, 2] }
"element[0].coulomb" = { uniform = [0, 0.5] }
"initial.joints.elbow.velocity" = { uniform = [-1, 1] }
"""


def rewards_of_effort(obs, action):
    return -(action**2).sum(axis=1)


def reward_of_effort(obs, action):
    return -float((action**2).sum())


@pytest.fixture
def scene(source, tmp_path):
    (tmp_path / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    path = tmp_path / "scene.toml"
    path.write_text((source / "examples/double_pendulum/scene.toml").read_text() + VARY)
    return path


def test_each_copy_is_the_environment_of_its_case(scene):
    e = ph.VectorEnv.from_scene(scene, cases=6, num_envs=11, reward=rewards_of_effort, **KW)
    obs, _ = e.reset(seed=3)
    assert len(set(e.cases)) > 3
    alone = [ph.Env.from_scene(ph.Scene(scene, case=k), reward=reward_of_effort, **KW) for k in e.cases]
    assert all(np.array_equal(a.reset()[0], o) for a, o in zip(alone, obs))
    rng = np.random.default_rng(0)
    for _ in range(30):
        u = rng.uniform(-5, 5, e.action_space.shape)
        obs, rewards, *_ = e.step(u)
        one = [a.step(v) for a, v in zip(alone, u)]
        assert np.array_equal(obs, [o[0] for o in one]) and np.array_equal(rewards, [o[1] for o in one])
        assert np.array_equal(e.energies, [a.energy for a in alone])
    nominal = ph.VectorEnv.from_scene(scene, num_envs=11, reward=rewards_of_effort, **KW)
    nominal.reset(seed=3)
    for i in range(11):
        nominal.batch.set_state(i, e.batch.state(i))
    v = e.step(u)[0]
    assert np.abs(nominal.step(u)[0] - v).max() > 1e-3  # control: the models differ


def play(scene, **options):
    e = ph.VectorEnv.from_scene(scene, cases=6, num_envs=11, longest=7, reward=rewards_of_effort, **{**KW, **options})
    seen = [e.reset(seed=9)[0].copy()]
    for k in range(20):
        obs, *_, info = e.step(np.full(e.action_space.shape, np.sin(k)))
        seen += [obs, e.cases[:, None], *([info["final_obs"]] if info else [])]
    return np.hstack(seen)


def test_every_episode_draws_its_case_with_the_seed_on_any_number_of_threads(scene):
    one = play(scene)
    assert np.array_equal(one, play(scene, threads=2)) and np.array_equal(one, play(ph.Scene(scene)))
    assert not np.array_equal(one, play(scene, ended=lambda x: abs(x[0]) > 0.9))  # control
    e = ph.VectorEnv.from_scene(scene, cases=6, num_envs=11, longest=2, reward=rewards_of_effort, **KW)
    e.reset(seed=9)
    drawn = []
    for _ in range(8):
        e.step(np.zeros(e.action_space.shape))
        drawn.append(e.cases)
    assert all(np.array_equal(a, b) for a, b in zip(drawn[::2], drawn[1::2])) and not np.array_equal(drawn[1], drawn[2])
    assert len({c[0] for c in drawn}) > 1


def test_rates_are_of_the_model_of_the_case(scene):
    seen = []
    e = ph.VectorEnv.from_scene(scene, cases=6, num_envs=11, rates=True, reward=rewards_of_effort, ended=lambda o: seen.append(o.copy()) or o[3] > 1.5, **KW)
    e.reset(seed=1)
    for _ in range(40):
        seen.clear()
        _, _, terminated, _, info = e.step(np.full(e.action_space.shape, 4.0))
        if terminated.any():
            break
    assert terminated.any() and np.array_equal(np.sort(np.array(seen)[:, 3]), np.sort(info["final_obs"][:, 3]))
    assert (info["final_obs"][:, 3] > 1.5).tolist() == terminated.tolist()


def test_they_are_pickled_and_changed(scene):
    e = ph.Env.from_scene(scene, cases=6, change={"environment.vector[2]": -1.62}, reward=reward_of_effort, **KW)
    again = pickle.loads(pickle.dumps(e))
    assert np.array_equal(e.reset(seed=2)[0], again.reset(seed=2)[0]) and e.case == again.case
    u = np.full(e.action_space.shape, 0.5)
    on_earth = ph.Env.from_scene(scene, cases=6, reward=reward_of_effort, **KW)
    on_earth.reset(seed=2)
    moved = e.step(u)[0]
    assert np.array_equal(moved, again.step(u)[0]) and not np.array_equal(moved, on_earth.step(u)[0])
    given = ph.Env.from_scene(ph.Scene(scene, change={"environment.vector[2]": -1.62}), cases=6, reward=reward_of_effort, **KW)
    given.reset(seed=2)
    assert np.array_equal(given.step(u)[0], moved)
    with pytest.raises(TypeError, match="expected one by from_scene\\(path, change=...\\)"):
        pickle.dumps(given)
    refused(lambda: ph.Env.from_scene(ph.Scene(scene), change={"environment.vector[2]": -1.0}, reward=reward_of_effort, **KW), "change is given besides a Scene")
    refused(lambda: ph.Env.from_scene(scene, change={"environment.vector[7]": -1.0}, reward=reward_of_effort, **KW), "vector")


def test_a_scene_is_left_as_it_was(source):
    scene = ph.Scene(source / "examples/ets_vii/scene.toml")
    before = scene.model.description.nx
    ph.Env.from_scene(scene, reward=reward_of_effort, **KW)
    assert not scene.data.centre_stays and scene.model.description.nx == before


def test_episodes_of_a_seed_have_its_draws_once_each(scene):
    kw = dict(cases=6, longest=2, **KW)
    cases, energies, drawn = [], [], []
    one = ph.Env.from_scene(scene, reward=lambda o, u: (cases.append(one.case), energies.append(one.energy)) and 0.0, **kw)
    for episode in range(8):
        obs, _ = one.reset(seed=4 if episode == 0 else None)
        drawn.append(obs)
        begun = one.case, one.energy
        while not one.step(np.zeros(one.action_space.shape))[3]:
            pass
        assert cases[-2:] == [begun[0]] * 2 and abs(energies[-1] - begun[1]) < 0.1, "of the new episode after reset"
    batch = ph.VectorEnv.from_scene(scene, reward=rewards_of_effort, **kw)
    seen = [batch.reset(seed=4)[0][0]]
    while len(seen) < 8:  # episodes that begin by themselves
        obs, _, _, truncated, _ = batch.step(np.zeros(batch.action_space.shape))
        if truncated[0]:
            seen.append(obs[0] if len(seen) % 2 else batch.reset()[0][0])
    assert np.array_equal(drawn, seen) and len(np.unique(drawn, axis=0)) > 4
    first = [one.reset(seed=4)[0], one.reset()[0]]
    assert np.array_equal(first, drawn[:2])  # control: a reset after a reset draws
