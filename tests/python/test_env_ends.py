"""How episodes of Env and VectorEnv end: by a state that grows without bound, by `terminated` of the batch; ports that are left out."""
import re
import warnings

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused


def hanging(source, tmp_path, **options):
    """A double pendulum that hangs at rest, with a damper far too stiff for this step of rk4: who is pushed grows without bound."""
    (tmp_path / "double_pendulum.urdf").write_text((source / "examples/double_pendulum/double_pendulum.urdf").read_text())
    scene = tmp_path / "scene.toml"
    scene.write_text((source / "examples/double_pendulum/scene.toml").read_text() + "\n[[element]]\ntype = 'damper'\njoint = 'elbow'\ndamping = 300.0\n")
    kw = dict(method="rk4", step=0.01, limit=1.0, ports=["shoulder.torque"], begin=lambda uniform, x: 0 * x, reward=lambda o, u: np.zeros(len(o)))
    make = ph.Env if options.pop("one", False) else ph.VectorEnv
    return make.from_scene(scene, **{**kw, **({} if make is ph.Env else {"num_envs": 3}), **options})


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("squares", [False, True])
def test_a_state_that_blows_up_ends_its_copy_alone(source, tmp_path, dtype, squares):
    power = 2 if squares else 0
    e = hanging(source, tmp_path, dtype=dtype, reward=lambda o, u: -(o**power).sum(axis=1))
    obs, _ = e.reset(seed=0)
    u = np.array([[0.0], [1.0], [0.0]])
    for step in range(60):
        before, energy = obs.copy(), e.energies
        with warnings.catch_warnings():
            warnings.simplefilter("error" if not squares else "ignore")  # squares of its own may warn
            obs, rewards, terminated, truncated, info = e.step(u)
        assert np.isfinite(obs).all() and np.isfinite(rewards).all()
        if terminated.any():
            break
    largest = np.abs(before[1]).max()
    print(f"failed after {step} steps at {largest:.1e}")
    assert terminated.tolist() == info["failed"].tolist() == [False, True, False] and not truncated.any() and step > 0
    assert largest > 1e3 and np.array_equal(info["final_obs"][1], before[1]) and np.array_equal(e.energies[1], energy[1])
    assert np.abs(obs[1]).max() == 0 and e.batch.lengths.tolist() == [step + 1, 0, step + 1]
    first, why, third = info["failure"]
    assert first == third == "" and len(why) <= 220 and why.startswith(f"the step from {0.01 * step:.6g} s to {0.01 * (step + 1):.6g} s of the episode: ")
    assert "take a smaller step" in why or dtype == np.float32 and "' is not finite in float32" in why
    assert e.step(0 * u)[4] == {}  # and goes on


def test_one_that_blows_up(source, tmp_path):
    e = hanging(source, tmp_path, one=True, reward=lambda o, u: -float(o @ o))
    obs, _ = e.reset(seed=0)
    over = False
    while not over:
        before = obs
        obs, reward, over, _, info = e.step(np.ones(1))
    assert info == {"failed": True, "failure": info["failure"]} and "s of the episode: " in info["failure"] and np.array_equal(obs, before) and np.isfinite(reward)


