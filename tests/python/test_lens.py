"""Lens calibration through arrays."""

from pathlib import Path

import numpy as np
import pytest

import lumihull


def views(
    camera: lumihull.Camera, count: int, noise: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    random = np.random.default_rng(4)
    board = np.array([[0.03 * x, 0.03 * y, 0] for y in range(6) for x in range(8)])
    middle = board.mean(axis=0)
    pixels, points = [], []
    for _ in range(count):
        eye = middle + [0.25 * random.normal(), 0.25 * random.normal(), -0.4 - 0.1 * random.random()]
        pose = lumihull.Pose.look_at(eye, middle, [0, -1, 0.1])
        seen = camera.project(pose.apply(board))
        pixels.append(seen + noise * random.normal(size=seen.shape))
        points.append(board)
    return pixels, points


def test_calibrates_a_lens(tmp_path: Path) -> None:
    camera = lumihull.Camera(1200, 900, 1300, u0=611, v0=438, k1=0.1, k2=-0.02, p1=1e-3)
    pixels, points = views(camera, 8, 0.0)
    found = lumihull.calibrate_lens(pixels, points, 1200, 900)
    assert abs(found.camera.f - 1300) < 1e-5 and abs(found.camera.k1 - 0.1) < 1e-8
    assert found.rms_px < 1e-6 and not np.concatenate(found.outliers).any()

    pixels, points = views(camera, 10, 0.1)
    pixels[3][17] += [30, -20]
    found = lumihull.calibrate_lens(pixels, points, 1200, 900, covariances=[np.tile(0.01 * np.eye(2), (48, 1, 1))] * 10)
    assert found.outliers[3][17] and np.concatenate(found.outliers).sum() <= 3
    assert 0.9 < found.sigma0 < 1.1
    assert set(found.standard_deviations) == {"f", "u0", "v0", "k1", "k2", "p1", "p2"}
    assert abs(found.camera.f - 1300) < 5 * found.standard_deviations["f"]
    assert found.covariance.shape == (10, 10) and len(found.poses) == 10
    assert found.residuals[0].shape == (48, 2)
    assert found.projection_uncertainty(16, 12).shape == (12, 16)
    found.save(tmp_path / "camera.json")
    again = lumihull.LensCalibration.load(tmp_path / "camera.json")
    assert again.camera.f == found.camera.f and (again.covariance == found.covariance).all()

    only = lumihull.calibrate_lens(pixels, points, 1200, 900, free=["f"], start=camera)
    assert set(only.standard_deviations) == {"f"} and only.camera.k1 == 0.1


def test_refuses_what_is_no_view() -> None:
    camera = lumihull.Camera(1200, 900, 1300)
    pixels, points = views(camera, 4, 0.0)
    for bad in (
        lambda: lumihull.calibrate_lens(pixels[:3], points, 1200, 900),
        lambda: lumihull.calibrate_lens([p[:9] for p in pixels], points, 1200, 900),
        lambda: lumihull.calibrate_lens([p * np.nan for p in pixels], points, 1200, 900),
        lambda: lumihull.calibrate_lens(pixels, points, 0, 900),
        lambda: lumihull.calibrate_lens(pixels, points, 1200, 900, free=["fx"]),
        lambda: lumihull.find_point_grid(np.zeros((9, 9), np.uint8), "matrix5x5:18mm"),
    ):
        with pytest.raises(lumihull.Error) as caught:
            bad()
        assert caught.value.code == "invalid_argument"
    with pytest.raises(lumihull.Error) as caught:
        lumihull.calibrate_lens(pixels[:1] * 4, points[:1] * 4, 1200, 900)
    assert caught.value.code == "degenerate"
    assert lumihull.find_point_grid(np.zeros((50, 60), np.uint8), "chessboard:9x6:25mm") is None
