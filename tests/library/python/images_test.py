"""Images and comparisons."""

import struct

import numpy as np
import pytest

import morphray
from scenes import grid, random_rays, triangle

VIEW = {"size": (8, 8), "eye": (0.3, 0.3, 1), "target": (0.3, 0.3, 0), "fov": 10}
TEXCOORDS = np.zeros((1, 3, 2), np.float32)


def lit(points, triangles, **appearance):
    return morphray.Scene(points, triangles, **appearance).render(**VIEW, shading="lit").image_hash


def test_arrays_of_an_image():
    points, triangles = grid(10)
    image = morphray.Scene(points, triangles).render((40, 30), rays="shadow")
    assert (image.width, image.height) == (40, 30)
    assert image.pixels.shape == (30, 40, 4) and image.pixels.dtype == np.uint8
    assert image.hits.shape == (30, 40) and image.hits.dtype == morphray.hit_dtype
    assert image.occlusion.shape == (30, 40) and image.occlusion.dtype == np.uint32
    assert (image.pixels[..., 3] == 255).all()
    for array in [image.pixels, image.hits, image.occlusion]:
        assert not array.flags.writeable
    assert image.pixels.ctypes.data == image.pixels.ctypes.data


def test_shading_and_samples():
    points, triangles = grid(10)
    scene = morphray.Scene(points, triangles)
    hashes = set()
    for shading in ["plain", "lit", "normal", "depth", "prim"]:
        image = scene.render((20, 10), shading=shading, samples=4, ao_count=2)
        assert image.samples == 4
        assert image.pixels.shape == (10, 20, 4)
        assert image.hits.shape == (20, 40) and image.occlusion.shape == (20, 40)
        hashes.add(image.image_hash)
    assert len(hashes) == 5
    smooth = scene.render((20, 10), shading="normal")
    flat = scene.render((20, 10), shading="normal", flat=True)
    assert smooth.hits_hash == flat.hits_hash and smooth.image_hash != flat.image_hash
    with pytest.raises(ValueError, match="shading"):
        scene.render((4, 4), shading="shiny")
    with pytest.raises(morphray.Error, match="samples"):
        scene.render((4, 4), samples=3)


def test_albedo_colours_triangles():
    for albedo in [np.array([[255, 0, 0]], np.uint8), np.array([0x0000FF], np.uint32)]:
        pixels = morphray.Scene(*triangle(), albedo=albedo).render(**VIEW).pixels
        assert (pixels[..., 0] > 100).all() and not pixels[..., 1:3].any()


def test_numpy_takes_an_image_for_its_pixels():
    image = morphray.Scene(*triangle()).render((8, 4))
    assert np.shares_memory(np.asarray(image), image.pixels)
    assert np.asarray(image, np.float64).shape == np.array(image).shape == (4, 8, 4)


def test_textures_colour_triangles():
    points, triangles = triangle()
    red = np.zeros((2, 3, 3), np.uint8)
    red[..., 0] = 255
    green = np.array([[[0, 255, 0, 99]]], np.uint8)
    expected = lit(points, triangles, albedo=np.array([[255, 0, 0]], np.uint8))
    for textures in [
        (red, TEXCOORDS),
        morphray.Textures([green, red], TEXCOORDS, ids=np.array([1])),
        morphray.Textures(red, TEXCOORDS[..., ::-1], wrap="clamp"),
    ]:
        assert lit(points, triangles, textures=textures) == expected
        scene = morphray.Scene([morphray.Mesh(points, triangles, textures=textures)])
        assert scene.render(**VIEW, shading="lit").image_hash == expected
    none = morphray.Textures(red, TEXCOORDS, ids=np.array([-1]))
    assert lit(points, triangles, textures=none) == lit(points, triangles)


def test_alpha_cutoff_makes_holes():
    points, triangles = triangle()
    half = np.full((1, 1, 4), 128, np.uint8)

    def textured(*textures):
        return lit(points, triangles, textures=morphray.Textures(*textures))

    hole = lit(points[:0], triangles[:0], bounds=((0, 0, 0), (1, 1, 0)))
    solid = textured(half, TEXCOORDS)
    assert hole != solid
    assert textured(half, TEXCOORDS, None, "repeat", 0.5) == solid
    assert textured(half, TEXCOORDS, None, "clamp", np.float32(1)) == hole
    assert textured(half[..., :3].copy(), TEXCOORDS, None, "repeat", 1) == solid
    for shown, image in [(0, hole), (1, solid)]:
        assert textured([half, half], TEXCOORDS, np.array([shown]), "repeat", [0.75, 0.25]) == image


def test_images_are_saved(tmp_path):
    image = morphray.Scene(*grid(4)).render((40, 30))
    for path in [tmp_path / "a.png", str(tmp_path / "b.png")]:
        image.save(path)
    data = (tmp_path / "a.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">II", data[16:24]) == (40, 30)
    with pytest.raises(morphray.Error) as caught:
        image.save(tmp_path / "no such folder" / "a.png")
    with pytest.raises(ValueError, match="does not end in .png"):
        image.save(tmp_path / "a.jpg")
    assert caught.value.code == "output"


def test_comparisons_are_true_if_anything_differs():
    points, triangles = grid(10)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, 500)
    same = morphray.compare(scene, scene, rays)
    assert not same and same.equal and same.compared == 500 and str(same) == "500 equal"
    other = morphray.Scene(points * np.float32(0.5), triangles)
    different = morphray.compare(scene, other, rays, keep=3)
    assert different and not different.equal and len(different.differences) == 3
    for first in different.differences:
        assert first["first"] == scene.intersect(rays)[first["index"]]
        assert first["second"] == other.intersect(rays)[first["index"]]
    assert f"{different.different} of 500 differ" in str(different)
