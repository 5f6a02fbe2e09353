"""A cloth that folds onto itself: prints the first frame in which it passes through itself, and draws it.

    python3 folding.py [--frames N] [--rows N] [--device cpu|vulkan|brute] [--threads N] [--out FILE.png]
"""

import numpy as np

import morphray
from lidar import grid, parse_with_device


COLUMNS = 60


def fold(amount, rows):
    """A strip that runs in a wave along its length, of angles up to `amount`; it turns back above pi / 2."""
    along = (np.arange(rows) + 0.5) / rows
    angle = amount * np.sin(6 * np.pi * along)
    place = np.cumsum([np.cos(angle), np.sin(angle)], axis=1) / rows
    across = np.linspace(-0.25, 0.25, COLUMNS)
    points = np.empty((rows, COLUMNS, 3), np.float32)
    points[..., 0], points[..., 1] = place[0, :, None], place[1, :, None]
    points[..., 2] = across * (1 + 0.1 * np.sin(9 * along))[:, None]
    return points.reshape(-1, 3)


def run(frames=60, rows=600, device="cpu", out=None):
    scene = morphray.Scene(fold(0, rows), grid(COLUMNS, rows), device=device)
    for frame in range(frames):
        scene.update(0, fold(2.6 * frame / max(frames - 1, 1), rows))
        if not scene.has_crossings():
            continue
        pairs = scene.crossings().pairs
        if out:
            # Triangles that cross are red.
            colours = np.full((scene.triangle_count, 3), (200, 190, 170), np.uint8)
            colours[pairs[:, :, 1].ravel()] = (220, 30, 20)
            shown = morphray.Scene(fold(2.6 * frame / max(frames - 1, 1), rows), grid(COLUMNS, rows), albedo=colours)
            shown.render((960, 480), eye=(0.45, 0.3, 0.7), target=(0.09, 0.04, 0), fov=30, shading="lit",
                         samples=16).save(out)
        return frame, len(pairs)
    return None, 0


if __name__ == "__main__":
    device, options = parse_with_device(__doc__, frames=60, rows=600, out="")
    frame, count = run(options.frames, options.rows, device, options.out)
    print("it never crosses" if frame is None else f"frame {frame}: {count} pairs of triangles cross")
