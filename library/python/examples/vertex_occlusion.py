"""Ambient occlusion of each vertex of a bowl: the part of the rays to the outside that are
blocked within a given length.

    python3 library/python/examples/vertex_occlusion.py
"""

import numpy as np

import morphray


def bowl(rings, sides):
    """The lower half of a unit sphere, open above, with normals that point inwards."""
    polar = np.linspace(np.pi / 2, np.pi - 1e-3, rings)[:, None]
    around = np.linspace(0, 2 * np.pi, sides, endpoint=False)[None, :]
    points = np.stack(
        [np.sin(polar) * np.cos(around), np.cos(polar) + 0 * around, np.sin(polar) * np.sin(around)],
        axis=-1,
    ).reshape(-1, 3)
    ring, side = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    a = (ring * sides + side).ravel()
    b = (ring * sides + (side + 1) % sides).ravel()
    triangles = np.concatenate(
        [np.stack([a, b, a + sides], axis=-1), np.stack([b, b + sides, a + sides], axis=-1)]
    )
    return points.astype(np.float32), triangles.astype(np.uint32), (-points).astype(np.float32)


def hemisphere(normals, count, random):
    """(V, count, 3) directions around each normal, distributed by the cosine."""
    directions = random.normal(size=(len(normals), count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return directions + normals[:, None, :]


def vertex_occlusion(scene, points, normals, count, length):
    random = np.random.default_rng(7)
    directions = hemisphere(normals, count, random)
    rays = np.empty((len(points), count, 8), np.float32)  # org, tnear, dir, tfar
    rays[..., 0:3] = points[:, None, :] + 1e-3 * normals[:, None, :]
    rays[..., 3] = 0
    rays[..., 4:7] = directions
    rays[..., 7] = length / np.linalg.norm(directions, axis=-1)  # t is in units of dir
    return scene.occluded(rays).mean(axis=1)


def main():
    points, triangles, normals = bowl(24, 48)
    scene = morphray.Scene(points, triangles)
    occlusion = vertex_occlusion(scene, points, normals, count=64, length=10.0)
    by_ring = occlusion.reshape(24, 48).mean(axis=1)
    print("occlusion from the rim to the bottom:", np.round(by_ring[::4], 2))
    # Half of the sphere is missing; of a sphere each part sends the same share of its cosine
    # weighted rays to any other part, so that the exact value is 1/2 everywhere.
    assert abs(occlusion.mean() - 0.5) < 0.02

    # Pressed flat, nothing is in the way any more.
    points[:, 1] = 0
    scene.update()
    up = np.zeros_like(normals)
    up[:, 1] = 1
    assert vertex_occlusion(scene, points, up, count=16, length=10.0).max() == 0


if __name__ == "__main__":
    main()
