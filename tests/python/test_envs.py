"""Env and VectorEnv: the interface of Gymnasium, with and without the package."""
import importlib.util
import pickle
import shutil
import sys
import types

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused

chromium = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)
KW = dict(step=0.01, substeps=2, ports=["upper.torque"], limit=2.0)


def many(pendulum, **options):
    model = ph.MechanicalModel(pendulum)
    return ph.VectorEnv(model, model.state([0.1, 0.2], [0.3, -0.4]), **{**KW, "num_envs": 3, "reward": lambda o, u: -(o**2).sum(axis=1), **options})


def one(pendulum, **options):
    model = ph.MechanicalModel(pendulum)
    return ph.Env(model, model.state([0.1, 0.2], [0.3, -0.4]), **{**KW, "reward": lambda o, u: -float(u[0] ** 2), **options})


def test_observations_are_coordinates_and_rates_by_name(pendulum):
    e = many(pendulum)
    assert e.names == ["upper", "lower", "rate of upper", "rate of lower"] and e.action_names == ["upper.torque"]
    obs, info = e.reset(seed=1)
    assert obs.dtype == np.float32 and obs.shape == e.observation_space.shape and info == {}
    assert np.abs(obs - np.float32([0.1, 0.2, 0.3, -0.4])).max() < 1e-7
    # rates are what positions do: the reason why observations are not momenta
    before = obs.copy()
    after, *_ = e.step(np.zeros((3, 1)))
    assert np.abs((after[:, :2] - before[:, :2]) / 0.02 - 0.5 * (before + after)[:, 2:]).max() < 2e-3


def test_a_reward_may_ask_where_a_body_is(pendulum, source):
    reach = lambda obs, u: -np.linalg.norm(hand(e, obs), axis=-1)
    hand = lambda env, obs: ph.body_pose(env.mechanism, obs[..., : env.mechanism.nq].astype(float), env.mechanism.bodies[-1])[1]
    e = many(pendulum, reward=reach)
    s = one(pendulum, reward=lambda obs, u: -float(np.linalg.norm(hand(s, obs))))
    e.reset(seed=1), s.reset(seed=1)
    obs, rewards, *_ = e.step(np.ones((3, 1)))
    assert np.array_equal(rewards, reach(obs, None)) and np.abs(rewards).min() > 0.1 and s.step(np.ones(1))[1] == rewards[0]
    assert e.mechanism is s.mechanism is pendulum
    scene = ph.Env.from_scene(source / "examples/ets_vii/scene.toml", reward=reward_of_nothing, limit=1.0)
    assert scene.mechanism.nq == sum(not n.startswith("rate of") for n in scene.names)
    with pytest.raises(AttributeError):
        s.mechanism = pendulum


def test_float32_and_float64_actions_are_the_same(pendulum):
    a, b = many(pendulum), many(pendulum)
    for e in (a, b):
        e.reset(seed=3)
    u = np.float32([[0.5], [-1.25], [9.0]])
    x, y = a.step(u), b.step(u.astype(np.float64))
    assert np.array_equal(x[0], y[0]) and np.array_equal(x[1], y[1])
    b.reset(seed=3), a.reset(seed=3)
    assert np.array_equal(a.step(np.full((3, 1), 2.0))[0][2], b.step(u)[0][2])  # 9 is cut off at the limit of 2
    assert not np.array_equal(a.step(u)[0][0], a.step(-u)[0][0])  # control: actions do something


def test_episodes(pendulum):
    e = many(pendulum, longest=3)
    e.reset(seed=0)
    infos = [e.step(np.zeros((3, 1))) for _ in range(3)]
    *_, truncated, info = infos[-1]
    assert truncated.all() and info["_final_obs"].all() and not infos[0][3].any() and infos[0][4] == {}
    assert not np.array_equal(info["final_obs"], infos[-1][0])  # one is the end, the other the new start
    s = one(pendulum, longest=3)
    obs, _ = s.reset(seed=0)
    for k in range(3):
        obs, reward, terminated, truncated, info = s.step(np.float32([0.5]))
        assert s.observation_space.contains(obs) and reward == -0.25 and isinstance(truncated, bool)
    assert truncated and not terminated and not np.array_equal(obs, s.reset()[0])


