"""A lidar that turns on one of many moving bodies, over a cloth: prints a digest of its hits and the time.

    python3 lidar.py [--sweeps N] [--updates N] [--columns N] [--device cpu|vulkan|brute] [--threads N]

A sweep takes a second of the simulation. The scene is updated several times meanwhile, and each ray is
traced at the update before its time. The digest does not depend on the device or the number of threads.
"""

import argparse
import hashlib
import time

import numpy as np

import morphray

CARRIER = 1  # geom_id of the body that carries the lidar


def parse_with_device(doc, **defaults):
    """The device and the options of a program that has --device and --threads, too."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    for name, value in defaults.items():
        parser.add_argument("--" + name, type=type(value), default=value)
    parser.add_argument("--device", choices=["cpu", "vulkan", "brute"], default="cpu")
    parser.add_argument("--threads", type=int, default=0, help="of the CPU; 0: all")
    options = parser.parse_args()
    return morphray.Device.cpu(options.threads) if options.device == "cpu" else options.device, options


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


def poses_at(seconds, bodies):
    """[M | t] of each body: it turns around z and circles."""
    body = np.arange(bodies)
    turn, way, reach = 2 * seconds + body, 0.5 * seconds + 0.4 * body, 0.3 + 0.03 * body
    poses = np.zeros((bodies, 3, 4))
    poses[:, 0, 0] = poses[:, 1, 1] = np.cos(turn)
    poses[:, 1, 0] = np.sin(turn)
    poses[:, 0, 1] = -poses[:, 1, 0]
    poses[:, 2, 2] = 1
    poses[:, :, 3] = np.stack([reach * np.cos(way), reach * np.sin(way),
                               0.5 + 0.2 * np.sin(3 * way)], axis=-1)
    return poses


def make_scene(device, bodies):
    """A cloth with bodies above it, and the points of the cloth."""
    x, y = np.meshgrid(np.linspace(-2, 2, 67), np.linspace(2, -2, 67))
    sheet = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    return morphray.Scene([(sheet, grid(67, 67))] + [ball()] * bodies, device=device,
                          bounds=((-2.5, -2.5, -1), (2.5, 2.5, 1))), sheet


def move(scene, sheet, seconds, bodies):
    """Moves cloth and bodies. Returns the poses of the bodies."""
    sheet[:, 2] = np.float32(0.1) * np.sin(4 * sheet[:, 0] + np.float32(2 * seconds))
    scene.update()
    poses = poses_at(seconds, bodies)
    scene.update(poses=poses, geom_ids=np.arange(1, bodies + 1))
    return poses


def beams(columns, rows=16):
    """(columns, rows, 3): directions of a turn, from 20 degrees below to 10 above the horizon."""
    azimuth = (2 * np.pi / columns * np.arange(columns))[:, None]
    elevation = np.radians(np.linspace(-20, 10, rows))
    return np.stack([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation),
                     np.broadcast_to(np.sin(elevation), (columns, rows))], axis=-1)


def run(sweeps=10, updates=20, columns=1800, device="cpu", bodies=50):
    scene, sheet = make_scene(device, bodies)
    directions = beams(columns)
    parts = np.array_split(np.arange(columns), updates)
    hits = np.empty(directions.shape[:2], morphray.hit_dtype)
    digest = hashlib.blake2b(digest_size=16)
    begin = time.perf_counter()
    for sweep in range(sweeps):
        for part in parts:
            if len(part) == 0:
                continue
            seconds = sweep + part[0] / columns
            poses = move(scene, sheet, seconds, bodies)
            rays = np.empty((*directions[part].shape[:2], 6), np.float32)
            rays[..., :3] = poses[CARRIER - 1, :, 3]
            rays[..., 3:] = directions[part]
            carrier = np.full((*rays.shape[:2], 2), [CARRIER, -1])
            scene.intersect(rays, out=hits[part[0]:part[-1] + 1], excluded=carrier)
        digest.update(hits)
    return digest.hexdigest(), 1000 * (time.perf_counter() - begin) / max(sweeps, 1)


if __name__ == "__main__":
    device, options = parse_with_device(__doc__, sweeps=10, updates=20, columns=1800)
    digest, milliseconds = run(options.sweeps, options.updates, options.columns, device)
    print(f"{digest}  {milliseconds:.1f} ms a sweep")
