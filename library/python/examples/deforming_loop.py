"""A wave runs through a sheet. The solver writes into the array that the scene reads.

    python3 library/python/examples/deforming_loop.py [IMAGE.png]
"""

import sys

import numpy as np

import morphray


def sheet(size):
    """Points (V, 3) and triangles (T, 3) of a square sheet at y = 0."""
    x, z = np.meshgrid(np.linspace(-1, 1, size), np.linspace(-1, 1, size))
    points = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = np.arange(size * (size - 1)).reshape(size - 1, size)[:, :-1].ravel()
    halves = [(corner, corner + size, corner + 1), (corner + 1, corner + size, corner + size + 1)]
    return points, np.concatenate([np.stack(half, axis=-1) for half in halves]).astype(np.uint32)


class Wave:
    """The wave equation on a grid with a fixed edge, by central differences."""

    def __init__(self, size):
        x, z = np.meshgrid(np.linspace(-1, 1, size), np.linspace(-1, 1, size))
        self.height = 0.25 * np.exp(-60 * ((x + 0.3) ** 2 + (z + 0.3) ** 2))
        self.before = self.height.copy()

    def step(self):
        h = self.height
        bend = np.zeros_like(h)
        bend[1:-1, 1:-1] = (
            h[:-2, 1:-1] + h[2:, 1:-1] + h[1:-1, :-2] + h[1:-1, 2:] - 4 * h[1:-1, 1:-1]
        )
        after = 1.995 * h - 0.995 * self.before + 0.4 * bend
        self.before, self.height = h, after


def main():
    size = 120
    points, triangles = sheet(size)
    wave = Wave(size)
    scene = morphray.Scene(points, triangles, bounds=((-1, -1, -1), (1, 1, 1)))

    rays = np.zeros((1000, 6), np.float32)
    rays[:, 0] = np.linspace(-0.9, 0.9, len(rays))
    rays[:, 1] = 2
    rays[:, 4] = -1
    for frame in range(60):
        wave.step()
        points[:, 1] = wave.height.ravel()
        update = scene.update()
        if frame % 15 == 0:
            height = 2 - scene.cast_rays(rays)["t_hit"]
            print(f"frame {frame:2}: {update.step} in {update.milliseconds:.2f} ms, "
                  f"heights from {height.min():.4f} to {height.max():.4f}")

    # Along the middle line a ray finds the height that the solver has there, up to interpolation.
    middle = wave.height[size // 2 - 1 : size // 2 + 1]
    found = 2 - scene.cast_rays(rays)["t_hit"]
    assert np.isfinite(found).all()
    assert found.min() > middle.min() - 1e-5 and found.max() < middle.max() + 1e-5
    if len(sys.argv) > 1:
        image = scene.render((640, 480), eye=(1.5, 1.5, 2), target=(0, 0, 0), light=(2, 4, 1),
                             rays="shadow")
        image.save(sys.argv[1])


if __name__ == "__main__":
    main()
