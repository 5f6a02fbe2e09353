"""Arguments that do not fit are refused with a reason."""

import pickle

import numpy as np
import pytest

import morphray
from scenes import DOWN, assert_same_bits, triangle

POINTS, TRIANGLES = triangle()
IMAGE = np.zeros((2, 2, 3), np.uint8)
TEXCOORDS = np.zeros((1, 3, 2), np.float32)

BAD_POINTS = [
    ("points", TypeError, "points: a numpy.ndarray is needed, not str"),
    (None, TypeError, "not NoneType"),
    (POINTS.astype(np.float16), TypeError, "points: dtype float32 or float64 .* not <f2"),
    (POINTS.astype(">f4"), TypeError, "native byte order is needed, not >f4"),
    (POINTS.astype(np.int32), TypeError, "not <i4"),
    (POINTS.ravel(), ValueError, r"points: a shape of \(V, 3\) is needed, not \(9,\)"),
    (POINTS[:, :2], ValueError, "a shape of"),
    (np.zeros((3, 4), np.float32), ValueError, r"a slice \[:, :3\] is read in place"),
    (np.float32(1), ValueError, r"a shape of \(V, 3\) is needed, not \(\)"),
    (np.ma.masked_equal(POINTS, 1), ValueError, "points: elements of the array are masked"),
    (np.asfortranarray(np.zeros((4, 3), np.float32)), ValueError, "next to each other"),
    (POINTS[::-1], ValueError, "points must follow each other"),
    (np.lib.stride_tricks.as_strided(np.zeros(12, np.float32), (4, 3), (8, 4)), ValueError,
     "12 bytes apart"),
]


@pytest.mark.parametrize("points, error, reason", BAD_POINTS)
def test_bad_points(points, error, reason):
    with pytest.raises(error, match=reason):
        morphray.Scene(points, TRIANGLES)
    scene = morphray.Scene(POINTS, TRIANGLES)
    with pytest.raises(error, match=reason):
        scene.attach(points, TRIANGLES)
    with pytest.raises(error, match="mesh 1: "):
        morphray.Scene([(POINTS, TRIANGLES), (points, TRIANGLES)])


@pytest.mark.parametrize("triangles, error, reason", [
    ("012", TypeError, "triangles: a numpy.ndarray is needed, not str"),
    (TRIANGLES.astype(np.float32), TypeError, "integers are needed, not <f4"),
    (TRIANGLES.astype(bool), TypeError, "integers are needed, not |b1"),
    (TRIANGLES.ravel(), ValueError, r"a shape of \(T, 3\) is needed, not \(3,\)"),
    (np.array([[0, 1, 3]], np.uint32), morphray.Error, "triangle 0 has vertex 3"),
    (np.array([[0, 1, 2], [0, -1, 2]], np.int8), morphray.Error, "triangle 1 has vertex -1"),
    (np.array([[0, 1, 2**32]]), morphray.Error, "triangle 0 has vertex 4294967296"),
    (np.ma.masked_equal(TRIANGLES, 2), ValueError, "triangles: elements of the array are masked"),
])
def test_bad_triangles(triangles, error, reason):
    with pytest.raises(error, match=reason) as caught:
        morphray.Scene(POINTS, triangles)
    if error is morphray.Error:
        assert caught.value.code == "bad_input"


@pytest.mark.parametrize("rays, error, reason", [
    ({}, TypeError, "rays: a numpy.ndarray is needed, not dict"),
    (DOWN.astype(complex), TypeError, "rays: dtype float32"),
    (DOWN[0, :5], ValueError, r"a shape of \(N, 6\) or \(N, 8\) is needed, not \(5,\)"),
    (np.zeros((4, 7), np.float32), ValueError, r"\(4, 7\)"),
    (np.zeros(3, [("org", "f4", 3), ("dir", "f4", 3)]), TypeError, "rays: dtype"),
])
def test_bad_rays(rays, error, reason):
    scene = morphray.Scene(POINTS, TRIANGLES)
    for call in [scene.intersect, scene.occluded, scene.intersect_all, scene.count]:
        with pytest.raises(error, match=reason):
            call(rays)
    with pytest.raises(error, match=reason):
        morphray.compare(scene, scene, rays)


