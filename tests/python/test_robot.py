"""The robot's mechanism and its plans through arrays; what they say is computed again here from the definitions."""

import json
from pathlib import Path

import numpy as np
import pytest

import lumihull


def rotation(axis: list[float], angle: float) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def pose(place: list[float], axis: list[float] = [1, 0, 0], angle: float = 0.0) -> lumihull.Pose:
    return lumihull.Pose(np.column_stack([rotation(axis, angle), place]))


@pytest.fixture
def mechanism() -> lumihull.Mechanism:
    return lumihull.Mechanism.paper()


PLACES = [pose([0, 0, 1.5]), pose([0.4, -0.3, 1.2], [0, 1, 0.2], 0.2), pose([-0.7, 0.6, 1.0], [1, -1, 0], 0.25)]


@pytest.mark.parametrize("where", PLACES)
def test_lengths_are_distances(mechanism: lumihull.Mechanism, where: lumihull.Pose) -> None:
    tips = where.apply(mechanism.attachments)
    assert np.allclose(mechanism.lengths(where), np.linalg.norm(mechanism.departures - tips, axis=1), rtol=0, atol=1e-12)


@pytest.mark.parametrize("where", PLACES)
def test_tensions_balance_gravity(mechanism: lumihull.Mechanism, where: lumihull.Pose) -> None:
    heavy = mechanism.replace(center_of_mass=[0.02, -0.01, -0.1])
    arms = where.apply(heavy.attachments) - where.translation
    along = heavy.departures - arms - where.translation
    along /= np.linalg.norm(along, axis=1)[:, None]
    w = np.vstack([along.T, np.cross(arms, along).T])
    assert np.allclose(heavy.wrench_matrix(where), w, rtol=0, atol=1e-12)

    weight = np.array([0, 0, -heavy.mass_kg * heavy.gravity_m_s2])
    arm = where.apply(heavy.center_of_mass[None])[0] - where.translation
    found = heavy.tensions(where)
    assert found.state == "controlled" and (found.tensions > 0).all()
    assert np.allclose(w @ found.tensions + np.concatenate([weight, np.cross(arm, weight)]), 0, atol=1e-9)
    assert found.residual_N < 1e-9 and found.smallest_singular > 0.1
    assert np.allclose(found.tensions, np.linalg.solve(w, -np.concatenate([weight, np.cross(arm, weight)])), atol=1e-9)

    # The 2-norm: the largest singular value of the rows of W's inverse, transposed.
    inverse = np.linalg.inv(w.T)
    sensitivity = heavy.sensitivity(where)
    assert np.isclose(sensitivity.translation_joint, np.linalg.norm(inverse[:3], 2))
    assert np.isclose(sensitivity.rotation_joint, np.linalg.norm(inverse[3:], 2))
    assert sensitivity.translation_each >= sensitivity.translation_joint


def test_states_of_balance(mechanism: lumihull.Mechanism) -> None:
    least = mechanism.tensions(PLACES[0]).tensions.min()
    assert mechanism.replace(min_tensions=least - 0.1).tensions(PLACES[0]).state == "controlled"
    assert mechanism.replace(min_tensions=least + 0.1).tensions(PLACES[0]).state == "loose"
    assert mechanism.tensions(pose([4.5, 0, 1])).state == "unbalanced"
    one_point = mechanism.replace(attachments=np.zeros((6, 3)))
    assert one_point.tensions(PLACES[0]).state == "singular"


@pytest.mark.parametrize("where", PLACES)
def test_it_hangs_where_it_was_sent(mechanism: lumihull.Mechanism, where: lumihull.Pose) -> None:
    hanging = mechanism.hang(mechanism.lengths(where), PLACES[0])
    assert hanging.taut and np.allclose(hanging.pose.matrix, where.matrix, rtol=0, atol=1e-10)
    assert np.allclose(hanging.tensions, mechanism.tensions(where).tensions, atol=1e-8)

    rubber = mechanism.replace(stiffnesses=2000.0)
    wound = rubber.unstrained_lengths(where)
    assert np.allclose(wound * (1 + rubber.tensions(where).tensions / 2000), rubber.lengths(where), atol=1e-12)
    assert np.allclose(rubber.hang(wound, where, elastic=True).pose.matrix, where.matrix, rtol=0, atol=1e-8)
    with pytest.raises(lumihull.Error) as caught:
        mechanism.hang(wound, where, elastic=True)  # no stiffness
    assert caught.value.code == "invalid_argument"


