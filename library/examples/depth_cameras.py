"""Depth cameras over bodies and a cloth, step after step: prints a digest of all their pixels and the time.

    python3 depth_cameras.py [--steps N] [--cameras N] [--size N] [--device cpu|vulkan|brute] [--threads N]

The digest does not depend on the device or the number of threads.
"""

import argparse
import hashlib
import math
import time

import numpy as np

import morphray


def grid(across, down):
    """The triangles of a grid of points, `across` in a row."""
    corner = (np.arange(down - 1)[:, None] * across + np.arange(across - 1)).ravel()
    return np.stack([corner, corner + across, corner + 1,
                     corner + 1, corner + across, corner + across + 1], axis=-1).reshape(-1, 3)


def ball():
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 9), np.linspace(0, 2 * np.pi, 15), indexing="ij")
    points = 0.12 * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi),
                              np.cos(theta)], axis=-1).reshape(-1, 3)
    return points.astype(np.float32), grid(15, 9)


def cloth():
    x, y = np.meshgrid(np.linspace(-2, 2, 67), np.linspace(2, -2, 67))
    return np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32), grid(67, 67)


def move(points, rest, step, body):
    """Turns a body around z and lets it circle, in float32."""
    turn, way = 0.05 * step + body, 0.02 * step + 0.4 * body
    c, s = np.float32(math.cos(turn)), np.float32(math.sin(turn))
    reach = 0.4 + 0.03 * body
    points[:, 0] = c * rest[:, 0] - s * rest[:, 1] + np.float32(reach * math.cos(way))
    points[:, 1] = s * rest[:, 0] + c * rest[:, 1] + np.float32(reach * math.sin(way))
    points[:, 2] = rest[:, 2] + np.float32(0.5 + 0.2 * math.sin(3 * way))


def camera_ring(count):
    """Cameras around the middle that look down at it, with the axes of OpenCV."""
    angle, one = 2 * np.pi * np.arange(count) / count, np.ones(count)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([[-s, c, 0 * one], [0.6 * c, 0.6 * s, -0.8 * one],
                     [-0.8 * c, -0.8 * s, -0.6 * one], [2 * c, 2 * s, 1.5 * one]]).transpose(2, 1, 0)


def run(steps=200, cameras=256, size=64, device="cpu", bodies=50):
    rest, triangles = ball()
    sheet, sheet_triangles = cloth()
    meshes = [(rest.copy(), triangles) for _ in range(bodies)]
    for body, (points, _) in enumerate(meshes):
        move(points, rest, 0, body)
    scene = morphray.Scene([(sheet, sheet_triangles)] + meshes, device=device,
                           bounds=((-2.5, -2.5, -1), (2.5, 2.5, 1)))
    matrices = camera_ring(cameras)
    lens = (size, size, size / 2, size / 2)
    images = {"depth": np.empty((cameras, size, size), np.float32),
              "geom_id": np.empty((cameras, size, size), np.uint32)}
    digest = hashlib.blake2b(digest_size=16)
    milliseconds = 0.0
    for step in range(steps):
        begin = time.perf_counter()
        for body, (points, _) in enumerate(meshes):
            move(points, rest, step, body)
        sheet[:, 2] = np.float32(0.1) * np.sin(4 * sheet[:, 0] + np.float32(0.1 * step))
        scene.update()
        scene.render_views(camera_to_world=matrices, intrinsics=lens, size=(size, size),
                           channels=images, out=images)
        milliseconds += 1000 * (time.perf_counter() - begin)
        for channel in images.values():
            digest.update(channel)
    return digest.hexdigest(), milliseconds / max(steps, 1)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--cameras", type=int, default=256)
    parser.add_argument("--size", type=int, default=64, help="of an image, in pixels a side")
    parser.add_argument("--device", choices=["cpu", "vulkan", "brute"], default="cpu")
    parser.add_argument("--threads", type=int, default=0, help="of the CPU; 0: all")
    options = parser.parse_args()
    device = morphray.Device.cpu(options.threads) if options.device == "cpu" else options.device
    digest, milliseconds = run(options.steps, options.cameras, options.size, device)
    print(f"{digest}  {milliseconds:.1f} ms a step")