@pytest.mark.parametrize("points, error, reason", [
    (7, TypeError, "points: a numpy.ndarray is needed, not int"),
    (POINTS.astype(bool), TypeError, "points: dtype float32 .* not |b1"),
    (POINTS[0, :2], ValueError, r"points: a shape of \(N, 3\) is needed, not \(2,\)"),
    (np.zeros((4, 2), np.float32), ValueError, r"\(4, 2\)"),
])
def test_bad_query_points(points, error, reason):
    scene = morphray.Scene(POINTS, TRIANGLES)
    for call in [scene.winding, scene.contains, scene.closest_points, scene.signed_distance]:
        with pytest.raises(error, match=reason):
            call(points)


@pytest.mark.parametrize("ask, error, reason", [
    (lambda s: s.count(DOWN, crossing="all"), ValueError, '"all" is none of "once", "each", "owner"'),
    (lambda s: s.intersect(DOWN, coherence="any"), ValueError, '"any" is none of "none" and'),
    (lambda s: s.count(DOWN, coherence=-1), TypeError,
     '^coherence: "none", "sort" or the width of an image is needed, not -1$'),
    (lambda s: s.occluded(DOWN, coherence=None), TypeError, "^coherence: .* not None$"),
    (lambda s: s.intersect(DOWN, threads=2), ValueError,
     '^threads: "2" is none of "all", "calling"$'),
    (lambda s: s.normals(s.intersect(DOWN), smooth="yes"), TypeError, "^smooth: True or False is"),
    (lambda s: s.count(DOWN, excluded=[[0, 1, 2]]), ValueError, "excluded: a shape of the rays"),
    (lambda s: s.occluded(DOWN, visible=[0, 1]), TypeError, "visible: dtype bool"),
    (lambda s: s.occluded(DOWN, visible=[]), morphray.Error, "visible: 0 flags, but 1 geom_ids"),
    (lambda s: s.intersect(DOWN[[0, 0]], excluded=[[0, 0], [7, -1]]), morphray.Error,
     "excluded: number 1 has the geom_id 7, which no mesh has"),
    (lambda s: s.intersect_all(DOWN, excluded=[[0, 9]]), morphray.Error,
     "excluded: number 0 has the prim_id 9 of mesh 0, which has"),
    (lambda s: s.closest_points(POINTS, excluded=[[-1, -1], [0, 0], [2**31, 0]]), morphray.Error,
     "excluded: number 2 has the geom_id 2147483648"),
    (lambda s: s.winding(POINTS, excluded=[[0, 1, 2]]), ValueError,
     "excluded: a shape of the points, and 2 is needed"),
    (lambda s: s.crossings([7]), morphray.Error, "7"),
    (lambda s: s.normals(DOWN), TypeError, "hits: dtype morphray.hit_dtype or"),
    (lambda s: s.intersect_all(DOWN, max_hits=-1), TypeError,
     r"^max_hits: a count below 2\^32 is needed, not -1$"),
    (lambda s: s.intersect_all(DOWN, max_hits=2**32), TypeError, "max_hits"),
    (lambda s: s.contains(POINTS, rule="even"), ValueError, '"even" is none of "nonzero", "odd"'),
    (lambda s: s.closest_points(POINTS, -0.5), morphray.Error, "max_distance"),
    (lambda s: s.closest_points(POINTS, "far"), TypeError,
     "^max_distance: a number, or None, is needed, not 'far'$"),
    (lambda s: s.count(DOWN, np.empty(1, np.uint64)), TypeError, "out: dtype int64"),
    (lambda s: s.winding(POINTS, np.empty(3, np.int64)), TypeError, "out: dtype int32"),
    (lambda s: s.winding(POINTS, np.empty(4, np.int32)), ValueError,
     r"\(3,\) is needed, as the points have, not \(4,\)"),
    (lambda s: s.count(DOWN, np.empty(12, np.uint8)[4:].view(np.int64)), ValueError,
     "aligned to 8 bytes"),
    (lambda s: s.closest_points(POINTS, out=np.empty(3, morphray.hit_dtype)), TypeError,
     "out: dtype"),
    (lambda s: s.signed_distance(POINTS, POINTS.ravel()[:3]), ValueError,
     "shares memory with the points"),
])
def test_bad_queries(ask, error, reason):
    with pytest.raises(error, match=reason) as caught:
        ask(morphray.Scene(POINTS, TRIANGLES))
    if error is morphray.Error:
        assert caught.value.code == "bad_argument"


