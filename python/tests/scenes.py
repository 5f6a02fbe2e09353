"""Meshes and rays for the tests."""

import numpy as np

import morphray


def grid(size, seed=0):
    """A bumpy sheet of 2 * size * size triangles over [0, 1] x [0, 1]."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, size + 1), np.linspace(0, 1, size + 1))
    z = 0.2 * random.random(x.shape)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = np.arange(size * (size + 1)).reshape(size, size + 1)[:, :size].ravel()
    lower = np.stack([corner, corner + 1, corner + size + 1], axis=-1)
    upper = np.stack([corner + 1, corner + size + 2, corner + size + 1], axis=-1)
    return points, np.concatenate([lower, upper]).astype(np.uint32)


def random_rays(points, count, seed=1):
    """Rays of eight numbers from around a mesh to its points, some with a tnear and a tfar."""
    random = np.random.default_rng(seed)
    finite = points[np.isfinite(points).all(axis=1)]
    targets = finite[random.integers(len(finite), size=count)]
    org = random.normal(size=(count, 3)) * 2
    rays = np.empty((count, 8), np.float32)
    rays[:, 0:3] = org
    rays[:, 3] = np.where(random.random(count) < 0.2, random.uniform(-1, 1, count), 0)
    rays[:, 4:7] = targets + random.normal(size=(count, 3)) * 0.05 - org
    rays[:, 7] = np.where(random.random(count) < 0.2, random.uniform(0, 2, count), np.inf)
    return rays


def six(rays):
    return np.ascontiguousarray(rays[:, [0, 1, 2, 4, 5, 6]])


def triangle():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    return points, np.array([[0, 1, 2]], np.uint32)


DOWN = np.array([[0.2, 0.3, 1, 0, 0, -1]], np.float32)


def brute_force(points, triangles, rays, **options):
    return morphray.Scene(points, triangles, device="brute", **options).intersect(rays)


def assert_same_bits(a, b):
    assert a.dtype == b.dtype and a.shape == b.shape
    assert a.tobytes() == b.tobytes()