def test_clearances_and_crossings(mechanism: lumihull.Mechanism) -> None:
    ball = lumihull.standing_object(0.4, 0.0, [0, 0, 0], -1.0)
    assert np.array_equal(ball.base, [0, 0, -1]) and ball.radius_m == 0.2 and ball.height_m == 1
    found = mechanism.clearance(PLACES[0], ball)
    assert np.isclose(found.platform_object, 1.5 - 0.3 - 0.2)  # sphere above the cap, straight
    assert np.isclose(found.platform_room, 2.2)  # floor at -1, radius 0.3
    assert mechanism.clearance(PLACES[0]).cable_object == np.inf
    assert mechanism.crossing(PLACES[0], PLACES[1]) is None
    crossing = mechanism.crossing(PLACES[0], pose([0, 0, 1.5], [0, 0, 1], 3))
    assert crossing is not None and crossing.first != crossing.second and 0 < crossing.at < 1


def test_files(mechanism: lumihull.Mechanism, tmp_path: Path) -> None:
    file = tmp_path / "mechanism.json"
    mechanism.save(file)
    again = lumihull.Mechanism.load(file)
    assert len(again) == 6 and again.cables == mechanism.cables
    assert np.array_equal(again.departures, mechanism.departures)
    text = json.loads(file.read_text())
    text["cables"][2]["departure"][1] = "far"
    file.write_text(json.dumps(text))
    with pytest.raises(lumihull.Error) as caught:
        lumihull.Mechanism.load(file)
    assert caught.value.code == "bad_input" and "/cables/2/departure/1" in str(caught.value)


def test_refuses_what_is_no_mechanism(mechanism: lumihull.Mechanism, tmp_path: Path) -> None:
    for bad, code in (
        (lambda: lumihull.Mechanism.load(tmp_path / "none.json"), "not_found"),
        (lambda: mechanism.replace(departures=np.zeros((5, 3))), "invalid_argument"),
        (lambda: mechanism.replace(departures=np.full((6, 3), np.nan)), "bad_input"),
        (lambda: mechanism.replace(stiffnesses=[1.0, 2.0]), "invalid_argument"),
        (lambda: mechanism.replace(mass_kg=-1.0), "bad_input"),
        (lambda: mechanism.lengths(pose([np.nan, 0, 0])), "invalid_argument"),
        (lambda: mechanism.hang([1.0, 2.0], PLACES[0]), "invalid_argument"),
        (lambda: mechanism.hang(np.full(6, np.nan), PLACES[0]), "invalid_argument"),
        (lambda: mechanism.hang(np.full(6, 0.1), PLACES[0]), "degenerate"),
        (lambda: mechanism.unstrained_lengths(pose([4.5, 0, 1])), "degenerate"),
        (lambda: mechanism.camera(np.inf), "invalid_argument"),
        (lambda: mechanism.clearance(PLACES[0], lumihull.KeepOut([0, 0, 0], -1, 1)), "invalid_argument"),
    ):
        with pytest.raises(lumihull.Error) as caught:
            bad()
        assert caught.value.code == code, caught.value


def views(mechanism: lumihull.Mechanism, groups: int, each: int, offsets: np.ndarray) -> tuple[
    list[lumihull.Pose], np.ndarray, list[int], list[float]
]:
    """Exact photographs from a hemisphere, and the lengths that were commanded."""
    random = np.random.default_rng(3)
    poses, commanded, numbers, bearings = [], [], [], []
    for group in range(groups):
        theta = 2 * np.pi * group / groups
        for _ in range(each):
            phi = random.uniform(0, np.pi / 2)
            about_z = rotation([0, 0, 1], theta)
            turned = about_z @ rotation([0, 1, 0], phi * 2 / 3 - np.pi / 6) @ about_z.T
            turned = turned @ rotation(random.normal(size=3).tolist(), 0.03)
            place = 1.5 * np.array([np.sin(phi) * np.cos(theta), np.sin(phi) * np.sin(theta), np.cos(phi)])
            platform = lumihull.Pose(np.column_stack([turned, place + random.uniform(-0.05, 0.05, 3)]))
            poses.append(mechanism.camera(theta) @ platform.inverse())
            commanded.append(mechanism.lengths(platform) - offsets)
            numbers.append(group)
            bearings.append(theta)
    return poses, np.array(commanded), numbers, bearings


