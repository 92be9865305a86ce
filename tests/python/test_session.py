"""Captures taken from Python: simulated devices, devices of Python's own, a card, the experiments."""

from pathlib import Path
from typing import Any, Optional

import numpy as np
import pytest

import lumihull


@pytest.fixture
def plan() -> lumihull.Plan:
    return lumihull.plan_hemisphere(robot="hand", azimuths=4, rows=1, settle_s=0, exposure_s=0.001, travel_s=0.001)


class Robot:
    def __init__(self) -> None:
        self.places: list[str] = []
        self.safe = 0
        self.fails: Optional[Exception] = None

    def state(self) -> dict[str, Any]:
        return {"ready": True, "position_known": True}

    def move_to(self, stop: lumihull.Stop) -> None:
        if self.fails:
            raise self.fails
        self.places.append(stop.name)

    def make_safe(self) -> None:
        self.safe += 1


class Camera:
    delivers_files = True

    def __init__(self) -> None:
        self.ids: list[int] = []
        self.answers: list[tuple[str, Optional[Path], str]] = []

    def shoot(self, id: int, exposure_s: float, folder: Path) -> tuple[str, Optional[Path], str]:
        self.ids.append(id)
        if self.answers:
            return self.answers.pop(0)
        file = Path(folder) / f"card{id}.png"
        lumihull.write_png(file, np.full((16, 24, 3), 20 + 10 * id, np.uint8))
        return "done", file, ""


def test_simulated_devices(plan: lumihull.Plan, tmp_path: Path) -> None:
    session = lumihull.Session(
        plan, tmp_path / "c", "simulate", ["simulate"], pause_after=3, agree_to_motion=True
    )
    assert session.dry_run()["left"] == 4 and session.dry_run()["problems"] == []
    said: list[lumihull.Progress] = []
    first = session.run(progress=said.append)
    assert first["taken"] == 3 and first["paused"] and first["of"] == 4
    assert session.run() == {"views": 4, "of": 4, "taken": 1, "awaited": 0, "paused": False}
    assert len(lumihull.Capture.open(tmp_path / "c")) == 4


def test_devices_of_its_own(plan: lumihull.Plan, tmp_path: Path) -> None:
    robot, camera = Robot(), Camera()
    camera.answers = [("refused", None, "no focus"), ("unknown", None, "")]
    asked: list[str] = []

    def ask(about: str, text: str, choices: list[str]) -> str:
        asked.append(about)
        return "again" if about == "doubt" else choices[0]

    session = lumihull.Session(plan, tmp_path / "c", robot, [camera])
    told: list[str] = []
    assert session.run(ask, told.append)["views"] == 4
    assert robot.places == plan.names and robot.safe >= 1
    assert "motion" in asked and asked.count("doubt") == 1
    assert camera.ids[0] == camera.ids[1] != camera.ids[2] and len(set(camera.ids)) == 5


def test_what_callbacks_raise_is_raised(plan: lumihull.Plan, tmp_path: Path) -> None:
    robot, camera = Robot(), Camera()
    session = lumihull.Session(plan, tmp_path / "c", robot, [camera], agree_to_motion=True)
    robot.fails = ZeroDivisionError("the belt slipped")
    with pytest.raises(ZeroDivisionError, match="belt"):
        session.run()
    assert robot.safe >= 1
    robot.fails = None
    camera.answers = [("perhaps", None, "")]
    with pytest.raises(lumihull.Error, match="perhaps"):
        session.run()
    camera.answers = [3]  # type: ignore[list-item]
    with pytest.raises(lumihull.Error) as caught:
        session.run(lambda about, text, choices: "again" if about == "doubt" else choices[0])
    assert caught.value.code == "invalid_argument" and caught.value.subject == "camera.shoot"
    with pytest.raises(lumihull.Error, match="none of the choices"):
        session.run(lambda about, text, choices: "perhaps")
    # Nothing was lost by all that.
    done = session.run(lambda about, text, choices: "again" if about == "doubt" else choices[0])
    assert done["views"] == 4


def test_wrong_words(plan: lumihull.Plan, tmp_path: Path) -> None:
    for robot, cameras in (("drone", ["simulate"]), ("simulate", ["eye"])):
        with pytest.raises(lumihull.Error) as caught:
            lumihull.Session(plan, tmp_path / "c", robot, cameras)
        assert caught.value.code == "invalid_argument"
    for robot, cameras in (("rig", ["simulate"]), ("simulate", ["rig:bust"])):  # the program's alone
        with pytest.raises(lumihull.Error, match="lumihull capture --robot rig"):
            lumihull.Session(plan, tmp_path / "c", robot, cameras)
    with pytest.raises(lumihull.Error, match="exposure: expected above 0"):
        lumihull.Session(plan, tmp_path / "c", Robot(), [Camera()], exposure_s=0, agree_to_motion=True).run()
    with pytest.raises(lumihull.Error, match="no serial port"):
        lumihull.Session(plan, tmp_path / "c", "simulate", ["serial"]).dry_run()
    with pytest.raises(lumihull.Error, match="Is the way free"):  # nobody is there to agree
        lumihull.Session(plan, tmp_path / "c", Robot(), [Camera()]).run()


def test_a_card(plan: lumihull.Plan, tmp_path: Path) -> None:
    (tmp_path / "card").mkdir()
    for i in range(4):
        lumihull.write_png(tmp_path / "card" / f"IMG_{i + 1:04}.png", np.full((16, 24, 3), 50 * i, np.uint8))
    session = lumihull.Session(plan, tmp_path / "c", Robot(), ["hand"])
    assert session.run(lambda about, text, choices: choices[0])["awaited"] == 4
    told: list[str] = []
    found = lumihull.land_card(tmp_path / "c", tmp_path / "card", tell=told.append)
    assert found["landed"] == 4 and [m["shot"]["stop"] for m in found["matches"]] == plan.names and told
    capture = lumihull.Capture.open(tmp_path / "c")
    assert len(capture) == 4
    with pytest.raises(lumihull.Error, match="no scale"):
        lumihull.repeatability(capture)
    with pytest.raises(lumihull.Error) as caught:
        lumihull.land_card(tmp_path / "none", tmp_path / "card")
    assert caught.value.code in ("not_found", "io")


def test_experiments() -> None:
    poses = [lumihull.Pose(np.column_stack([np.eye(3), [x, 0, 0]])) for x in (1.0, 2.0, 4.5)]
    mean, distances, angles = lumihull.pose_spread(poses)
    assert np.allclose(mean.translation, [2.5, 0, 0]) and np.allclose(distances, [1.5, 0.5, 2]) and not angles.any()
    time = np.arange(200) / 20
    center = np.column_stack([300 + 8 * np.exp(-time), np.full(200, 100.0)])
    found = lumihull.stability(time, center)
    assert np.isclose(found["settle_s"], 2.8) and found["rest_px"] < 0.01 and found["distance_px"].shape == (200,)
    assert lumihull.stability(time, center, allowed_px=1e-9)["settle_s"] is None
    with pytest.raises(lumihull.Error):
        lumihull.stability(time[:5], center)
