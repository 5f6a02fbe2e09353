"""Depth cameras over bodies and a cloth, step after step: prints a digest of all their pixels and the time.

    python3 depth_cameras.py [--steps N] [--cameras N] [--size N] [--device cpu|vulkan|brute] [--threads N]

Meshes and motion are those of lidar.py. The digest does not depend on the device or the number of threads.
"""

import hashlib
import time

import numpy as np

import morphray
from lidar import make_scene, move, parse_with_device


def camera_ring(count):
    """Cameras around the middle that look down at it, with the axes of OpenCV."""
    angle, one = 2 * np.pi * np.arange(count) / count, np.ones(count)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([[-s, c, 0 * one], [0.6 * c, 0.6 * s, -0.8 * one],
                     [-0.8 * c, -0.8 * s, -0.6 * one], [2 * c, 2 * s, 1.5 * one]]).transpose(2, 1, 0)


def run(steps=200, cameras=256, size=64, device="cpu", bodies=50):
    scene, sheet = make_scene(device, bodies)
    matrices = camera_ring(cameras)
    lens = (size, size, size / 2, size / 2)
    images = {"depth": np.empty((cameras, size, size), np.float32),
              "geom_id": np.empty((cameras, size, size), np.uint32)}
    digest = hashlib.blake2b(digest_size=16)
    milliseconds = 0.0
    for step in range(steps):
        begin = time.perf_counter()
        move(scene, sheet, 0.05 * step, bodies)
        scene.render_views(camera_to_world=matrices, intrinsics=lens, size=(size, size),
                           channels=images, out=images)
        milliseconds += 1000 * (time.perf_counter() - begin)
        for channel in images.values():
            digest.update(channel)
    return digest.hexdigest(), milliseconds / max(steps, 1)


if __name__ == "__main__":
    device, options = parse_with_device(__doc__, steps=200, cameras=256, size=64)
    digest, milliseconds = run(options.steps, options.cameras, options.size, device)
    print(f"{digest}  {milliseconds:.1f} ms a step")