@pytest.mark.parametrize("dtype, fails", [(np.float32, True), (np.float64, False)])
def test_a_reward_that_overflows_far_away_ends_the_copy(source, tmp_path, dtype, fails):
    e = hanging(source, tmp_path, dtype=dtype, step=1e-40, begin=lambda uniform, x: np.r_[0 * x[:2], 1e25, 0], reward=lambda o, u: -(o.astype(dtype) ** 2).sum(axis=1))
    e.reset(seed=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        *_, terminated, _, info = e.step(np.zeros((3, 1)))
    assert terminated.all() == fails and ("failed" in info) == fails  # float64 holds the square: control
    assert not fails or all("s of the episode: the reward is -inf where 'rate of " in why for why in info["failure"])


def test_a_reward_that_is_wrong_at_an_ordinary_observation_is_refused(source, tmp_path):
    for gave in (np.nan, np.inf):
        e = hanging(source, tmp_path, reward=lambda o, u: np.array([0.0, gave, 0.0]))
        e.reset(seed=0)
        refused(lambda: e.step(np.array([[0.0], [1.0], [0.0]])), f"reward gave {gave} for environment 1, expected a finite number")
    e = hanging(source, tmp_path, one=True, reward=lambda o, u: np.nan)
    e.reset(seed=0)
    refused(lambda: e.step(np.zeros(1)), "reward gave nan, expected a finite number")


def test_terminated_is_of_the_batch(source):
    scene = source / "examples/double_pendulum/scene.toml"
    kw = dict(num_envs=5, step=0.01, method="gauss4", limit=5.0, longest=9, dtype=np.float64, rates=True, begin=lambda uniform, o: 0.4 * uniform(len(o)),
              reward=lambda o, u: o[:, 0])
    calls = []

    def far(o, u):
        calls.append((o.shape, u.shape))
        return np.abs(o[:, 2]) > 1.0

    each = ph.VectorEnv.from_scene(scene, ended=lambda o: abs(o[2]) > 1.0, **kw)
    whole = ph.VectorEnv.from_scene(scene, terminated=far, **kw)
    a, b = each.reset(seed=3)[0], whole.reset(seed=3)[0]
    ends = cut = 0
    for k in range(60):
        u = np.full(each.action_space.shape, 5.0 * np.cos(k / 7))
        (a, ra, ta, ca, ia), (b, rb, tb, cb, ib) = each.step(u), whole.step(u)
        assert all(np.array_equal(x, y) for x, y in ((a, b), (ra, rb), (ta, tb), (ca, cb))) and ia.keys() == ib.keys()
        assert "final_obs" not in ia or np.array_equal(ia["final_obs"], ib["final_obs"])
        ends, cut = ends + ta.sum(), cut + ca.sum()
    assert ends > 3 and cut > 3 and calls == [((5, 4), (5, 2))] * 60
    one = ph.Env.from_scene(scene, terminated=lambda o, u: o[2] > 1.0, limit=5.0, step=0.01, reward=lambda o, u: 0.0)
    one.reset(seed=0)
    while not (step := one.step(np.full(2, 5.0)))[2]:
        assert step[0][2] <= 1.0
    assert step[0][2] > 1.0 and step[4] == {}


def test_wrong_functions_of_the_batch_are_refused(source):
    scene = source / "examples/double_pendulum/scene.toml"
    kw = dict(num_envs=2, step=0.01, limit=1.0, reward=lambda o, u: o[:, 0])
    refused(lambda: ph.VectorEnv.from_scene(scene, terminated=True, **kw), "terminated is True, expected a function of observations and actions")
    for gives, said in ((lambda o, u: False, "terminated gave shape (), expected (2,)"), (lambda o, u: o[:, 0], "terminated gave float32, expected True or False")):
        e = ph.VectorEnv.from_scene(scene, terminated=gives, **kw)
        e.reset(seed=0)
        refused(lambda: e.step(np.zeros((2, 2))), said)


def test_free_bodies_are_not_pushed_unless_it_is_asked_for(source, tmp_path):
    (tmp_path / "ets_vii.urdf").write_text((source / "examples/ets_vii/ets_vii.urdf").read_text())
    scene = tmp_path / "scene.toml"
    body = "\n[[body]]\nname = 'goal'\nmass = 5.0\ninertia = [1, 1, 1, 0, 0, 0]\nposition = [3.0, 0, 0]\n"
    scene.write_text((source / "examples/ets_vii/scene.toml").read_text() + body)
    kw = dict(reward=lambda o, u: 0.0, limit=1.0)
    names = ph.Env.from_scene(scene, **kw).action_names
    assert names == ph.Env.from_scene(source / "examples/ets_vii/scene.toml", **kw).action_names and "joint_1.torque" in names
    assert ph.Env.from_scene(scene, ports=["goal.wrench"], **kw).action_names == [f"goal.wrench[{k}]" for k in range(6)]
    b = ph.MechanismBuilder("alone")
    b.add(ph.BodySpec(name="hull", parent="world", joint=ph.JointSpec(type="free"), mass=ph.MassProperties(mass=1, inertia=(1, 0, 0, 1, 0, 1))))
    model = ph.MechanicalModel(b.build())
    alone = ph.Env(model, model.state(model.mechanism.neutral(), np.zeros(6)), **kw)
    assert len(alone.action_names) == 6  # there is nothing else to drive


def test_scenes_that_jump_or_stick_and_what_is_missing(source):
    kw = dict(reward=lambda o, u: 0.0, limit=1.0)
    for name, says in (("billiards", "an environment does not jump: 'cue_on_cloth' is rigid, expected a soft contact"),
                       ("dry_joints", "an environment does not stick: 'shoulder.dry_friction' is dry, expected an element of type 'friction', which is smooth")):
        scene = source / "examples" / name / "scene.toml"
        with pytest.raises(ph.InvalidArgument, match="^" + re.escape(says)):
            ph.Env.from_scene(scene, **kw)
    for missing, says in (("limit", "'limit' is missing, expected the largest input of each port"), ("reward", "'reward' is missing, expected a function of")):
        with pytest.raises(TypeError, match=re.escape(f"from_scene(): {says}")):
            ph.VectorEnv.from_scene(source / "examples/double_pendulum/scene.toml", **{k: v for k, v in kw.items() if k != missing})
    assert ph.Env.from_scene(source / "examples/double_pendulum/scene.toml", **kw).action_names  # control


def test_a_port_that_is_not_there_is_named_with_the_nearest(source):
    scene = source / "examples/double_pendulum/scene.toml"
    kw = dict(reward=lambda o, u: 0.0, limit={"elbow.torque": 1.0})
    refused(lambda: ph.Env.from_scene(scene, ports=["elbow"], **kw), "ports has 'elbow', expected a port of ", ", as 'elbow.torque'")
    refused(lambda: ph.Env.from_scene(scene, ports=["elbw.torque"], **kw), "ports has 'elbw.torque'", "as 'elbow.torque'")
    assert ph.Env.from_scene(scene, ports=["elbow.torque"], **kw).action_names == ["elbow.torque"]  # control
