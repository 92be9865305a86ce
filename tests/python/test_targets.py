"""Targets: families, what was printed, sheets to print."""

from pathlib import Path

import numpy as np
import pytest

import lumihull


def test_families() -> None:
    names = lumihull.TargetFamily.names()
    assert names[:3] == ["paper4x4", "matrix5x5", "matrix6x6"]
    assert {"apriltag:36h11", "aruco:6x6_250"} < set(names)
    family = lumihull.TargetFamily("matrix5x5")
    assert (family.name, family.kind, family.grid, family.minimum_distance) == ("matrix5x5", "circles", 5, 4)
    assert family == lumihull.TargetFamily("matrix5x5") and hash(family) == hash(lumihull.TargetFamily("matrix5x5"))
    assert np.array_equal(family.ids, np.arange(256))
    assert family.has(255) and not family.has(256)
    for id in (0, 46, 255):
        cells = family.cells(id)
        assert cells.shape == (5, 5) and cells.dtype == np.uint8
        assert not cells[:, 0].any() and not cells[-1].any()
        for turns in range(4):
            turned = np.ascontiguousarray(np.rot90(cells, turns))  # counter-clockwise
            turned[2, 2] = 2
            read = family.decode(turned)
            assert read is not None
            assert (read.id, read.quarter_turns, read.corrected, read.erased) == (id, turns, 0, 1)
    assert family.decode(np.zeros((5, 5), np.uint8)) is None
    assert family.decode(np.array([[1 - cells[0, 0], *cells[0, 1:]], *cells[1:]], np.uint8), strength=0) is None
    for bad in (np.zeros((4, 5), np.uint8), np.full((5, 5), 3, np.uint8)):
        with pytest.raises(lumihull.Error) as caught:
            family.decode(bad)
        assert caught.value.code == "invalid_argument"
    with pytest.raises(lumihull.Error) as caught:
        lumihull.TargetFamily("matrix9x9")
    assert caught.value.code == "invalid_argument"


def test_sets_go_through_files(tmp_path: Path) -> None:
    tags = lumihull.TargetDesign("apriltag:36h11", 0.05)
    circles = lumihull.TargetDesign("matrix6x6", 0.03, ring_diameter_m=0.008, scale_x=1.002, ink=(0, 0, 90))
    assert (tags.ink, tags.paper) == ((0, 0, 0), (255, 255, 255))
    assert np.allclose(tags.features, [[-0.025, -0.025], [0.025, -0.025], [0.025, 0.025], [-0.025, 0.025]])
    assert circles.features.shape == (36, 2)
    assert np.allclose(circles.features[0], [-0.075 * 1.002, -0.075])
    aside = lumihull.Pose(np.hstack([np.eye(3), [[0.2], [0], [0]]]))
    made = lumihull.TargetSet(
        [tags, circles],
        [lumihull.Board("box", [lumihull.BoardTarget(0, 7), lumihull.BoardTarget(1, 4000, aside)])],
        [lumihull.PointGrid("chessboard", 9, 6, 0.025)],
    )
    made.save(tmp_path / "set.json")
    for again in (lumihull.TargetSet.load(tmp_path / "set.json"), lumihull.TargetSet.from_text(str(tmp_path / "set.json"))):
        assert [d.family.name for d in again.designs] == ["apriltag:36h11", "matrix6x6"]
        assert again.designs[1].ring_diameter_m == 0.008 and again.designs[1].ink == (0, 0, 90)
        (board,) = again.boards
        assert board.name == "box" and [(t.design, t.id) for t in board.targets] == [(0, 7), (1, 4000)]
        assert np.array_equal(board.targets[1].board_from_target.matrix, aside.matrix)
        assert again.grids[0].kind == "chessboard" and again.grids[0].points.shape == (54, 2)
        assert np.allclose(again.grids[0].points[10], [0.025, 0.025])


def test_words_and_faults(tmp_path: Path) -> None:
    words = lumihull.TargetSet.from_word("matrix5x5:18mm,circles:11x8:15mm")
    assert words.designs[0].size_m == pytest.approx(0.018) and words.grids[0].columns == 11
    assert words.boards == []
    twice = [lumihull.BoardTarget(0, 7), lumihull.BoardTarget(0, 7)]
    for make in (
        lambda: lumihull.TargetSet.from_word("matrix5x5"),
        lambda: lumihull.TargetSet(),
        lambda: lumihull.TargetSet([lumihull.TargetDesign("matrix5x5", -1)]),
        lambda: lumihull.TargetSet([lumihull.TargetDesign("matrix5x5", 0.02)], [lumihull.Board("a", twice)]),
        lambda: lumihull.PointGrid("spirals", 9, 6),  # type: ignore[arg-type]
        lambda: lumihull.PointGrid("circles", 100000, 100000, 1).points,
    ):
        with pytest.raises(lumihull.Error) as caught:
            make()
        assert caught.value.code == "invalid_argument"
    (tmp_path / "bad.json").write_text('{"format": "lumihull-targets", "version": 1, "designs": [{"family": "x"}]}')
    with pytest.raises(lumihull.Error) as caught:
        lumihull.TargetSet.load(tmp_path / "bad.json")
    assert caught.value.code == "bad_input" and "/designs/0/family" in caught.value.message


