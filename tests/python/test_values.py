"""What goes in and out as arrays: values, views without copies, faults."""

from pathlib import Path

import numpy as np
import pytest

import lumihull


def test_camera_projects_and_unprojects() -> None:
    camera = lumihull.Camera(640, 480, 500, s=1.1, skew=2, k1=-0.05, k2=0.01, p1=1e-3)
    points = np.array([[0.1, -0.2, 2.0], [0, 0, 1], [0.3, 0.1, -1]])
    pixels = camera.project(points)
    assert np.allclose(pixels[1], [320, 240])
    assert np.isnan(pixels[2]).all()
    rays = camera.unproject(pixels[:2])
    assert np.allclose(rays, points[:2] / points[:2, 2:], atol=1e-10)
    step = 1e-6
    for k in range(3):
        moved = np.eye(3)[k] * step
        slope = (camera.project(points + moved) - camera.project(points - moved)) / (2 * step)
        assert np.allclose(slope[:2], camera.project_jacobian(points)[:2, :, k], atol=1e-5)
    assert camera.project(np.empty((0, 3))).shape == (0, 2)


def test_pose_is_a_group() -> None:
    pose = lumihull.Pose.look_at([1, -5, 2], [0, 0, 0], [0, 0, 1])
    assert np.allclose(pose.center, [1, -5, 2])
    assert np.allclose((pose @ pose.inverse()).matrix, np.eye(3, 4), atol=1e-12)
    points = np.random.default_rng(1).normal(size=(5, 3))
    assert np.allclose(pose.apply(points), points @ pose.matrix[:, :3].T + pose.translation)
    assert np.allclose(lumihull.Pose(pose.matrix).matrix, pose.matrix)
    mirrored = np.diag([1.0, 1, -1])
    for bad in (np.eye(4), np.hstack([mirrored, np.zeros((3, 1))]), np.full((3, 4), np.nan)):
        with pytest.raises(lumihull.Error) as caught:
            lumihull.Pose(bad)
        assert caught.value.code == "invalid_argument"


def test_image_is_seen_without_copy(tmp_path: Path) -> None:
    pixels = np.random.default_rng(2).integers(0, 256, (5, 7, 3), np.uint8)
    image = lumihull.Image(pixels)
    assert not np.shares_memory(np.asarray(image), pixels)  # the constructor copies
    assert np.shares_memory(np.asarray(image), image.array)
    assert np.array_equal(image.array, pixels)
    image.array[2, 3] = 1
    assert (np.asarray(image)[2, 3] == 1).all()
    view = image.array
    del image
    assert (view[2, 3] == 1).all()  # the view keeps the picture alive

    lumihull.write_png(tmp_path / "a.png", pixels)
    assert np.array_equal(lumihull.read_image(tmp_path / "a.png").array, pixels)
    deep = np.arange(12, dtype=np.uint16).reshape(3, 4) * 5000
    lumihull.write_png(tmp_path / "b.png", deep)
    assert np.array_equal(lumihull.read_image(str(tmp_path / "b.png")).array, deep)
    strided = pixels[::2, ::-1]
    assert np.array_equal(lumihull.Image(strided).array, strided)


@pytest.mark.parametrize(
    "array",
    [np.zeros((3, 4, 2), np.uint8), np.zeros(3, np.uint8), np.zeros((0, 4), np.uint8), np.zeros((3, 4, 3), np.int64)],
)
def test_arrays_that_are_no_pictures(array: np.ndarray) -> None:
    with pytest.raises(lumihull.Error) as caught:
        lumihull.Image(array)
    assert caught.value.code == "invalid_argument"


def test_errors_say_what_and_where(tmp_path: Path) -> None:
    with pytest.raises(lumihull.Error) as caught:
        lumihull.read_image(tmp_path / "absent.jpg")
    error = caught.value
    assert isinstance(error, RuntimeError)
    assert error.code == "not_found"
    assert error.subject.endswith("absent.jpg")
    assert error.message and "\n" not in error.message
    assert str(error) == f"{error.subject}: {error.message}"


def test_mesh_views_and_files(tmp_path: Path) -> None:
    vertices = np.array([[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], np.uint32)
    mesh = lumihull.Mesh(vertices, triangles)
    assert np.shares_memory(mesh.vertices, mesh.vertices)
    assert not np.shares_memory(mesh.vertices, vertices)
    with pytest.raises(ValueError):
        mesh.triangles[0, 0] = 99  # a view into what must stay valid
    view = mesh.vertices
    del mesh
    assert np.array_equal(view, vertices)

    mesh = lumihull.Mesh(vertices, triangles)
    assert mesh.volume == pytest.approx(1 / 3)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1)
    for name in ("a.ply", "a.obj"):
        lumihull.write_mesh(tmp_path / name, mesh)
        again = lumihull.read_mesh(tmp_path / name)
        assert np.array_equal(again.triangles, triangles) and np.array_equal(again.vertices, vertices)
    with pytest.raises(lumihull.Error):
        lumihull.Mesh(vertices, triangles + 1)
    with pytest.raises(lumihull.Error):
        lumihull.Mesh(vertices[:, :2], triangles)


