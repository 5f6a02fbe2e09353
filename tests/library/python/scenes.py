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


def sphere(rings=16, radius=1.0, centre=(0, 0, 0)):
    """A closed mesh around a centre, whose triangles are counter-clockwise as seen from outside."""
    theta = np.linspace(0, np.pi, rings + 1)[1:-1, None]
    phi = np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    ring = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi),
                     np.cos(theta) * np.ones_like(phi)], axis=-1).reshape(-1, 3)
    points = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]]) * radius + centre
    side = 2 * rings
    here = np.arange(len(ring)).reshape(-1, side)
    right = np.roll(here, -1, axis=1)
    top, bottom = np.full(side, len(ring)), np.full(side, len(ring) + 1)
    triangles = [(top, here[0], right[0]), (bottom, right[-1], here[-1]),
                 (here[:-1].ravel(), here[1:].ravel(), right[:-1].ravel()),
                 (right[:-1].ravel(), here[1:].ravel(), right[1:].ravel())]
    return (points.astype(np.float32),
            np.concatenate([np.stack(t, axis=-1) for t in triangles]).astype(np.uint32))


def cube():
    """[0, 1] on all axes, with two triangles a side."""
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
    triangles = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                 [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return points, np.array(triangles, np.uint32)


DOWN = np.array([[0.2, 0.3, 1, 0, 0, -1]], np.float32)


def brute_force(points, triangles, rays, **options):
    return morphray.Scene(points, triangles, device="brute", **options).intersect(rays)


def assert_same_bits(a, b):
    assert a.dtype == b.dtype and a.shape == b.shape
    assert a.tobytes() == b.tobytes()