def test_calibrates_a_mechanism(mechanism: lumihull.Mechanism) -> None:
    random = np.random.default_rng(5)
    truth = mechanism.replace(departures=mechanism.departures * (1 - 0.005 * random.random((6, 3))))
    offsets = random.uniform(-0.2, 0.2, 6)
    poses, commanded, groups, bearings = views(truth, 12, 10, offsets)
    poses[17] = pose([0.3, 0.1, 0]) @ poses[17]
    found = lumihull.calibrate_mechanism(mechanism, poses, commanded, groups=groups, bearings=bearings)
    assert list(found.rejected) == [17] and found.length_rms_m < 1e-7
    assert np.allclose(found.gains, 1) and set(found.bearings) == set(range(12))
    assert found.covariance.shape == (len(found.parameters),) * 2
    assert np.allclose(found.covariance, found.covariance.T)
    # New photographs: where the camera is tells the platform's pose in the calibrated frame, and so the lengths.
    poses, commanded, groups, _ = views(truth, 12, 2, offsets)
    for cam_from_world, lengths, group in zip(poses, commanded, groups):
        platform = cam_from_world.inverse() @ found.mechanism.camera(found.bearings[group])
        assert np.allclose(found.commanded(platform), lengths, rtol=0, atol=1e-6)

    for bad in (
        lambda: lumihull.calibrate_mechanism(mechanism, poses, commanded[:, :5]),
        lambda: lumihull.calibrate_mechanism(mechanism, poses, commanded[:3]),
        lambda: lumihull.calibrate_mechanism(mechanism, poses, commanded, groups=[0]),
        lambda: lumihull.calibrate_mechanism(mechanism, poses, commanded, covariances=np.eye(6)),
    ):
        with pytest.raises(lumihull.Error) as caught:
            bad()
        assert caught.value.code == "invalid_argument"
    with pytest.raises(lumihull.Error) as caught:
        lumihull.calibrate_mechanism(mechanism, poses[:2], commanded[:2])
    assert caught.value.code == "degenerate"


def test_plans_a_capture(mechanism: lumihull.Mechanism, tmp_path: Path) -> None:
    ball = lumihull.standing_object(0.4, 0.0, [0, 0, 0], -1.0)
    said: list[lumihull.Progress] = []
    plan = lumihull.plan_hemisphere(
        mechanism, azimuths=6, rows=3, object=ball, kicks=10, exposure_s=0.25, progress=said.append
    )
    assert plan.robot == "cables" and plan.cameras == ["camera"] and plan.mechanism is not None
    taken = [stop for stop in plan if stop.photograph]
    assert len(taken) + len(plan.left_out) == 18 and len(taken) >= 10
    assert plan.positions.shape == plan.angles.shape == (len(plan), 3) and plan.lengths.shape == (len(plan), 6)
    for i, stop in enumerate(plan):
        theta, phi, _ = plan.angles[i]
        if stop.photograph:
            on_sphere = 1.5 * np.array([np.sin(phi) * np.cos(theta), np.sin(phi) * np.sin(theta), np.cos(phi)])
            assert np.allclose(plan.positions[i], on_sphere, atol=1e-9) and stop.exposure_s == 0.25
        assert np.allclose(stop.lengths, mechanism.lengths(stop.pose), rtol=0, atol=1e-6)
        assert np.allclose(stop.cam_from_world.matrix, (mechanism.camera(stop.roll_rad) @ stop.pose.inverse()).matrix)
    seconds = sum(s.travel_s + s.settle_s + s.exposure_s for s in plan)
    assert np.isclose(plan.duration_s, seconds)
    assert plan.problems == []
    told = plan.describe()
    assert told["stops"] == len(plan) and told["photographs"] == len(taken) and np.isclose(told["total_s"], seconds)
    assert told["left_out"] == plan.left_out

    plan.save(tmp_path / "plan.json")
    again = lumihull.Plan.load(tmp_path / "plan.json")
    assert again.names == plan.names and np.array_equal(again.lengths, plan.lengths)
    assert again.object is not None and again.object.radius_m == 0.2

    same = lumihull.plan_hemisphere(mechanism, azimuths=6, rows=3, object=ball, kicks=10, exposure_s=0.25, threads=1)
    assert same.names == plan.names
    raster = lumihull.plan_hemisphere(mechanism, azimuths=6, rows=3, object=ball, raster=True)
    assert {s.name for s in raster if s.photograph} == {s.name for s in taken}