def test_sheets(tmp_path: Path) -> None:
    seen: list[int] = []
    design = lumihull.TargetDesign("matrix5x5")
    made = lumihull.write_target_sheets(
        tmp_path / "t", design, range(6), formats=["pdf", "svg"], paper="a4", per_sheet=4,
        progress=lambda p: seen.append(p.done),
    )
    assert {f.name for f in tmp_path.iterdir()} == {"t.pdf", "t-1.svg", "t-2.svg", "t.json"}
    assert made.designs[0].size_m == 0.018 and [len(b.targets) for b in made.boards] == [4, 2]
    assert seen[-1] == 4
    assert (tmp_path / "t.pdf").read_bytes().startswith(b"%PDF")
    board = lumihull.write_grid_sheet(tmp_path / "b", lumihull.PointGrid("chessboard", 9, 6), ink=(10, 10, 10))
    assert board.grids[0].spacing_m == 0.025
    with pytest.raises(lumihull.Error) as caught:
        lumihull.write_target_sheets(tmp_path / "x", design, [300])
    assert caught.value.code == "invalid_argument"
    with pytest.raises(lumihull.Error):
        lumihull.write_target_sheets(tmp_path / "x", design, [3], formats=["png"])  # type: ignore[list-item]
    assert not (tmp_path / "x.json").exists()


def sheet_photo(design: lumihull.TargetDesign, target: int, px_per_m: float = 3000.0) -> np.ndarray:
    """One target seen straight on, each pixel the mean of 8 x 8 samples: (h, w, 3) uint8."""
    fine = 8
    side = round(design.family.grid * design.size_m * px_per_m)
    y, x = np.mgrid[0 : side * fine, 0 : side * fine] / (fine * px_per_m) + 0.5 / (fine * px_per_m)
    dark = np.zeros(x.shape)
    radius = design.circle_diameter_m / 2 if design.circle_diameter_m else design.size_m / 4
    for (px, py), light in zip(design.features + side / px_per_m / 2, design.family.cells(target).ravel()):
        r = np.hypot(x - px, y - py) / radius
        dark[(r <= 1) & ((r >= 0.55) | (light == 0))] = 1
    ink = dark.reshape(side, fine, side, fine).mean(axis=(1, 3))
    linear = 0.6 * (1 - ink)[..., None] * [0.5, 1.0, 0.5] + 0.02
    noise = np.random.default_rng(1).normal(0, 0.004, linear.shape)
    value = np.clip(linear + noise, 0, 1)
    srgb = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.round(255 * srgb).astype(np.uint8)


def test_a_target_is_found_where_it_is() -> None:
    design = lumihull.TargetSet.from_word("matrix5x5:20mm").designs[0]
    photo = sheet_photo(design, 77)
    detector = lumihull.TargetDetector(lumihull.TargetSet.from_word("matrix5x5:20mm"))
    found = detector.detect(photo)
    assert [d.id for d in found.targets] == [77]
    target = found.targets[0]
    assert target.indices.tolist() == list(range(25))
    expected = design.features[target.indices] * 3000 + photo.shape[0] / 2
    error = target.pixels - expected
    assert np.abs(error).max() < 0.05
    squares = np.einsum("ni,nij,nj->n", error, np.linalg.inv(target.covariances), error)
    assert 0.8 < squares.mean() < 3.5  # ideal: 2
    assert target.dual_conics.shape == (25, 3, 3)
    assert target.pixel_from_target.shape == (3, 3)
    samples = lumihull.InkSamples()
    with pytest.raises(lumihull.Error) as caught:
        samples.train()
    assert caught.value.code == "degenerate"
    samples.add(photo, lumihull.TargetSet.from_word("matrix5x5:20mm"), found)
    assert samples.ink_pixels > 1000
    keyed = lumihull.TargetDetector(lumihull.TargetSet.from_word("matrix5x5:20mm"), ink_key=samples.train())
    assert [d.id for d in keyed.detect(photo).targets] == [77]
    drawn = detector.draw(photo, found)
    assert drawn.array.shape == photo.shape
    assert (drawn.array != photo).any()


def test_a_detector_says_what_is_wrong() -> None:
    with pytest.raises(lumihull.Error, match="smallest circle"):
        lumihull.TargetDetector(lumihull.TargetSet.from_word("matrix5x5:20mm"), min_circle_px=0)
    empty = lumihull.TargetDetector(lumihull.TargetSet.from_word("matrix5x5:20mm")).detect(np.zeros((1, 1, 3), np.uint8))
    assert not empty.targets and not empty.refused
