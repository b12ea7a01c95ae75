"""Closed loops, rods and couplings of mechanisms built in Python."""
import numpy as np
import pytest

import porthos as ph


def rod(name, parent, x, length, mass):
    inertia = mass * length**2 / 12
    return ph.BodySpec(
        name=name, parent=parent, position=(x, 0, 0), joint=ph.JointSpec(type="revolute", axis=(0, 0, 1)),
        mass=ph.MassProperties(mass=mass, com=(length / 2, 0, 0), inertia=(inertia / 4, 0, 0, inertia, 0, inertia)))


@pytest.fixture
def tree():
    builder = ph.MechanismBuilder("four_bar")
    for body in [rod("crank", "world", 0, 0.5, 1), rod("coupler", "crank", 0.5, 1.5, 2), rod("rocker", "world", 1.5, 1.25, 1.5)]:
        builder.add(body)
    builder.gravity((0, -9.8125, 0))
    return builder.build()


def pin(**changes):
    return ph.LoopJoint(**{"name": "pin", "type": "revolute", "a": ph.LinkFrame(link="coupler", position=(1.5, 0, 0)),
                           "b": ph.LinkFrame(link="rocker", position=(1.25, 0, 0)), **changes})


def test_a_four_bar_runs_and_stays_closed(tree):
    model = ph.MechanicalModel(tree, constraints=[pin()])
    q, v, found = model.close_loops([1.0, -0.5, 2.0], [3.0, 0, 0], held=["crank"])
    assert abs(q[0] - 1) < 1e-15 and found.rank == 2 and found.largest == "pin" and found.gap > 0.1
    run = ph.simulate(model, model.state(q, v), method="spark16", step=1 / 128, duration=10, limits={"energy": 1e-13})
    assert run.passed, run
    end = [1.5 * np.cos(run["state/crank"] + run["state/coupler"]) + 0.5 * np.cos(run["state/crank"]),
           1.5 + 1.25 * np.cos(run["state/rocker"])]
    assert np.max(np.abs(end[0] - end[1])) < 1e-14
    assert run["reactions/pin"].shape == (len(run["time"]), 6)
    exerted = ph.Reactions(model).at(run.x[-1])
    assert exerted["pin"] == pytest.approx(run["reactions/pin"][-1], rel=1e-12)
    with pytest.raises(ph.InvalidArgument, match="keeps no constraints"):
        ph.simulate(model, model.state(q, v), method="gauss16", step=1 / 128, duration=1)


def test_rods_and_couplings_exert_what_statics_asks(tree):
    gear = ph.Coupling(name="gear", factors={"crank": 3, "rocker": 1})
    assert gear.factors == {"crank": 3, "rocker": 1}
    stay = ph.Rod(name="stay", a=ph.LinkFrame(link="coupler", position=(1.5, 0, 0)), b=ph.LinkFrame(position=(2, 2, 0)), length=2)
    model = ph.MechanicalModel(tree, constraints=[gear, stay])
    q, v, _ = model.close_loops([0.4, -0.5, -1.2], [0, 0, 0])
    exerted = ph.Reactions(model).at(model.state(q, v))
    assert set(exerted) == {"gear.crank", "gear.rocker", "stay"}
    assert exerted["gear.crank"] == pytest.approx(3 * exerted["gear.rocker"], rel=1e-14)
    assert isinstance(exerted["stay"], float)


def test_a_point_on_a_circle_moves_as_on_a_rod(tree):
    ends = dict(a=ph.LinkFrame(position=(1.5, 0, 0)), b=ph.LinkFrame(link="coupler", position=(1.5, 0, 0)))
    circle = ph.LoopJoint(name="pin", type="on_curve", points=[[1.25, 0], [0, 1.25], [-1.25, 0], [0, -1.25]], closed=True, **ends)
    assert circle.closed and circle.points[1] == [0, 1.25]
    final = []
    for loop in [circle, ph.Rod(name="pin", length=1.25, **ends)]:
        model = ph.MechanicalModel(tree, constraints=[loop])
        q, v, _ = model.close_loops([1.0, -0.5, 2.0], [3.0, 0, 0], held=["crank"])
        final.append(ph.simulate(model, model.state(q, v), method="spark16", step=1 / 128, duration=2).x[-1])
    assert np.max(np.abs(final[0] - final[1])) < 1e-12
    with pytest.raises(ph.InvalidArgument, match="constraint 'pin': the number of points is 0"):
        ph.MechanicalModel(tree, constraints=[ph.LoopJoint(name="pin", type="on_curve", **ends)])