def test_problems_of_a_plan_are_told(mechanism: lumihull.Mechanism, tmp_path: Path) -> None:
    """A plan for a mechanism that was changed since: a cable's least tension is more than it bears."""
    plan = lumihull.plan_hemisphere(mechanism, azimuths=4, rows=2, kicks=1)
    file = tmp_path / "plan.json"
    plan.save(file)
    text = json.loads(file.read_text())
    text["mechanism"]["cables"][2]["min_tension_N"] = 150
    file.write_text(json.dumps(text))
    problems = lumihull.Plan.load(file).problems
    assert problems and "cable 3" in problems[0] and "slack" in problems[0]


def test_views_without_a_mechanism() -> None:
    optics = lumihull.Optics(focal_length_mm=50)
    radius = optics.fill_radius(0.3, margin=0.1)
    plan = lumihull.plan_hemisphere(robot="turntable", radius_m=radius, azimuths=8, rows=3, phi_rad=(0.3, 1.2), travel_s=2)
    assert len(plan) == 24 and plan.mechanism is None and plan.lengths.shape == (24, 0)
    centers = np.array([stop.cam_from_world.center for stop in plan])
    assert np.allclose(np.linalg.norm(centers, axis=1), radius)
    assert sum(stop.pause != "" for stop in plan) == 2 and plan[-1].travel_s == 2
    seen = plan.judge(optics.camera(radius), 0.3)
    assert seen["photographs"] == 24 and seen["cut_off"] == []
    # A ball of radius r at distance d: its outline is f tan(asin(r / d)) from the middle; 2 x 0.1 of the side are free.
    camera = optics.camera(radius)
    assert np.isclose(2 * camera.f * np.tan(np.arcsin(0.15 / radius)) / camera.height, 0.8, atol=0.01)
    assert np.isclose(seen["median_fill"], 0.8, atol=0.01)
    assert len(plan.judge(camera, 0.5)["cut_off"]) == 24
    with pytest.raises(IndexError):
        plan[24]


def test_refuses_what_is_no_plan(mechanism: lumihull.Mechanism, tmp_path: Path) -> None:
    for bad, code in (
        (lambda: lumihull.plan_hemisphere(mechanism, radius_m=np.nan), "invalid_argument"),
        (lambda: lumihull.plan_hemisphere(mechanism, rows=0), "invalid_argument"),
        (lambda: lumihull.plan_hemisphere(mechanism, center=[0, 0, np.inf]), "invalid_argument"),
        (lambda: lumihull.plan_hemisphere(mechanism, radius_m=50), "degenerate"),
        (lambda: lumihull.plan_hemisphere(robot="drone"), "invalid_argument"),  # type: ignore[arg-type]
        (lambda: lumihull.plan_hemisphere(mechanism, bearing="magnet"), "invalid_argument"),  # type: ignore[arg-type]
        (lambda: lumihull.plan_hemisphere(cameras=["a", "a"]), "bad_input"),
        (lambda: lumihull.plan_hemisphere(travel_s=-1.0), "invalid_argument"),
        (lambda: lumihull.Optics(focal_length_mm=-1), "invalid_argument"),
        (lambda: lumihull.Plan.load(tmp_path / "none.json"), "not_found"),
    ):
        with pytest.raises(lumihull.Error) as caught:
            bad()
        assert caught.value.code == code, caught.value


def test_progress_can_stop_a_plan(mechanism: lumihull.Mechanism) -> None:
    def refuse(progress: lumihull.Progress) -> None:
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        lumihull.plan_hemisphere(mechanism, azimuths=60, rows=30, kicks=1_000_000, progress=refuse)