def test_rays() -> None:
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32)
    scene = lumihull.RayScene(lumihull.Mesh(vertices, np.array([[0, 1, 2]], np.uint32)))
    origins = np.array([[0, 0, 5], [9, 9, 5], [np.nan, 0, 5]], np.float32)
    directions = np.tile(np.array([0, 0, -1], np.float32), (3, 1))
    triangle, distance, barycentric = scene.hit(origins, directions)
    assert list(triangle) == [0, lumihull.NO_HIT, lumihull.NO_HIT]
    assert distance[0] == pytest.approx(5) and np.isinf(distance[1:]).all()
    b1, b2 = barycentric[0]
    assert np.allclose((1 - b1 - b2) * vertices[0] + b1 * vertices[1] + b2 * vertices[2], 0, atol=1e-6)


def test_color_key(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    background = rng.integers([10, 170, 20], [30, 190, 40], (500, 3)).astype(np.uint8)
    key = lumihull.ColorKey.train(background, k=5)
    picture = np.zeros((6, 8, 3), np.uint8)
    picture[:, :4] = [20, 180, 30]
    picture[:, 4:] = [200, 30, 40]
    decided = key.decide(picture)
    assert decided.dtype == bool and decided.shape == (6, 8)
    assert not decided[:, :4].any() and decided[:, 4:].all()
    assert np.array_equal(key.silhouette(picture, edges="hard").array, decided * np.uint8(255))
    assert (key.probability(picture[0]) > 0.5).tolist() == decided[0].tolist()
    key.save(tmp_path / "key.json")
    assert np.array_equal(lumihull.ColorKey.load(tmp_path / "key.json").decide(picture), decided)
    with pytest.raises(lumihull.Error):
        key.silhouette(picture, edges="fluffy")  # type: ignore[arg-type]


def test_carve_a_ball(ball: tuple[list[lumihull.View], list[np.ndarray]]) -> None:
    views, masks = ball
    mesh = lumihull.carve(views, masks, resolution=64)
    assert 4.18 < mesh.volume < 4.9
    assert (np.linalg.norm(mesh.vertices, axis=1) > 0.97).all()
    check = mesh.check()
    assert check.good and check.parts == 1 and check.euler == 2 and check.self_intersections in (0, None)
    small = mesh.simplify(max_triangles=1000)
    assert len(small.triangles) <= 1000 and small.volume == pytest.approx(mesh.volume, rel=0.02)
    half = lumihull.carve(views, masks, resolution=64, cut_planes=[(0, 0, 1, 0)])
    assert half.vertices[:, 2].max() < 0.05
    with pytest.raises(lumihull.Error) as caught:
        nothing = np.zeros_like(masks[0])  # with min_views every view has its say wherever something could be left
        lumihull.carve(views, masks[:3] + [nothing] + masks[4:], resolution=64, min_views=12)
    assert caught.value.code == "degenerate" and "view 3" in str(caught.value)


def test_metrics() -> None:
    a = np.full((16, 16, 3), 100, np.uint8)
    b = np.full((16, 16, 3), 110, np.uint8)
    assert lumihull.psnr(a, b) == pytest.approx(10 * np.log10(255**2 / 100))
    assert lumihull.psnr(a, a) == 100
    assert lumihull.ssim(a, a) == pytest.approx(1)
    mask = np.zeros((16, 16), np.uint8)
    assert np.isnan(lumihull.psnr(a, b, mask))
    mask[:8] = 255
    assert lumihull.silhouette_iou(mask, np.roll(mask, 4, axis=0)) == pytest.approx(1 / 3)


def test_resect_finds_the_pose_and_names_what_is_wrong() -> None:
    random = np.random.default_rng(2)
    camera = lumihull.Camera(3000, 2000, 2500, k1=0.05, p1=1e-3)
    pose = lumihull.Pose.look_at([1, -5, 2], [0, 0, 0], [0, 0, 1])
    world = random.uniform(-1, 1, size=(40, 3))
    pixels = camera.project(pose.apply(world))
    exact = lumihull.resect(camera, pixels, world)
    assert np.allclose(exact.pose.matrix, pose.matrix, atol=1e-9)
    assert exact.rms_px < 1e-6 and len(exact.outliers) == 0 and exact.alternative is None

    noisy = pixels + random.normal(scale=0.05, size=pixels.shape)
    noisy[[3, 17]] += 20
    covariances = np.broadcast_to(0.05**2 * np.eye(2), (40, 2, 2))
    found = lumihull.resect(camera, noisy, world, covariances)
    assert list(found.outliers) == [3, 17]
    assert 0.7 < found.sigma0 < 1.3 and found.iterations > 0
    assert np.allclose(found.covariance, found.covariance.T) and (np.linalg.eigvalsh(found.covariance) > 0).all()
    assert np.allclose(found.pose.center, pose.center, atol=1e-3)
    assert lumihull.resect(camera, noisy, world, robust=False).rms_px > 1

    normals = np.broadcast_to([0.0, -1, 0], (40, 3))
    assert lumihull.resect(camera, pixels, world, radii=np.full(40, 1e-6), normals=normals).rms_px < 1e-6
    for arguments, options, code in [
        ((pixels[:3], world[:3]), {}, "invalid_argument"),
        ((pixels, world[:3]), {}, "invalid_argument"),
        ((pixels, world, np.eye(2)), {}, "invalid_argument"),
        ((pixels, world), {"radii": np.ones(40)}, "invalid_argument"),
        ((pixels, np.linspace(0, 1, 40)[:, None] * np.ones(3)), {}, "degenerate"),
    ]:
        with pytest.raises(lumihull.Error) as caught:
            lumihull.resect(camera, *arguments, **options)
        assert caught.value.code == code