def test_what_cannot_be_is_refused(tree):
    for wrong, says in [(pin(type="hinge"), "hinge"), (pin(name=""), "no name"), (pin(b=ph.LinkFrame(link="rock")), "'rock'")]:
        with pytest.raises(ph.InvalidArgument, match=says):
            ph.MechanicalModel(tree, constraints=[wrong])
    with pytest.raises(ph.InvalidArgument, match="cannot be closed"):
        ph.MechanicalModel(tree, constraints=[pin(b=ph.LinkFrame(link="rocker", position=(7, 0, 0)))]).close_loops([1, -0.5, 2], [0, 0, 0])
    with pytest.raises(ph.InvalidArgument, match="no constraints"):
        ph.MechanicalModel(tree).close_loops([1, -0.5, 2], [0, 0, 0])
    with pytest.raises(ph.InvalidArgument, match="no constraints to react"):
        ph.Reactions(ph.MechanicalModel(tree))
    with pytest.raises(ph.InvalidArgument, match="LoopJoint has no 'kind'"):
        ph.LoopJoint(kind="revolute")


def test_a_ball_rolls_down_a_slope_as_it_should():
    """A solid ball on a slope has 5/7 of the acceleration of a block without friction."""
    ball = ph.BodySpec(name="ball", parent="world", joint=ph.JointSpec(name="ball", type="free"),
                       mass=ph.MassProperties(mass=2, com=(0, 0, 0), inertia=(0.05, 0, 0, 0.05, 0, 0.05)))
    builder = ph.MechanismBuilder("slope")
    builder.add(ball)
    builder.gravity((9.0, 0, -4.0))  # the plane stays level, gravity leans
    tree = builder.build()
    r = 0.25  # 0.05 = 2/5 m r^2
    tread = ph.Rolling(name="tread", type="sphere", wheel=ph.LinkFrame(link="ball"), radius=r)
    model = ph.MechanicalModel(tree, constraints=[tread])
    q = np.array(tree.neutral())
    q[tree.coordinate("ball.position").q.start + 2] = r
    run = ph.simulate(model, model.state(q, np.zeros(6)), method="pgauss16", step=1 / 64, duration=4, limits={"energy": 1e-13})
    assert run.passed, run
    assert run.x[-1][tree.coordinate("ball.position").q.start] == pytest.approx(5 / 7 * 9 * 16 / 2, rel=1e-13)
    assert run["reactions/tread"][-1][5] == pytest.approx(8, rel=1e-12)  # carries the weight
    with pytest.raises(ph.InvalidArgument, match="'tread' rolls"):
        ph.simulate(model, model.state(q, np.zeros(6)), method="spark16", step=1 / 64, duration=1)


def test_a_driven_joint_moves_as_told(tree):
    told = ph.moves(1.0, [(0.5, 1.0, 2.0)])
    assert told.position(1.0) == 1.5 and told.rate(0.25) == 0 and told.instants == [0.5, 1.5]
    motor = ph.Driven(name="motor", coordinate="crank", motion=told)
    model = ph.MechanicalModel(tree, constraints=[motor])
    q, v, _ = model.close_loops([1.0, -0.5, 2.0], [0, 0, 0])
    run = ph.simulate(model, model.state(q, v), method="spark16", step=1 / 64, duration=2, limits={"energy": 1e-12})
    assert run.passed, run
    for t, angle in zip(run["time"], run["state/crank"]):
        assert angle == pytest.approx(told.position(t), abs=1e-14)
    assert "reactions/motor.crank" in run
    with pytest.raises(ph.InvalidArgument, match="a move of motion 'motor' begins or ends at 0.5 s"):
        ph.simulate(model, model.state(q, v), method="spark16", step=0.3, duration=3)
    with pytest.raises(ph.InvalidArgument, match="the motion is empty"):
        ph.Driven(name="idle").motion.position(0)
    with pytest.raises(ph.InvalidArgument, match="begins at"):
        ph.moves(0, [(0, 2, 1), (1, 1, 0)])
