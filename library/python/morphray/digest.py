"""`python -m morphray.digest` prints the digest of each device: of the CPU with each instruction set and
without any ("off"), and of each Vulkan device. It ends with 1 if one is not morphray.DIGEST, or
cannot be used."""

import sys

from . import DIGEST, Device, Error, simd_targets, vulkan_devices


def main():
    """Returns the exit code."""
    devices = [Device.cpu(simd=simd) for simd in [*simd_targets(), "off"]]
    usable = []
    try:
        usable = [str(device.index) for device in vulkan_devices() if not device.unusable]
    except Error as error:
        print(error, file=sys.stderr)
    devices += [Device.vulkan(index) for index in usable]
    digests = [device.digest() for device in devices]
    for device, digest in zip(devices, digests):
        print(f"{digest:016x}  {device.name}: {device.description}")
    equal = set(digests) == {DIGEST}
    print("\nequal: all digests are the documented one" if equal else f"\ndifferent from {DIGEST:016x}")
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
