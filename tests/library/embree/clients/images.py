"""Pixels of PNG and TGA files, without packages."""
import struct
import zlib


def read(path):
    """Returns (channels a pixel, largest value, values row by row)."""
    with open(path, "rb") as file:
        data = file.read()
    return _read_png(data) if data[1:4] == b"PNG" else _read_tga(data)


def compare(first, second):
    """Returns how many pixels differ, how many by more than 1/255, and the largest difference."""
    channels, most, a = read(first)
    other_channels, _, b = read(second)
    if channels != other_channels or len(a) != len(b):
        return len(a), len(a), 1.0
    differing = visible = 0
    largest = 0.0
    for i in range(0, len(a), channels):
        if a[i:i + channels] == b[i:i + channels]:
            continue
        difference = max(abs(p - q) for p, q in zip(a[i:i + channels], b[i:i + channels])) / most
        differing += 1
        visible += difference > 1 / 255
        largest = max(largest, difference)
    return differing, visible, largest


def _read_tga(data):
    skip, _, kind = data[:3]
    if kind != 2:
        raise ValueError("a TGA file that is compressed or has a palette")
    return data[16] // 8, 255, list(data[18 + skip:])


def _read_png(data):
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colours = struct.unpack(">IIBB", chunk[:10])
        elif kind == b"IDAT":
            packed += chunk
        at += 12 + size
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colours]
    step = channels * depth // 8
    raw = zlib.decompress(packed)
    before, values = bytearray(width * step), bytearray()
    for y in range(height):
        start = y * (width * step + 1)
        row = bytearray(raw[start + 1:start + 1 + width * step])
        _unfilter(raw[start], row, before, step)
        values += row
        before = row
    if depth == 16:
        return channels, 65535, list(struct.unpack(f">{len(values) // 2}H", bytes(values)))
    return channels, 255, list(values)


def _unfilter(kind, row, above, step):
    for i in range(len(row) if kind else 0):
        left = row[i - step] if i >= step else 0
        corner = above[i - step] if i >= step else 0
        if kind == 1:
            guess = left
        elif kind == 2:
            guess = above[i]
        elif kind == 3:
            guess = (left + above[i]) // 2
        else:
            p = left + above[i] - corner
            guess = min((abs(p - left), 0, left), (abs(p - above[i]), 1, above[i]),
                        (abs(p - corner), 2, corner))[2]
        row[i] = (row[i] + guess) & 255
