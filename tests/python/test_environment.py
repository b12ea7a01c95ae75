"""Environments: reset and step on numpy arrays."""
import numpy as np

import porthos as ph
from test_dynamics import refused


def cart(pendulum, **options):
    model = ph.MechanicalModel(pendulum)
    kw = dict(count=5, step=0.01, substeps=2, seed=3, ports=["upper.torque"], observed=[0, 1])
    return ph.Environment(model, model.state([0.1, 0.0], [0, 0]), **{**kw, **options})


def begin(uniform, x):
    x[:2] += 0.2 * (uniform(2) - 0.5)
    return x


def roll(e, n=30):
    seen = [e.reset(seed=7).copy()]
    rng = np.random.default_rng(1)
    for _ in range(n):
        obs, terminated, truncated = e.step(rng.uniform(-1, 1, (e.count, e.action_size)))
        seen.append(obs.copy())
    return np.array(seen)


def test_reset_and_step(pendulum):
    e = cart(pendulum, begin=begin)
    assert (e.count, e.action_size, e.observation_size, e.interval) == (5, 1, 2, 0.02)
    first = e.reset(seed=1).copy()
    assert first.shape == (5, 2) and not np.array_equal(first[0], first[1])
    obs, terminated, truncated = e.step(np.ones((5, 1)))
    assert obs.shape == (5, 2) and terminated.dtype == bool and not terminated.any() and not truncated.any()
    assert not np.array_equal(obs, first) and (e.lengths == 1).all()


def test_the_same_seed_and_actions_give_the_same_bits(pendulum):
    one, two = roll(cart(pendulum, begin=begin)), roll(cart(pendulum, begin=begin, threads=2))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, roll(cart(pendulum)))  # negative control: begin does something


def test_an_environment_equals_a_run_under_the_same_torque(pendulum):
    e = cart(pendulum, count=1, method="gauss8")
    e.reset(seed=0)
    for _ in range(50):
        obs, *_ = e.step(np.full((1, 1), 0.7))
    n = ph.Network("held")
    model = ph.MechanicalModel(pendulum)
    n.add("arm", model).source("torque", "arm.upper.torque", ph.constant(0.7))
    r = ph.simulate(n.build(), model.state([0.1, 0.0], [0, 0]), step=0.01, duration=1.0, method="gauss8")
    assert np.abs(r.x[-1, :2] - obs[0]).max() < 1e-13


def test_episodes_end_and_begin_anew(pendulum):
    e = cart(pendulum, longest=4)
    e.reset(seed=0)
    cut = [e.step(np.zeros((5, 1)))[2].all() for _ in range(8)]
    assert cut == [False, False, False, True] * 2 and (e.episodes == e.episodes[0]).all()
    e = cart(pendulum, ended=lambda x: abs(x[0]) > 0.12)
    e.reset(seed=0)
    for _ in range(100):
        obs, terminated, _ = e.step(np.full((5, 1), 5.0))
        if terminated.any():
            break
    assert terminated.all() and (np.abs(e.final_observations[:, 0]) > 0.12).all() and (np.abs(obs[:, 0]) < 0.12).all()


def test_states_can_be_put_back(pendulum):
    e = cart(pendulum)
    e.reset(seed=0)
    saved = e.state(2).copy()
    a = e.step(np.ones((5, 1)))[0][2].copy()
    e.set_state(2, saved)
    assert np.array_equal(e.step(np.ones((5, 1)))[0][2], a)
    refused(lambda: e.state(5), "environment is 5, expected 0 to 4")


def test_what_a_step_cost(pendulum):
    cost = {}
    for method, step in (("rk4", 0.01), ("gauss4", 0.01), ("gauss4", 2.0)):
        e = cart(pendulum, method=method, step=step)
        e.reset(seed=0)
        e.step(np.full((5, 1), 5.0))
        cost[method, step] = e.iterations, e.alone
    assert cost["rk4", 0.01] == (1.0, 0) and cost["gauss4", 0.01][0] > 2 and cost["gauss4", 0.01][1] == 0
    assert cost["gauss4", 2.0][1] == 5 and cost["gauss4", 2.0][0] > cost["gauss4", 0.01][0]


def test_wrong_actions_are_refused(pendulum):
    e = cart(pendulum)
    e.reset(seed=0)
    refused(lambda: e.step(np.zeros((5, 2))), "actions has shape (5, 2)", "(5, 1)")
    refused(lambda: e.step(np.zeros((5, 1), dtype="f4")), "actions has dtype float32")
    refused(lambda: e.step(np.full((5, 1), np.nan)), "finite")
    refused(lambda: cart(pendulum, ports=["uper.torque"]), "uper.torque")
    kept = []

    def keeps(uniform, x):
        kept.append(uniform)
        return x

    cart(pendulum, begin=keeps).reset(seed=0)
    refused(lambda: kept[0](1), "is over")
