"""The same hits on CPU and Vulkan, bit by bit, while a torus twists.

    python3 library/python/examples/compare_devices.py
"""

import numpy as np

import morphray


def torus(major, minor):
    a, b = np.meshgrid(np.arange(major), np.arange(minor), indexing="ij")
    u, v = 2 * np.pi * a / major, 2 * np.pi * b / minor
    radius = 1 + 0.4 * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), 0.4 * np.sin(v)], axis=-1)
    next_a, next_b = (a + 1) % major, (b + 1) % minor
    here, right = a * minor + b, next_a * minor + b
    above, across = a * minor + next_b, next_a * minor + next_b
    triangles = np.stack([here, right, across, here, across, above], axis=-1).reshape(-1, 3)
    return points.reshape(-1, 3).astype(np.float32), triangles.astype(np.uint32)


def twisted(points, angle):
    around = angle * points[:, 0]
    y, z = points[:, 1].copy(), points[:, 2].copy()
    points[:, 1] = np.cos(around) * y - np.sin(around) * z
    points[:, 2] = np.sin(around) * y + np.cos(around) * z


def main():
    points, triangles = torus(80, 30)
    try:
        device = morphray.Device.vulkan()
    except morphray.Error as error:
        print(f"no Vulkan ({error}); brute force instead")
        device = morphray.Device.brute_force()
    # The bounds fix the bits: both scenes see the same scene space, whatever their first poses.
    bounds = ((-2, -2, -2), (2, 2, 2))
    scene = morphray.Scene(points, triangles, bounds=bounds)
    other = morphray.Scene(points, triangles, bounds=bounds, device=device, update="rebuild")
    print(f"{scene.device.description} against {other.device.description}")

    random = np.random.default_rng(1)
    rays = np.zeros((20_000, 6), np.float32)
    rays[:, 0:3] = random.normal(size=(len(rays), 3)) * 3
    rays[:, 3:6] = random.normal(size=(len(rays), 3)) * 0.5 - rays[:, 0:3]
    for frame in range(5):
        twisted(points, 0.2)
        scene.update()
        other.update()
        difference = morphray.compare(scene, other, rays)
        print(f"frame {frame}: {difference}")
        assert not difference


if __name__ == "__main__":
    main()