def test_what_floats_falls(tmp_path):
    (tmp_path / "arm.urdf").write_text("<robot name='brick'><link name='brick'><inertial><mass value='2'/>"
                                       "<inertia ixx='1' iyy='2' izz='3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>")
    (tmp_path / "scene.toml").write_text("[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[environment]\ngravity = 'uniform'\nvector = [0, 0, -9.81]\n"
                                         "[initial]\nbase = { position = [0, 0, 5], linear_velocity = [0.5, 0, 0] }\n"
                                         "[integrator]\nmethod = 'gauss4'\nstep = 0.01\n[run]\nduration = 1.0\n")
    e = ph.VectorEnv.from_scene(tmp_path / "scene.toml", reward=lambda o, u: np.zeros(1), limit=1.0, dtype=np.float64)
    place = [e.names.index(f"base.position[{k}]") for k in range(3)]
    obs, _ = e.reset(seed=0)
    assert np.allclose(obs[0, place], [0, 0, 5], atol=1e-12)
    before = e.energies
    for _ in range(100):
        obs, *_ = e.step(np.zeros(e.action_space.shape))
    assert np.allclose(obs[0, place], [0.5, 0, 5 - 9.81 / 2], atol=1e-9)
    e.step(np.ones(e.action_space.shape))
    assert abs(e.energies - before)[0] > 1e-6, "energies are copies: a difference is one"


def test_a_seed_for_each_environment(pendulum):
    e = many(pendulum, begin=lambda uniform, x: x + uniform(len(x)))
    first, second = e.reset(seed=[1, 2, 3])[0].copy(), e.reset(seed=[1, 2, 4])[0].copy()
    assert np.array_equal(first[:2], second[:2]) and not np.array_equal(first[2], second[2])
    assert np.array_equal(e.reset(seed=(1, 2, 3))[0], first)
    alone = one(pendulum, begin=lambda uniform, x: x + uniform(len(x)))  # each begins as it would alone, now and in the next episode
    for k, seed in enumerate((1, 2, 3)):
        assert np.array_equal(alone.reset(seed=seed)[0], first[k])
    second = e.reset()[0]
    assert np.array_equal(alone.reset()[0], second[2]) and not np.array_equal(second[2], first[2])
    from_one = e.reset(seed=1)[0]  # as Gymnasium counts on from one seed; control: from another
    assert np.array_equal(from_one, first) and not np.array_equal(e.reset(seed=2)[0], first)
    with pytest.raises(ph.InvalidArgument, match="seeds of an environment"):
        e.reset(seed=[1, 2])


def test_from_a_scene(source):
    scene = source / "examples/ets_vii/scene.toml"
    e = ph.Env.from_scene(scene, ports=["joint_1.torque"], limit=1.0, reward=lambda o, u: 0.0, method="gauss4", step=0.1)
    obs, _ = e.reset(seed=0)
    assert abs(obs[e.names.index("joint_1")] - 0.3) < 1e-6 and abs(obs[e.names.index("rate of joint_1")] - 0.05) < 1e-6
    assert np.array_equal(e.step(np.float32([0]))[0].shape, e.observation_space.shape)


