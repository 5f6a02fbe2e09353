"""Checks Open3D's RaycastingScene: prints "pass CHECK" or "fail CHECK" lines."""
import numpy as np
import open3d as o3d


def check(good, text):
    print("pass" if good else "fail", text, flush=True)


def tensor(array):
    return o3d.core.Tensor(np.ascontiguousarray(array, dtype=np.float32))


def wavy_sphere(resolution):
    mesh = o3d.geometry.TriangleMesh.create_sphere(1.0, resolution=resolution)
    points = np.asarray(mesh.vertices)
    points *= 1 + 0.05 * np.sin(20 * points[:, :1]) * np.sin(17 * points[:, 1:2])
    mesh.vertices = o3d.utility.Vector3dVector(points)
    return mesh


def make_scene(meshes):
    scene = o3d.t.geometry.RaycastingScene()
    for mesh in meshes:
        scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene


def check_parity():
    mesh = wavy_sphere(150)
    scene = make_scene([mesh])
    points = np.asarray(mesh.vertices).astype(np.float32)
    for name, eye, is_odd in (("inside", (0, 0, 0), True), ("outside", (0.3, 0.2, 3), False)):
        eye = np.float32(eye)
        rays = np.concatenate([np.tile(eye, (len(points), 1)), points - eye], 1)
        counts = scene.count_intersections(tensor(rays)).numpy()
        wrong = (counts % 2 == 1) != is_odd
        # Open3D counts two hits at one t once, and a ray that touches the surface has two or none.
        most = 0 if is_odd else len(points) // 1000
        check(wrong.sum() <= most, f"{len(points)} rays from {name} through vertices: "
                               f"{wrong.sum()} wrong counts, {(counts == 0).sum()} zeros")
        lost = ~np.isfinite(scene.cast_rays(tensor(rays))["t_hit"].numpy())
        if is_odd:
            check(not lost.any(), f"{lost.sum()} rays from {name} lost")


def check_distances():
    box = o3d.geometry.TriangleMesh.create_box()
    scene = make_scene([box])
    rng = np.random.default_rng(2)
    points = (rng.random((5000, 3)) * 3 - 1).astype(np.float32)
    beside = np.maximum(np.maximum(-points, points - 1), 0)
    depth = np.minimum(points, 1 - points).min(axis=1)
    inside = depth > 0
    signed = np.where(inside, -depth, np.linalg.norm(beside, axis=1))
    found = scene.compute_signed_distance(tensor(points)).numpy()
    check(np.abs(found - signed).max() < 1e-5, "signed distances of a box")
    occupancy = scene.compute_occupancy(tensor(points)).numpy() > 0
    check((occupancy == inside).all(), "occupancy of a box")
    closest = scene.compute_closest_points(tensor(points))["points"].numpy()
    distance = np.linalg.norm(closest - points, axis=1)
    check(np.abs(distance - np.abs(signed)).max() < 1e-5, "closest points of a box")


if __name__ == "__main__":
    check_parity()
    check_distances()