def test_bad_out():
    scene = morphray.Scene(POINTS, TRIANGLES)
    rays = np.zeros((4, 8), np.float32)
    read_only = np.empty(4, morphray.hit_dtype)
    read_only.flags.writeable = False
    unaligned = np.empty(81, np.uint8)[1:].view(morphray.hit_dtype)
    shared = np.zeros((6, 8), np.float32)
    for out, error, reason in [
        ([], TypeError, "out: a numpy.ndarray is needed"),
        (np.empty(4, np.float32), TypeError, "out: dtype"),
        (np.empty(4, bool), TypeError, "out: dtype"),
        (np.empty(5, morphray.hit_dtype), ValueError, r"\(4,\) is needed.* not \(5,\)"),
        (np.empty((4, 1), morphray.hit_dtype), ValueError, "as the rays have"),
        (np.empty(8, morphray.hit_dtype)[::2], ValueError, "C-contiguous"),
        (unaligned, ValueError, "aligned to 4 bytes"),
        (read_only, ValueError, "read-only"),
    ]:
        with pytest.raises(error, match=reason):
            scene.intersect(rays, out)
    with pytest.raises(ValueError, match="shares memory"):
        scene.intersect(shared[:4], shared.ravel()[20:40].view(morphray.hit_dtype))
    with pytest.raises(TypeError, match="out: dtype bool"):
        scene.occluded(rays, np.empty(4, np.uint8))


@pytest.mark.parametrize("options, error, reason", [
    ({"device": "gpu"}, ValueError, '"gpu" is none of "cpu", "vulkan" and "brute"'),
    ({"device": 3}, ValueError, '^device: "3" is none of'),
    ({"bounds": 3}, TypeError, "^bounds: two points, or None, is needed, not 3$"),
    ({"bounds": ((0, 0, 0), (1, 1))}, TypeError, "bounds"),
    ({"bounds": ((0, 0, 0), (1, None, 1))}, TypeError, "bounds"),
    ({"update": "sometimes"}, ValueError, "update: "),
    ({"update": "every:0"}, ValueError, "with K from 1"),
    ({"update": "refit", "budget_ms": 2}, ValueError, "takes no budget_ms"),
    ({"update": "auto", "budget_ms": -1}, morphray.Error, "budget_ms is -1; .* not negative"),
    ({"albedo": [1]}, TypeError, "albedo: "),
    ({"albedo": np.zeros((1, 3), np.float32)}, TypeError, "albedo: dtype"),
    ({"albedo": np.zeros((1, 3), np.uint32)}, ValueError, r"albedo: a shape of \(T,\)"),
    ({"textures": 1}, TypeError, "textures: a morphray.Textures"),
    ({"textures": (IMAGE,)}, TypeError, "'texcoords'"),
    ({"textures": (1, TEXCOORDS)}, TypeError, "textures: image: a numpy.ndarray"),
    ({"textures": ([], TEXCOORDS)}, ValueError, "no images"),
    ({"textures": ([IMAGE, IMAGE[0]], TEXCOORDS)}, ValueError, r"image 1: .* \(H, W, 3\)"),
    ({"textures": (IMAGE, TEXCOORDS[0])}, ValueError, r"texcoords: a shape of \(T, 3, 2\)"),
    ({"textures": (IMAGE, None)}, TypeError, "texcoords: a numpy.ndarray"),
    ({"textures": (IMAGE, TEXCOORDS, "0")}, TypeError, "ids: a numpy.ndarray"),
    ({"textures": (IMAGE, TEXCOORDS, np.array([[0]]))}, ValueError, r"ids: .* \(T,\)"),
    ({"textures": (IMAGE, TEXCOORDS, np.array([-2]))}, morphray.Error, "ids: triangle 0 has image -2"),
    ({"textures": (IMAGE, TEXCOORDS, None, "mirror")}, ValueError, "wrap: "),
    ({"textures": (IMAGE, TEXCOORDS, None, "clamp", "half")}, TypeError, "alpha_cutoff: a number"),
    ({"textures": (IMAGE, TEXCOORDS, None, "clamp", [1, 1])}, ValueError, "2 for 1 images"),
    ({"colour": 1}, TypeError, ""),
])
def test_bad_options(options, error, reason):
    with pytest.raises(error, match=reason):
        morphray.Scene(POINTS, TRIANGLES, **options)


