import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import lumihull


@pytest.fixture(scope="session")
def rig() -> Path:
    """Photographs by the virtual rig, with the truth beside."""
    return Path(os.environ["LUMIHULL_RIG_PHOTOS"])


@pytest.fixture(scope="session")
def finished(rig: Path, tmp_path_factory: pytest.TempPathFactory) -> lumihull.Capture:
    """A capture whose stages were all run; its tests leave it as it is."""
    capture = lumihull.import_projections(rig / "P.txt", tmp_path_factory.mktemp("python") / "capture")
    lumihull.import_enclosure(capture, sorted((rig / "enclosure").iterdir()))
    capture.hold_out = 6
    capture.set_option("hull", "resolution", 80)
    capture.run()
    return capture


@pytest.fixture
def own_copy(finished: lumihull.Capture, tmp_path: Path) -> lumihull.Capture:
    shutil.copytree(finished.folder, tmp_path / "capture")
    return lumihull.Capture.open(tmp_path / "capture")


@pytest.fixture
def ball() -> tuple[list[lumihull.View], list[np.ndarray]]:
    """Twelve views of a ball of radius 1 and their exact silhouettes."""
    size, f, distance = 96, 200.0, 6.0
    camera = lumihull.Camera(size, size, f)
    outline = f / np.sqrt(distance**2 - 1)
    y, x = np.mgrid[:size, :size] + 0.5 - size / 2
    mask = np.rint(255 * np.clip(outline - np.hypot(x, y) + 0.5, 0, 1)).astype(np.uint8)
    views = []
    for i in range(12):
        turn, height = 2 * np.pi * i / 8, 0.3 if i < 8 else 1.1
        eye = distance * np.array([np.cos(turn) * np.cos(height), np.sin(turn) * np.cos(height), np.sin(height)])
        views.append(lumihull.View(camera, lumihull.Pose.look_at(eye, [0, 0, 0], [0, 0, 1])))
    return views, [mask] * 12
