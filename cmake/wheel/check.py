"""check.py [vulkan]: with the installed package morphray, on a machine that has no other part of it:

- libraries of the wheel are loaded from the wheel, and none of them from elsewhere
- images have the bits that they have on every machine
- a Vulkan device gives the same ones; without "vulkan", there is no libvulkan, and one line says so
"""

import pathlib
import re
import sys
import tempfile

import numpy as np

import morphray

# Hashes of hits and pixels. A change that is meant to change images (CONTRIBUTING.md) changes the second
# one: this script prints what it finds.
EXPECTED = "90ebc0fb6f8eae9e 0d27284f7a70c90f"


def sheet(size):
    """Coordinates that every numpy computes without rounding."""
    x, y = np.meshgrid(np.arange(size + 1), np.arange(size + 1))
    points = np.stack([x / 16, y / 16, (x * x + 3 * y) % 16 / 64], axis=-1)
    corner = (np.arange(size)[:, None] * (size + 1) + np.arange(size)).ravel()
    triangles = np.stack([corner, corner + 1, corner + size + 1, corner + 1, corner + size + 2,
                          corner + size + 1], axis=-1)
    return points.reshape(-1, 3).astype(np.float32), triangles.reshape(-1, 3).astype(np.uint32)


def hashes(device):
    points, triangles = sheet(24)
    scene = morphray.Scene(points, triangles, device=device, bounds=((0, 0, -1), (2, 2, 1)))
    points[:, 2] *= -2
    scene.update()
    image = scene.render((80, 60), eye=(2.5, -1, 2), up=(0, 0, 1), shading="lit", samples=4)
    with tempfile.TemporaryDirectory() as folder:
        image.save(f"{folder}/image.png")
    occlusion = scene.render((80, 60), eye=(2.5, -1, 2), up=(0, 0, 1), rays="ao")
    return f"{occlusion.hits_hash:016x} {image.image_hash:016x}"


def check_libraries():
    package = pathlib.Path(morphray.__file__).parent.resolve()
    own = {path.name for path in package.glob("mr-*")}
    mapped = {pathlib.Path(line.split()[-1]) for line in open("/proc/self/maps") if ".so" in line}
    others = {path for path in mapped if path.parent.resolve() != package}
    missing = own - {path.name for path in mapped - others}
    assert own and not missing, f"of {own}, these are not loaded: {missing}"
    for path in others:
        kind = re.sub(r"^lib(\w+).*", r"mr-\1.", path.name)
        assert not any(name.startswith(kind) for name in own), f"{path} is loaded, too"
    print(f"loaded from the wheel, and no others of their kinds: {', '.join(sorted(own))}")


def check_missing_vulkan():
    try:
        morphray.Device.vulkan()
    except morphray.Error as error:
        assert error.code == "unavailable" and "\n" not in str(error), error
        print(error)
    else:
        raise AssertionError("there is a Vulkan device")


def main():
    found = {"cpu": hashes("cpu"), "brute": hashes("brute")}
    print(f"{sys.version.split()[0]} {morphray.Device.cpu().description}: {found['cpu']}")
    if "vulkan" in sys.argv:
        device = morphray.Device.vulkan()
        found["vulkan"] = hashes(device)
        print(f"{device.description}: {found['vulkan']}")
    else:
        check_missing_vulkan()
    check_libraries()
    for device, values in found.items():
        assert values == EXPECTED, f"{device} has {values}, not {EXPECTED}"


if __name__ == "__main__":
    main()