def test_episodes_begin_as_the_cases_of_a_scene(source, tmp_path):
    text = (source / "examples/double_pendulum/scene.toml").read_text()
    (tmp_path / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    vary = '[ensemble]\ncases = 12\n[ensemble.vary]\n"initial.joints.elbow.position" = { uniform = [-2, 2] }\n'
    scene = tmp_path / "scene.toml"
    scene.write_text(text + vary)
    known = [ph.Scene(scene, case=k).assembly.initial.x for k in range(12)]
    options = dict(limit=1.0, step=0.01, method="gauss4", longest=1, reward=lambda o, u: np.zeros(len(o)), dtype=np.float64)
    e = ph.VectorEnv.from_scene(scene, cases=12, num_envs=40, **options)
    e.reset(seed=5)
    drawn = [[k for k in range(12) if np.array_equal(e.batch.state(i).x, known[k])] for i in range(40)]
    assert all(len(k) == 1 for k in drawn) and len({k[0] for k in drawn}) > 6
    again = ph.VectorEnv.from_scene(scene, cases=12, num_envs=40, threads=2, **options)
    assert np.array_equal(e.reset(seed=5)[0], again.reset(seed=5)[0]) and not np.array_equal(e.reset(seed=6)[0], again.reset(seed=5)[0])
    one = ph.Env.from_scene(scene, cases=3, **{**options, "reward": lambda o, u: 0.0})
    assert one.reset(seed=1)[0].shape == (4,)
    refused(lambda: ph.VectorEnv.from_scene(scene, cases=13, **options), "cases is 13, expected 1 to the 12 of [ensemble]")
    refused(lambda: ph.VectorEnv.from_scene(scene, cases=2, begin=lambda u, x: x, **options), "begin is given besides cases")


def test_pictures_of_a_scene(source):
    scene = source / "examples/double_pendulum/scene.toml"
    options = dict(limit=1.0, step=0.01, method="gauss4", num_envs=2, reward=lambda o, u: np.zeros(len(o)))
    e = ph.VectorEnv.from_scene(scene, render_mode="rgb_array", picture=dict(size=(320, 240), camera="y"), **options)
    e.reset(seed=1)
    if not chromium:
        return refused(e.render, "no Chromium or Chrome was found")
    first, second = e.render()
    assert first.shape == (240, 320, 3) and first.dtype == np.uint8 and np.array_equal(first, second) and first.std() > 3
    for _ in range(60):
        e.step(np.array([[0.0], [1.0]]) * np.ones(e.single_action_space.shape))
    first, second = e.render()
    assert (first != second).any(axis=2).sum() > 200  # the other one moved
    e.close()
    one = ph.Env.from_scene(scene, render_mode="rgb_array", picture=dict(size=(320, 240), camera="y"), limit=1.0, step=0.01, method="gauss4", longest=60, reward=lambda o, u: 0.0)
    one.reset(seed=1)
    begin = one.render()
    for _ in range(60):
        one.step(np.ones(one.action_space.shape))
    assert (one.render() != begin).any(axis=2).sum() > 200  # the end of the episode, not the start of the next
    one.reset()
    assert np.array_equal(one.render(), begin)
    one.close()
    refused(ph.VectorEnv.from_scene(scene, **options).render, "render_mode is None")
    refused(lambda: ph.VectorEnv.from_scene(scene, render_mode="human", **options), "render_mode is 'human', expected 'rgb_array'")


def test_without_a_scene_there_are_no_pictures(pendulum):
    refused(lambda: many(pendulum, render_mode="rgb_array"), "no scene to draw by")


def test_wrong_arguments_are_refused(pendulum):
    refused(lambda: many(pendulum, limit=0), "limit is 0")
    refused(lambda: many(pendulum, observed=[0]), "observed is [0], expected a list of names: upper, lower, rate of upper, ...")
    refused(lambda: many(pendulum, observed=["uper"]), "observed has 'uper', expected a name of the state", "'upper'")
    refused(lambda: many(pendulum, outputs=True), "outputs is of Environment, expected observed=")
    refused(lambda: one(pendulum, num_envs=2), "num_envs is of VectorEnv")
    refused(lambda: ph.Env(pendulum, np.zeros(4), **{**KW, "reward": lambda o, u: 0.0}), "model is a Mechanism, expected a Model, as MechanicalModel(mechanism)")
    refused(lambda: many(pendulum, ports=["upper.torque"] * 2), "the port 'upper.torque' is named twice")
    e = many(pendulum, reward=lambda o, u: 0.0)
    e.reset(seed=0)
    refused(lambda: e.step(np.zeros((3, 1))), "reward gave shape ()", "(3,)")
    refused(lambda: many(pendulum, limit="5"), "limit is '5', expected a number above 0")
    refused(lambda: many(pendulum, reward=None), "reward is None, expected a function")
    refused(lambda: many(pendulum, dtype=int), "dtype is int64, expected one of floating point")
    e = many(pendulum, reward=lambda o, u: [1.0, np.nan, 1.0])
    e.reset(seed=0)
    refused(lambda: e.step(np.zeros((3, 1))), "reward gave nan for environment 1, expected a finite number")
    for reward, says in ((None, "reward is None"), (lambda o, u: None, "reward gave nan"), (lambda o, u: u, "reward gave [0.5]")):
        refused(lambda: (s := one(pendulum, reward=reward)).reset(seed=0) and s.step(np.float32([0.5])), says)


def test_an_episode_that_has_ended_wants_a_reset(pendulum):
    e = one(pendulum, longest=2)
    refused(lambda: e.step(np.zeros(1)), "no episode is running, expected reset()")
    e.reset(seed=0)
    assert [e.step(np.zeros(1))[3] for _ in range(2)] == [False, True]
    refused(lambda: e.step(np.zeros(1)), "no episode is running, expected reset()")
    e.reset()
    assert not e.step(np.zeros(1))[3]
    refused(lambda: e.step(0.1), "the action has shape (), expected (1,)")


def test_with_gymnasium(monkeypatch, pendulum):
    """The classes of gymnasium are used where it is there; here a stand-in with what is used of it."""
    class Box:
        def __init__(self, low, high, shape, dtype):
            self.shape, self.dtype = shape, dtype

    seeds = []  # gymnasium's own generator is seeded by the reset of the base class
    base = {"reset": lambda self, *, seed=None, options=None: seeds.append(seed)}
    fake = types.ModuleType("gymnasium")
    fake.Env = type("Env", (), dict(base))
    fake.vector = types.SimpleNamespace(VectorEnv=type("VectorEnv", (), dict(base)), AutoresetMode=types.SimpleNamespace(SAME_STEP="same"))
    fake.spaces = types.SimpleNamespace(Box=Box)
    monkeypatch.setitem(sys.modules, "gymnasium", fake)
    spec = importlib.util.spec_from_file_location("porthos.envs_again", ph.envs.__file__)
    again = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(again)
    assert issubclass(again.Env, fake.Env) and issubclass(again.VectorEnv, fake.vector.VectorEnv)
    model = ph.MechanicalModel(pendulum)
    e = again.VectorEnv(model, model.state([0, 0], [0, 0]), num_envs=2, reward=lambda o, u: np.zeros(2), **KW)
    assert isinstance(e.action_space, Box) and e.metadata["autoreset_mode"] == "same"
    assert e.reset(seed=1)[0].shape == (2, 4) and seeds == [1]


def test_statistics_of_errors(pendulum):
    model = ph.MechanicalModel(pendulum)
    r = ph.simulate(model, model.state([1.0, 0.5], [0, 0]), step=0.02, duration=20, method="gauss4")
    s = ph.error_statistics(r["energy_error"])
    e = r.summary["energy"]
    told = np.nan if e["growth_exponent"] is None else e["growth_exponent"]
    np.testing.assert_allclose(s["growth_exponent"], told, atol=1e-9)
    assert s["drift_is_significant"] == e["drift_is_significant"]
    rng = np.random.default_rng(1)
    walk, drift = np.cumsum(rng.normal(size=4096)), np.arange(4096.0) + rng.normal(size=4096)
    small = 1e-16 * walk
    assert ph.error_statistics(1e6 * small, scale=1e6)["words"] == ph.error_statistics(small)["words"] != ph.error_statistics(1e6 * small)["words"]
    refused(lambda: ph.error_statistics(walk, scale=0), "scale is 0")
    a, b = ph.error_statistics(walk), ph.error_statistics(drift)
    assert 0.4 < a["growth_exponent"] < 0.6 and not a["drift_is_significant"]
    assert b["words"].startswith("drifts, like t or faster") and "per record" in b["words"]
    assert b["growth_exponent"] > 0.75 and b["drift_is_significant"] and b["max_abs"] == np.abs(drift).max()
    still = ph.error_statistics(np.full(100, 3e-9))
    assert still["growth_exponent"] == 0 and still["words"].startswith("stays bounded") and not still["drift_is_significant"]
    refused(lambda: ph.error_statistics([0.0, np.nan]), "not finite")
    assert ph.error_statistics([])["words"].startswith("has too few records")


def test_reward_of_the_last_step_sees_the_energy_at_its_end(pendulum):
    seen = []
    e = many(pendulum, longest=3, reward=lambda o, u: seen.append((o.copy(), e.energies.copy())) or np.zeros(3))
    e.reset(seed=1)
    for _ in range(3):
        e.step(np.full((3, 1), 2.0))
    for observed, energies in seen:
        for o, H in zip(observed.astype(float), energies):
            q, v = o[:2], o[2:]
            expected = ph.kinetic_energy(pendulum, q, ph.momenta_from_rates(pendulum, q, v)) + ph.potential_energy(pendulum, q)
            assert abs(H - expected) < 1e-5 * abs(H) + 1e-5  # observations are float32
    assert not np.array_equal(e.energies, e.batch.energies)  # those are of the next start, the control
    f = one(pendulum)
    f.reset(seed=1)
    f.step(np.array([0.5]))
    assert f.energy == f.batch.energies[0]


def test_what_an_environment_does_not_take(pendulum, source):
    e = many(pendulum)
    e.reset(seed=1)
    for shape in ((1, 3), (3,), (3, 1, 1)):
        refused(lambda s=shape: e.step(np.zeros(s)), f"actions have shape {shape}, expected (3, 1)")
    refused(lambda: many(pendulum, longest=-1), "longest is -1, expected 0 or more")
    refused(lambda: ph.Env.from_scene(source / "examples/two_arms/scene.toml", reward=lambda o, u: 0.0, limit=1.0), "has events (first: capture of load by left_hand), which an environment does not see")
    refused(lambda: many(pendulum, begin=lambda uniform, x: x * np.nan), "is not finite")


def test_begin_and_ended_in_rates(pendulum):
    def begin(uniform, o):
        assert np.abs(o - [0.1, 0.2, 0.3, -0.4]).max() < 1e-15
        return [0.5, -0.5, 1.0, -2.0 * uniform(1)[0]]

    e = many(pendulum, rates=True, begin=begin, ended=lambda o: o[2] < 0.9, dtype=np.float64)
    seen, _ = e.reset(seed=4)
    assert np.abs(seen[:, :3] - [0.5, -0.5, 1.0]).max() < 1e-15 and len(set(seen[:, 3])) == 3
    in_momenta = many(pendulum, begin=lambda uniform, x: [0.5, -0.5, 1.0, -2.0], dtype=np.float64).reset(seed=4)[0]
    assert np.abs(in_momenta[:, 2] - 1.0).min() > 0.01  # control: momenta are no rates
    for _ in range(40):
        _, _, terminated, _, info = e.step(np.full((3, 1), -2.0))
        if terminated.any():
            assert (info["final_obs"][terminated, 2] < 0.9).all()
            break
    else:
        raise AssertionError("no episode ended")
    refused(lambda: many(pendulum, rates=True, begin=lambda uniform, o: o[:3]).reset(), "begin gave shape (3,), expected (4,)")
    refused(lambda: many(pendulum, rates=True, begin=lambda uniform, o: None).reset(), "begin returns None, expected")


@pytest.mark.parametrize("example, varied", [("double_pendulum", "initial.joints.elbow.velocity"), ("ets_vii", "initial.joints.joint_1.position")])
def test_cases_begin_where_they_were_drawn_with_rates_too(source, tmp_path, example, varied):
    for file in (source / "examples" / example).glob("*.urdf"):
        shutil.copy(file, tmp_path)
    text = (source / "examples" / example / "scene.toml").read_text() + f'[ensemble]\ncases = 5\n[ensemble.vary]\n"{varied}" = {{ uniform = [-0.5, 0.5] }}\n'
    (tmp_path / "scene.toml").write_text(text)
    kw = dict(cases=5, num_envs=9, limit=1.0, step=0.01, method="gauss4", reward=lambda o, u: np.zeros(9), dtype=np.float64)
    plain, rates = (ph.VectorEnv.from_scene(tmp_path / "scene.toml", rates=r, **kw) for r in (False, True))
    seen = plain.reset(seed=2)[0]
    off = np.abs(rates.reset(seed=2)[0] - seen).max()
    nq = ph.Scene(tmp_path / "scene.toml").assembly.mechanism.nq
    momenta = np.array([plain.batch.state(i).x[nq : seen.shape[1]] for i in range(9)])
    control = np.abs(momenta - seen[:, nq:]).max()
    print(f"{example}: {off:.1e}, bound 0; momenta taken as rates {control:.1e}, control, must exceed 1e-2")
    assert off == 0 and control > 1e-2


def test_a_reward_cannot_change_what_the_agent_gets(pendulum):
    def scaled(o, u):
        o /= 10
        return np.zeros(3)

    for make, reward in ((many, scaled), (one, scaled), (one, lambda o, u: u.fill(0) or 0.0)):
        e = make(pendulum, reward=reward)
        e.reset(seed=0)
        with pytest.raises(ValueError, match="read-only"):
            e.step(np.zeros(e.action_space.shape))
    e = many(pendulum, reward=lambda o, u: (o / 10)[:, 0])  # control: a copy may be written, and so may what the agent gets
    e.reset(seed=0)
    obs, rewards, *_ = e.step(np.zeros((3, 1)))
    assert np.abs(rewards - obs[:, 0] / 10).max() < 1e-7 and obs.flags.writeable


def test_options_that_do_not_fit(pendulum, source, tmp_path):
    scene = source / "examples/double_pendulum/scene.toml"
    kw = dict(reward=lambda o, u: 0.0, limit=1.0)
    refused(lambda: ph.Env.from_scene(scene, ports="elbow.torque", **kw), "ports is 'elbow.torque', expected a list of names: ['elbow.torque']")
    for wrong, meant in (("limt", "limit"), ("case", "cases"), ("substep", "substeps"), ("rewards", "reward")):
        refused(lambda: ph.VectorEnv.from_scene(scene, **{wrong: 1}, **kw), f"there is no option '{wrong}', expected '{meant}'")
    refused(lambda: many(pendulum, cases=3), "cases is of from_scene")
    refused(lambda: many(pendulum, count=3), "there is no option 'count', expected one of reward, terminated, limit, num_envs, ")
    ph.Env.from_scene(scene, ports=["elbow.torque"], substeps=2, **kw)  # control
    e = many(pendulum)
    refused(lambda: e.step(np.zeros((3, 1))), "no episode is running, expected reset() before step()")
    e.reset()
    e.step(np.zeros((3, 1)))


def test_scenes_of_a_split_orbit_are_refused(tmp_path):
    (tmp_path / "sat.urdf").write_text("<robot name='sat'><link name='hull'><inertial><mass value='200'/>"
                                       "<inertia ixx='40' iyy='50' izz='60' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>")
    orbit = "[model]\nurdf = 'sat.urdf'\nbase = 'free'\n[orbit]\naltitude = 620e3\nsplitting = 'lobatto4c'\n{}[integrator]\nmethod = 'gauss8'\nstep = 1.0\n[run]\nduration = 60.0\n"
    kw = dict(reward=lambda o, u: 0.0, limit=1.0)
    (tmp_path / "scene.toml").write_text(orbit.format("epoch = '2027-03-14T06:30:00'\n"))
    refused(lambda: ph.Env.from_scene(tmp_path / "scene.toml", **kw), "third bodies, drag, sunlight, thrusters or torquers", "expected a scene without them", most=260)
    (tmp_path / "scene.toml").write_text(orbit.format(""))
    ph.Env.from_scene(tmp_path / "scene.toml", **kw).reset(seed=0)  # control


def test_a_base_is_not_pushed_unless_it_is_asked_for(source):
    kw = dict(reward=lambda o, u: 0.0, limit=1.0)
    scene = source / "examples/ets_vii/scene.toml"
    e = ph.Env.from_scene(scene, **kw)
    assert e.action_names and not any("base" in name for name in e.action_names)
    assert len(ph.Env.from_scene(scene, ports=["base.wrench"], **kw).action_names) == 6


def test_rates_of_a_free_base_have_their_names(source):
    e = ph.Env.from_scene(source / "examples/ets_vii/scene.toml", step=0.01, method="gauss4", limit=20.0, dtype=np.float64, ports=["joint_1.torque"],
                          reward=lambda o, u: 0.0)
    e.reset(seed=0)
    before, *_ = [e.step(np.array([20.0]))[0] for _ in range(20)][-1:]
    after = e.step(np.array([20.0]))[0]
    at = lambda name: slice(e.names.index(name + "[0]"), e.names.index(name + "[0]") + 3)
    moved = (after - before)[at("base.position")] / 0.01
    velocity, rate = (0.5 * (before + after)[at("rate of base." + k)] for k in ("position", "attitude"))
    assert np.abs(moved - velocity).max() < 0.02 * np.abs(moved).max()  # its axes have hardly turned; measured 0.006
    assert np.abs(moved - rate).max() > 0.3 * np.abs(moved).max()  # control
    turned = 2 * (after - before)[at("base.attitude")][1:] / 0.01  # of the quaternion w x y z near (1, 0, 0, 0)
    assert np.abs(turned - rate[:2]).max() < 0.02 * np.abs(rate).max()


def test_starts_off_the_loops_are_refused(source):
    scene = source / "examples/four_bar/scene.toml"
    kw = dict(limit=1.0, reward=lambda o, u: 0.0, rates=True)
    m = ph.Scene(scene).assembly.mechanical

    def moved(uniform, x):
        return x + np.eye(len(x))[0] * 0.2 * (uniform(1)[0] - 0.5)

    def closed(uniform, x):
        q, v, _ = m.close_loops(moved(uniform, x)[: m.mechanism.nq], x[m.mechanism.nq :], held=[m.mechanism.coordinates[0].name])
        return np.r_[q, v]

    refused(lambda: ph.Env.from_scene(scene, begin=moved, **kw), "the gap of the constraint", "close_loops(q, v)", most=260)
    e = ph.Env.from_scene(scene, begin=closed, **kw)
    e.reset(seed=1)
    before = e.energy
    e.step(np.zeros(e.action_space.shape))
    assert abs(e.energy - before) < 1e-9 * max(1.0, abs(before))  # open: it made energy in the first step


def test_quaternions_are_normed(source):
    scene = source / "examples/ets_vii/scene.toml"
    kw = dict(limit=1.0, reward=lambda o, u: 0.0, step=0.1, method="gauss4", dtype=np.float64)
    plain, twice = ph.Env.from_scene(scene, **kw), []
    q = plain.batch.state(0).x
    at = [plain.names.index(f"base.attitude[{k}]") for k in range(4)]

    def longer(uniform, x):
        x[at] *= 2
        return x

    for rates in (False, True):
        e = ph.Env.from_scene(scene, begin=longer, rates=rates, **kw)
        twice.append(e.reset(seed=0)[0])
        assert abs(np.linalg.norm(e.batch.state(0).x[at]) - 1) < 1e-15
    assert np.abs(twice[1] - plain.reset(seed=0)[0]).max() < 1e-12 and np.array_equal(q[at], plain.batch.state(0).x[at])
    with pytest.raises(ph.InvalidArgument, match="'base.attitude' is zero, expected one of norm 1"):
        ph.Env.from_scene(scene, begin=lambda u, x: np.where(np.isin(np.arange(len(x)), at), 0.0, x), **kw)


def test_what_is_refused_when_it_is_made(pendulum, source):
    refused(lambda: many(pendulum, picture=dict(camera="front")), "camera='front', expected one of iso, x, y, z")
    refused(lambda: many(pendulum, picture=dict(camra="x")), "'camra', expected size, camera, follow, dark")
    refused(lambda: many(pendulum).reset(options={"start": 1}), "reset() has options 'start', expected none")
    refused(lambda: one(pendulum).reset(options={"start": 1}), "options 'start'")
    assert one(pendulum, picture=dict(camera="x", follow="world")).reset(seed=1, options={})[0].shape == (4,)
    urdf = source / "examples/ets_vii/ets_vii.urdf"
    for call in (lambda: ph.Scene(urdf), lambda: ph.Env.from_scene(urdf, limit=1.0, reward=abs), lambda: ph.VectorEnv.from_scene(urdf, limit=1.0, reward=abs)):
        refused(call, "ets_vii.urdf is a model, expected a scene: porthos new ", most=400)


def test_a_limit_for_each_port(pendulum):
    both = dict(ports=["upper.torque", "lower.torque"])
    e = many(pendulum, limit=[0.5, 2.0], **both)
    assert np.array_equal(e.single_action_space.high, np.float32([0.5, 2])) and np.array_equal(e.action_space.low[2], np.float32([-0.5, -2]))
    e.reset(seed=0)
    cut = e.step(np.full((3, 2), 9.0))[0].copy()
    e.reset(seed=0)
    assert np.array_equal(cut, e.step(np.tile([0.5, 2.0], (3, 1)))[0])
    e.reset(seed=0)
    assert not np.array_equal(cut, e.step(np.full((3, 2), 0.5))[0])  # control
    for wrong in ([1.0], [1.0, -1.0], [1.0, "a"], "1", True, float("nan"), None):
        refused(lambda: many(pendulum, limit=wrong, **both), "expected a number above 0, or 2 of them")


def test_what_is_observed_by_names(source, tmp_path):
    (tmp_path / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    scene = tmp_path / "scene.toml"
    scene.write_text((source / "examples/double_pendulum/scene.toml").read_text() + """
[[output]]
quantity = "position"
name = "tip"
link = "lower"
at = [0, 0, -1]
[[output]]
quantity = "formula"
name = "height"
formula = "2 + tip.z"
""" + '[ensemble]\ncases = 5\n[ensemble.vary]\n"model.mass_factor.lower" = { uniform = [0.5, 2] }\n')
    kw = dict(limit=1.0, step=0.01, method="gauss4", dtype=np.float64, longest=9, num_envs=7, cases=5, reward=lambda o, u: -o[:, 0])
    every = ph.VectorEnv.from_scene(scene, **kw)
    e = ph.VectorEnv.from_scene(scene, observed=["height", "rate of elbow", "tip", "tip.x", "shoulder"], **kw)
    assert e.names == ["height", "rate of elbow", "tip.x", "tip.y", "tip.z", "tip.x", "shoulder"] and e.single_observation_space.shape == (7,)
    a, b = every.reset(seed=1)[0], e.reset(seed=1)[0]
    for k in range(20):
        u = np.full(e.action_space.shape, np.cos(k))
        tip = ph.body_pose(e.mechanism, a[:, :2].copy(), "lower")
        place = tip[1] - tip[0][:, :, 2]
        assert np.abs(b[:, 2:5] - place).max() < 1e-14 and np.array_equal(b[:, 0], 2 + b[:, 4]) and np.array_equal(b[:, [1, 6]], a[:, [3, 0]])
        (a, _, _, _, first), (b, rewards, _, _, info) = every.step(u), e.step(u)
        assert np.array_equal(rewards, -(info["final_obs"] if info else b)[:, 0])
    assert np.abs(b[:, 2]).max() > 0.01 and e.batch.observation_size == 4
    refused(lambda: ph.VectorEnv.from_scene(scene, observed=["tipp.x"], **kw), "observed has 'tipp.x', expected a name of the state or of an [[output]]", "as 'tip.x'")
    one = ph.Env.from_scene(scene, observed=["tip.z"], limit=1.0, reward=reward_of_nothing)
    assert one.reset(seed=0)[0].shape == (1,) and pickle.loads(pickle.dumps(one)).names == ["tip.z"]


def test_observed_torques_and_wrenches_are_of_the_actions(source, tmp_path):
    (tmp_path / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    text = (source / "examples/double_pendulum/scene.toml").read_text() + "".join(
        f'\n[[output]]\nquantity = "joint_{what}"\nname = "{what}"\njoint = "elbow"\n' for what in ("torque", "wrench"))
    force = lambda joint, value: f'\n[[element]]\ntype = "force"\nname = "{joint}_force"\njoint = "{joint}"\nconstant = {value}\n'
    free, driven = tmp_path / "free.toml", tmp_path / "driven.toml"
    free.write_text(text)
    driven.write_text(text + force("shoulder", 1.5) + force("elbow", -0.7))
    kw = dict(step=0.01, method="gauss8", reward=lambda o, u: 0.0 * o[..., 0], dtype=np.float64, longest=30, ports=["shoulder.torque", "elbow.torque"])
    names = ["torque", "wrench"]
    e = ph.VectorEnv.from_scene(free, observed=names, limit=9.0, num_envs=3, **kw)
    own = ph.VectorEnv.from_scene(driven, observed=names, limit=9.0, num_envs=3, **kw)
    begun, still = e.reset(seed=0)[0], own.reset(seed=0)[0]
    off = 0.0
    for k in range(30):
        u = np.tile([1.5, -0.7], (3, 1))
        a, b = e.step(u), own.step(0 * u)
        a, b = (r[4]["final_obs"] if k == 29 else r[0] for r in (a, b))
        off = max(off, np.abs(a - b).max())
    assert off < 1e-12, off  # 2e-14 of 10 N
    assert np.abs(a[:, 0] + 0.7).max() < 1e-12 and np.abs(begun - still).max() > 0.5  # control: it begins without actions
    assert np.array_equal(e.reset(seed=0)[0], begun)


def test_limits_by_names(pendulum):
    both = dict(ports=["lower.torque", "upper.torque"])
    e = many(pendulum, limit={"upper.torque": 0.5, "lower.torque": 2.0}, **both)
    assert np.array_equal(e.single_action_space.high, np.float32([2, 0.5]))  # as the ports stand
    refused(lambda: many(pendulum, limit={"upper.torque": 0.5}, **both), "limit has no 'lower.torque', expected one for each: lower.torque, upper.torque")
    refused(lambda: many(pendulum, limit={"upper.torque": 0.5, "lower.torqe": 0.5}, **both), "limit is of 'lower.torqe', which is no port that is driven, expected one for each: lower.torque, upper.torque")
    refused(lambda: many(pendulum, limit={"upper.torque": 1.0, "lower.torque": 2.0, "hand.torque": 1.0}, **both), "limit is of 'hand.torque', which is no port that is driven")
    refused(lambda: many(pendulum, limit={"upper.torque": 1.0, "lower.torque": -2.0}, **both), "expected a number above 0, or 2 of them")


def test_without_gymnasium_it_has_what_wrappers_ask_for(pendulum):
    for e in (many(pendulum), one(pendulum)):
        assert e.unwrapped is e and e.spec is None
        e.reset(seed=4)
        drawn = e.np_random.uniform(size=3)
        e.reset(seed=4)
        assert np.array_equal(e.np_random.uniform(size=3), drawn) and not np.array_equal(e.np_random.uniform(size=3), drawn)


def test_ended_of_an_array_is_refused(pendulum):
    e = many(pendulum, ended=lambda x: x > 0)
    e.reset(seed=0)
    refused(lambda: e.step(np.zeros((3, 1))), "ended gave", "expected True or False")
    e = many(pendulum, ended=lambda x: np.array([x[0] > 9.0]))  # control: one of a kind is taken
    e.reset(seed=0)
    e.step(np.zeros((3, 1)))


def test_stops_of_a_scene_are_not_ignored(source, tmp_path):
    text = (source / "examples/double_pendulum/scene.toml").read_text()
    (tmp_path / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    (tmp_path / "scene.toml").write_text(text + "\n[[output]]\nquantity = 'joint_position'\nname = 'e'\njoint = 'elbow'\n[[stop]]\noutput = 'e'\nabove = 3.0\n")
    kw = dict(reward=lambda o, u: 0.0, limit=1.0)
    refused(lambda: ph.Env.from_scene(tmp_path / "scene.toml", **kw), "has 1 [[stop]]s, which an environment does not see, expected ended=")
    ph.Env.from_scene(tmp_path / "scene.toml", ended=lambda x: x[1] > 3.0, **kw)


def reward_of_nothing(o, u):
    return 0.0


def test_one_of_a_scene_is_pickled(source, pendulum):
    e = ph.Env.from_scene(source / "examples/ets_vii/scene.toml", reward=reward_of_nothing, limit=1.0, longest=5)
    again = pickle.loads(pickle.dumps(e))
    u = np.full(e.action_space.shape, 0.5)
    assert all(np.array_equal(a, b) for a, b in zip(e.reset(seed=3), again.reset(seed=3)) if not isinstance(a, dict))
    assert np.array_equal(e.step(u)[0], again.step(u)[0]) and again.action_names == e.action_names
    with pytest.raises(TypeError, match="expected one by from_scene"):
        pickle.dumps(many(pendulum))
    changed = pickle.loads(pickle.dumps(ph.Env.from_scene(source / "examples/ets_vii/scene.toml", reward=reward_of_nothing, limit=1.0,
                                                          change={"initial.joints.joint_1.position": 0.7})))
    assert abs(changed.reset(seed=0)[0][changed.names.index("joint_1")] - 0.7) < 1e-6
