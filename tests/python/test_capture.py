"""The main job: a capture from photographs to judged new views."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import lumihull


def test_the_main_job(finished: lumihull.Capture, rig: Path) -> None:
    assert len(finished) == 24 and finished.names[0] == "0001"
    assert finished.held_out(0) and not finished.held_out(1)
    iou = [
        lumihull.silhouette_iou(finished.read_mask(i), lumihull.read_image(rig / "truth" / "masks" / f"{name}.png"))
        for i, name in enumerate(finished.names)
    ]
    assert np.mean(iou) > 0.96
    truth = lumihull.read_mesh(rig / "truth" / "mesh.ply").volume
    assert truth < finished.read_hull().volume < 1.15 * truth
    judged = finished.evaluation()
    assert judged["photos_held_out"] == 4
    assert judged["silhouette_iou"] > 0.9
    assert judged["methods"]["lumigraph"]["psnr"] > 18


def test_beside_the_truth(finished: lumihull.Capture, rig: Path, tmp_path: Path) -> None:
    compared = finished.compare_with_truth(rig / "truth", page=tmp_path / "truth.html")
    assert compared["poses"]["center_mm"]["max"] < 1e-3
    assert compared["masks"]["iou_mean"] > 0.96 and len(compared["masks"]["shots"]) == 24
    assert 1 < compared["surface"]["volume_ratio"] < 1.15
    assert any(line.startswith("targets:") for line in compared["left_out"])
    assert "<svg" in (tmp_path / "truth.html").read_text()
    with pytest.raises(lumihull.Error):
        finished.compare_with_truth(rig / "nowhere")


def test_stages_are_skipped_when_nothing_changed(own_copy: lumihull.Capture) -> None:
    results = {r.stage: r for r in own_copy.run()}
    assert list(results) == lumihull.stage_names()
    assert results["hull"].skipped and results["key"].skipped
    own_copy.set_option("hull", "resolution", 40)
    again = own_copy.run_stage("hull")
    assert not again.skipped and again.seconds > 0 and again.peak_bytes > 0 and again.lines


@pytest.mark.parametrize("method", ["light_field", "lumigraph", "mean_texture", "shaded"])
def test_rendering(finished: lumihull.Capture, method: str) -> None:
    renderer = lumihull.Renderer(finished, method)  # type: ignore[arg-type]
    view = finished.view(0)
    rendering = renderer.render(view, rays=1, depth=True)
    assert rendering.rgba.shape == (160, 240, 4) and rendering.rgba.dtype == np.uint8
    assert rendering.depth is not None and rendering.depth.shape == (160, 240)
    hit = rendering.rgba[:, :, 3] == 255
    assert hit.mean() > 0.02
    assert np.array_equal(np.isfinite(rendering.depth), rendering.rgba[:, :, 3] > 0)
    if method != "shaded":
        photo, mask = finished.read_photo(0), finished.read_mask(0)
        assert lumihull.psnr(np.ascontiguousarray(rendering.rgba[:, :, :3]), photo, mask) > 18
    assert renderer.render(view, rays=1).depth is None
    around = renderer.turntable(3, 64, 48, elevation=0.3)
    assert len(around) == 3 and around[1].camera.width == 64
    assert (renderer.render(around[1], rays=1).rgba[:, :, 3] > 0).mean() > 0.02


def test_a_model_by_its_file_alone(finished: lumihull.Capture, tmp_path: Path) -> None:
    view = finished.view(0)
    for method, file in (("light_field", "light_field.glb"), ("mean_texture", "textured.glb")):
        expected = lumihull.Renderer(finished, method)  # type: ignore[arg-type]
        shutil.copy(finished.folder / file, tmp_path / "model.glb")
        renderer = lumihull.Renderer.open(tmp_path / "model.glb")
        assert np.array_equal(renderer.render(view, rays=2).rgba, expected.render(view, rays=2).rgba)
        assert len(renderer.turntable(2, 64, 48)) == 2
    # The light field knows its photographs' up; the texture alone does not.
    around, alone = (
        lumihull.Renderer(finished, "light_field").turntable(3, 64, 48)[1],
        lumihull.Renderer.open(finished.folder / "light_field.glb").turntable(3, 64, 48)[1],
    )
    assert np.allclose(around.cam_from_world.matrix, alone.cam_from_world.matrix, atol=1e-4)
    (tmp_path / "words.glb").write_text("these are no triangles, but they are long enough")
    for name, code in (("nowhere.glb", "not_found"), ("words.glb", "bad_input")):
        with pytest.raises(lumihull.Error) as caught:
            lumihull.Renderer.open(tmp_path / name)
        assert caught.value.code == code and name in caught.value.subject


def test_adaptive_rays_change_no_outline(finished: lumihull.Capture) -> None:
    renderer = lumihull.Renderer(finished, "light_field")
    view = finished.view(0)
    everywhere = renderer.render(view, rays=4).rgba
    adaptive = renderer.render(view, rays=4, adaptive=True).rgba
    assert np.array_equal(adaptive[:, :, 3], everywhere[:, :, 3])
    assert not np.array_equal(adaptive, everywhere)
    assert lumihull.psnr(np.ascontiguousarray(adaptive[:, :, :3]), np.ascontiguousarray(everywhere[:, :, :3])) > 35


def test_options(own_copy: lumihull.Capture) -> None:
    default, help_text = lumihull.stage_options("hull")["resolution"]
    assert isinstance(default, int) and help_text
    assert own_copy.option("hull", "resolution") == 80
    own_copy.set_option("hull", "resolution", 50)
    own_copy.save()
    assert lumihull.Capture.open(own_copy.folder).option("hull", "resolution") == 50
    for stage, name, value in (("hull", "resolution", "many"), ("hull", "colour", 1), ("nonsense", "k", 1)):
        with pytest.raises(lumihull.Error) as caught:
            own_copy.set_option(stage, name, value)
        assert caught.value.code == "invalid_argument"


def test_poses_cameras_and_masks_are_stored(own_copy: lumihull.Capture) -> None:
    pose = lumihull.Pose.look_at([1, 2, 3], [0, 0, 0], [0, 0, 1])
    own_copy.set_pose(3, pose)
    own_copy.set_pose(4, None)
    mask = np.zeros((160, 240), np.uint8)
    mask[50:90, 80:120] = 255
    own_copy.write_mask(2, mask)
    own_copy.background_rgb = [1, 2, 3]
    own_copy.save()
    again = lumihull.Capture.open(own_copy.folder)
    stored = again.pose(3)
    assert stored is not None and np.allclose(stored.matrix, pose.matrix)
    assert again.pose(4) is None
    assert np.array_equal(again.read_mask(2).array, mask)
    assert again.background_rgb == [1, 2, 3]
    with pytest.raises(lumihull.Error):
        again.view(4)
    with pytest.raises(IndexError):
        again.pose(24)
    assert again.pose(-1) is not None
    again.run_stage("key")
    assert np.array_equal(again.read_mask(2).array, mask)  # what a person gave is left alone


def test_a_capture_of_ones_own(tmp_path: Path) -> None:
    capture = lumihull.Capture.create(tmp_path / "own")
    photo = np.zeros((10, 12, 3), np.uint8)
    lumihull.write_png(tmp_path / "own" / "a.png", photo)
    camera = capture.add_camera(lumihull.Camera(12, 10, 15))
    shot = capture.add_shot("a", "a.png", camera)
    capture.set_pose(shot, lumihull.Pose())
    capture.unit_known = True
    capture.save()
    again = lumihull.Capture.open(tmp_path / "own")
    assert again.names == ["a"] and again.unit_known and again.cameras[0].f == 15
    assert again.file(0) == tmp_path / "own" / "a.png"
    assert np.array_equal(again.read_photo(0).array, photo)
    for name in ("a", "b/c", "b\0c", "b\nc", ""):
        with pytest.raises(lumihull.Error) as caught:
            again.add_shot(name, "a.png", 0)
        assert caught.value.code == "invalid_argument"


def test_exchange(finished: lumihull.Capture, tmp_path: Path) -> None:
    assert lumihull.export_nerf(finished, tmp_path / "transforms.json") < 0.01
    back = lumihull.import_nerf([tmp_path / "transforms.json"], tmp_path / "nerf", reference=True)
    for i in (0, 7):
        one, other = finished.pose(i), back.pose(i)
        assert one is not None and other is not None
        assert np.allclose(one.matrix, other.matrix, atol=1e-6)
    assert lumihull.export_colmap(finished, tmp_path / "colmap") < 0.01
    photos = finished.folder / "photos"
    back = lumihull.import_colmap(tmp_path / "colmap", photos, tmp_path / "from_colmap", reference=True)
    assert len(back) == 24
    described = back.describe()
    assert isinstance(json.dumps(described), str)
    plain = lumihull.import_photos(sorted(photos.iterdir())[:2], tmp_path / "plain")
    assert len(plain) == 2 and plain.pose(0) is None
    assert lumihull.import_masks(back, finished.folder / "masks") == 24