def test_bad_ranges():
    scene = morphray.Scene(POINTS, TRIANGLES)
    for arguments in [(-1,), (0.5,), (0, -1), (None, 1), (None, 0, 1)]:
        with pytest.raises(TypeError):
            scene.update(*arguments)
    with pytest.raises(morphray.Error):
        scene.update(1)
    with pytest.raises(TypeError, match=r"^update: a geom_id, a whole number, first is needed, not array"):
        scene.update(POINTS)


BAD_VIEWS = {
    TypeError: [{"size": 3}, {"size": (3, -1)}, {"size": (3.5, 1)}, {"eye": (1, 2)}, {"eye": 1},
                {"ao_distance": "far"}],
    ValueError: [{"rays": "many"}],
    morphray.Error: [{"size": (0, 1)}, {"fov": 180}, {"ao_count": 0, "rays": "ao"}],
}


@pytest.mark.parametrize("error", BAD_VIEWS)
def test_bad_views(error):
    scene = morphray.Scene(POINTS, TRIANGLES)
    for options in BAD_VIEWS[error]:
        with pytest.raises(error):
            scene.render(**{"size": (4, 4), **options})


def test_bad_devices():
    for call, code in [
        (lambda: morphray.Device.cpu(threads=-1), "bad_argument"),
        (lambda: morphray.Device.cpu(simd="mmx"), "bad_argument"),
        (lambda: morphray.Device.vulkan("no such device"), "unavailable"),
    ]:
        with pytest.raises(morphray.Error) as caught:
            call()
        assert caught.value.code == code
    with pytest.raises(TypeError):
        morphray.Device()


def test_bad_comparisons():
    scene = morphray.Scene(POINTS, TRIANGLES)
    image = scene.render((4, 4))
    with pytest.raises(TypeError, match="need rays"):
        morphray.compare(scene, scene)
    with pytest.raises(TypeError, match="take no rays"):
        morphray.compare(image, image, DOWN)
    with pytest.raises(TypeError, match="two scenes or two images"):
        morphray.compare(scene, image)
    with pytest.raises(morphray.Error):
        morphray.compare(image, scene.render((4, 5)))


def test_arrays_meshes_and_errors_are_pickled():
    scene = morphray.Scene(POINTS, TRIANGLES)
    image = scene.render((4, 4), rays="shadow")
    for array in [scene.intersect(DOWN), *scene.intersect_all(DOWN), image.pixels, image.hits, image.occlusion]:
        assert_same_bits(pickle.loads(pickle.dumps(array)), array)
    assert pickle.loads(pickle.dumps(morphray.ray_dtype)) == morphray.ray_dtype
    all_hits = pickle.loads(pickle.dumps(scene.intersect_all(DOWN)))
    assert isinstance(all_hits, morphray.AllHits) and len(all_hits.of_ray(0)) == 1
    mesh = pickle.loads(pickle.dumps(morphray.Mesh(POINTS, TRIANGLES)))
    assert isinstance(mesh, morphray.Mesh)
    assert_same_bits(morphray.Scene([mesh]).intersect(DOWN), scene.intersect(DOWN))
    with pytest.raises(morphray.Error) as caught:
        morphray.Device.cpu(threads=-1)
    error = pickle.loads(pickle.dumps(caught.value))
    assert (type(error), str(error), error.code) == (
        morphray.Error, str(caught.value), "bad_argument")
