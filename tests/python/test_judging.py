"""Trajectories of other programs: judge()."""
import gc
import tempfile

import numpy as np
import pytest

import porthos as ph
from test_dynamics import refused
from test_plans import URDF


def turning(rate, steps=200):
    t = np.linspace(0, 2, steps + 1)
    return {"time": t, "axle": 0.3 + rate * t, "v.axle": np.full(steps + 1, rate)}


def test_columns(tmp_path):
    """A wheel turns steadily. Control: one that speeds up gains energy."""
    model = tmp_path / "wheel.urdf"
    model.write_text(URDF)
    steady = ph.judge(turning(0.7), model, out=tmp_path / "steady")
    assert steady.verdict == "pass" and steady.folder == tmp_path / "steady"
    assert (tmp_path / "steady" / "run.h5").exists()
    assert str(steady).startswith("trajectory.csv: recorded, 201 rows, 0.01 s apart, 2 s\n")
    faster = turning(0.7)
    faster["v.axle"] = 0.7 + 0.05 * faster["time"]
    faster["axle"] = 0.3 + 0.7 * faster["time"] + 0.025 * faster["time"] ** 2
    gaining = ph.judge(faster, model, out=tmp_path / "gaining")
    assert gaining.verdict == "fail"
    # the file that was written for the first, as a file
    again = ph.judge(tmp_path / "steady" / "trajectory.csv", model, out=tmp_path / "again")
    assert again.summary["energy"] == steady.summary["energy"]


def test_columns_without_a_folder(tmp_path, monkeypatch):
    """Their folder lives as long as the result, and none is left of columns that are refused."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    model = tmp_path / "wheel.urdf"
    model.write_text(URDF)
    result = ph.judge(turning(0.7), model)
    folder = result.folder
    assert result.verdict == "pass" and folder.parent == tmp_path / "temporary"
    assert result["time"].shape == (201,) and (folder / "summary.json").exists()
    del result
    gc.collect()
    assert not folder.exists()
    refused(lambda: ph.judge({"time": [0, 1]}, model), "axle")
    refused(lambda: ph.judge({"Time": [0, 1]}, model), "the columns have no 'time' or 't'")
    assert not any((tmp_path / "temporary").iterdir())


def test_refusals(tmp_path):
    model = tmp_path / "wheel.urdf"
    model.write_text(URDF)
    odd = turning(1)
    odd["axle"] = odd["axle"][1:]
    refused(lambda: ph.judge(odd, model, out=tmp_path / "odd"), "the column 'axle' has the shape (200,), expected (201,) or (201, n)")
    for wrong in (0.5, np.zeros((201, 1, 1))):
        refused(lambda: ph.judge({**turning(1), "axle": wrong}, model, out=tmp_path / "odd"), f"the column 'axle' has the shape {np.shape(wrong)}")
    refused(lambda: ph.judge({}, model, out=tmp_path / "odd"), "there are no columns")
    missing = turning(1)
    del missing["axle"]
    with pytest.raises(ph.InvalidArgument, match=r"^trajectory: no column for the position of 'axle', expected 'axle'"):
        ph.judge(missing, model)
    back = turning(1)
    back["time"][7] = 0
    with pytest.raises(ph.InvalidArgument, match=r"^trajectory: row 7: 'time' is 0 after "):
        ph.judge(back, model)
    with pytest.raises(ph.InvalidArgument, match=r"^map: columns\.q\.axl: the model has no coordinate of this name"):
        ph.judge(turning(1), model, map={"columns": {"q": {"axl": "axle"}}})
    file = tmp_path / "back.csv"  # control: a file keeps its name
    file.write_text("time,axle,v.axle\n1,0,1\n0,0,1\n")
    with pytest.raises(ph.InvalidArgument, match="back.csv:3: 'time' is 0 after 1"):
        ph.judge(file, model)


def test_a_map_as_a_dict(tmp_path):
    """Control: other columns than the map names."""
    model = tmp_path / "wheel.urdf"
    model.write_text(URDF)
    wheel = turning(0.7)
    columns = {"when": wheel["time"], "angle": wheel["axle"], "rate": wheel["v.axle"]}
    means = {"columns": {"time": "when", "q": {"axle": "angle"}, "v": {"axle": ["rate"]}}, "verify": {"energy": np.float64(1e-8)},
             "environment": {"gravity": "uniform", "vector": [0, 0, -9.81]},
             "element": [{"type": "damper", "joint": "axle", "damping": 0}]}
    result = ph.judge(columns, model, map=means, out=tmp_path / "out")
    assert result.verdict == "pass"
    assert [c["limit"] for c in result.summary["checks"] if c["name"] == "energy"] == [1e-8]
    assert ph.judge(tmp_path / "out" / "trajectory.csv", model, map=tmp_path / "out" / "map.toml", out=tmp_path / "again").verdict == "pass"
    means["columns"]["q"]["axle"] = "angel"
    refused(lambda: ph.judge(columns, model, map=means), "there is no column 'angel', the nearest one is 'angle'")
    refused(lambda: ph.judge(columns, model, map={"verify": {"energy": model}}),
            "the columns have no 'time' or 't'")
    refused(lambda: ph.judge(wheel, model, map={"verify": {"energy": model}}),
            'map: verify.energy is a PosixPath, expected a number, a text, a list or a table')


def test_an_episode(tmp_path, source):
    """As docs/python.md writes it. Control: a map without the gravity of the scene."""
    example = source / "examples" / "double_pendulum"
    env = ph.Env.from_scene(example / "scene.toml", method="gauss8", step=0.01, limit=5.0, ports=["shoulder.torque"],
                            dtype=np.float64, reward=lambda obs, action: 0.0)
    obs, _ = env.reset(seed=1)
    rows = []
    for k in range(200):
        action = env.action_space.sample().astype(float)
        rows.append([k * env.batch.interval, *obs, *action])
        obs, *_ = env.step(action)
    names = ["t", *(n.replace("rate of ", "v.") for n in env.names), "torque.shoulder"]
    columns = dict(zip(names, np.transpose(rows)))
    gravity, none = tmp_path / "gravity.toml", tmp_path / "none.toml"
    gravity.write_text("[environment]\ngravity = 'uniform'\nvector = [0, 0, -9.81]\n")
    none.write_text("[verify]\nenergy = 1e-9\n")
    assert ph.judge(columns, example / "double_pendulum.urdf", map=gravity).verdict == "pass"
    assert ph.judge(columns, example / "double_pendulum.urdf", map=none).verdict == "fail"
