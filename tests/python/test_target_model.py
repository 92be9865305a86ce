"""What the stage "calibrate" leaves, read as arrays."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import lumihull

KEPT = Path(os.environ["LUMIHULL_SOURCE_DIR"]) / "tests" / "fuzz" / "corpus" / "calibration" / "model.json"


@pytest.fixture
def capture(tmp_path: Path) -> lumihull.Capture:
    """Four photographs, two of them with a pose, and a target model that was made elsewhere."""
    files = []
    for i in range(4):
        files.append(tmp_path / f"p{i}.png")
        lumihull.write_png(files[-1], np.zeros((10, 15, 3), np.uint8))
    capture = lumihull.import_photos(files, tmp_path / "capture")
    for i in (0, 3):
        capture.set_pose(i, lumihull.Pose.look_at([1, i, 2], [0, 0, 0], [0, 0, 1]))
    capture.save()
    return capture


def test_reads_the_model(capture: lumihull.Capture) -> None:
    with pytest.raises(lumihull.Error) as caught:
        lumihull.TargetModel.of(capture)
    assert caught.value.code == "not_found" and "calibrate" in caught.value.message
    shutil.copy(KEPT, capture.folder / "targets.json")
    model = lumihull.TargetModel.of(capture)
    assert len(model) == 3 and model.names == ["matrix5x5 0", "matrix5x5 1", "matrix5x5 2"]
    assert model.points(0).shape == (25, 3) and model.covariances(0).shape == (25, 3, 3)
    assert (np.linalg.eigvalsh(model.covariances(1)) > 0).all()
    features = model.features(1)
    assert features.shape == (25, 3) and (features[:, 1] == 1).all() and (features[:, 2] == range(25)).all()
    assert model.pose(0) is not None and model.pose(-1) is None and model.points(2).shape == (0, 3)
    assert [model.part(i) for i in range(3)] == [0, 0, -1]
    assert model.pose_in_part(0) is not None and model.pose_in_part(2) is None
    photos = model.photos
    assert [p["part"] for p in photos] == [0, 0, -1, 0] and photos[2]["reason"] == "shows no target"
    assert photos[3]["in_model"] and photos[3]["cam_from_part"] is not None and photos[2]["cam_from_part"] is None
    figures = model.describe()
    assert figures["photos"] == 4 and figures["photos_placed"] == 2 and figures["targets"] == 2
    assert figures["removed"][0]["why"] == "outlier"
    assert len(lumihull.TargetModel.load(KEPT)) == 3
    with pytest.raises(IndexError):
        model.points(3)


def test_quality_belongs_to_what_was_calibrated(capture: lumihull.Capture) -> None:
    assert capture.pose_covariance(0) is None and capture.camera_covariance(0) is None
    with pytest.raises(IndexError):
        capture.camera_covariance(1)


def test_the_stage_says_what_it_needs(capture: lumihull.Capture) -> None:
    with pytest.raises(lumihull.Error) as caught:
        capture.run_stage("calibrate")
    assert caught.value.code == "invalid_argument" and caught.value.subject == "targets"
    capture.set_option("calibrate", "targets", "matrix5x5:18mm")
    assert capture.option("calibrate", "targets") == "matrix5x5:18mm"  # a word, no path
    with pytest.raises(lumihull.Error) as caught:
        capture.run_stage("calibrate")
    assert caught.value.code == "degenerate"


def test_bars_reach_the_stage(capture: lumihull.Capture) -> None:
    capture.set_option("calibrate", "targets", "matrix5x5:18mm")
    capture.set_option("calibrate", "bar", "1.0,2.24,0.5,0.1mm; 3.0,4")
    with pytest.raises(lumihull.Error) as caught:
        capture.run_stage("calibrate")
    assert caught.value.code == "invalid_argument" and caught.value.subject == "bar" and "3.0,4" in caught.value.message
    capture.set_option("calibrate", "bar", "")
    capture.set_option("calibrate", "free_print_scale", True)
    with pytest.raises(lumihull.Error) as caught:
        capture.run_stage("calibrate")
    assert caught.value.code == "invalid_argument" and caught.value.subject == "free_print_scale"
    capture.set_option("calibrate", "bar", "1.0,2.24,0.5")
    with pytest.raises(lumihull.Error) as caught:
        capture.run_stage("calibrate")
    assert caught.value.code == "degenerate"  # black photographs
    capture.set_option("calibrate", "bar", "")
    capture.set_option("calibrate", "free_print_scale", False)
    capture.set_option("calibrate", "rig", True)
    with pytest.raises(lumihull.Error) as caught:
        capture.run_stage("calibrate")
    assert caught.value.subject == "rig" and "several cameras" in caught.value.message
