"""morphray.trimesh answers as trimesh does, for any mesh with vertices and faces."""

import numpy as np
import pytest

import morphray
import morphray.trimesh
from scenes import cube, grid, sphere


class Mesh:
    """Not trimesh's: the arrays are all that it has."""

    def __init__(self, vertices, faces):
        self.vertices = np.asarray(vertices, np.float64)
        self.faces = faces


class CachedMesh(Mesh):
    """With a cache that knows a hash of its contents, as trimesh.Trimesh has."""

    def __init__(self, vertices, faces):
        super().__init__(vertices, faces)
        self._cache = self

    def verify(self):
        self.id_current = hash(self.vertices.tobytes())


class FortranMesh(Mesh):
    def __setattr__(self, name, array):
        super().__setattr__(name, np.asfortranarray(array))


class HashedMesh(Mesh):
    """With a hash of its contents, as trimesh.Trimesh has."""

    def __hash__(self):
        return hash(self.vertices.tobytes())


def queries(mesh):
    return morphray.trimesh.RayMeshIntersector(mesh), morphray.trimesh.ProximityQuery(mesh)


UP = [[0.5, 0.25, -1], [0.5, 0.25, 0.5], [9, 9, 9]], [[0, 0, 1], [0, 0, 4], [0, 0, 1]]


def test_rays_hit_triangles():
    rays, _ = queries(Mesh(*cube()))
    triangles, ray_ids, locations = rays.intersects_id(*UP, return_locations=True)
    assert triangles.dtype == ray_ids.dtype == np.int64 and locations.dtype == np.float64
    assert ray_ids.tolist() == [0, 0, 1]
    assert locations.tolist() == [[0.5, 0.25, 0], [0.5, 0.25, 1], [0.5, 0.25, 1]]
    assert [a.tolist() for a in rays.intersects_id(*UP)] == [triangles.tolist(), [0, 0, 1]]
    where, ray_ids, again = rays.intersects_location(*UP, multiple_hits=False)
    assert ray_ids.tolist() == [0, 1] and where.tolist() == locations[[0, 2]].tolist()
    assert again.tolist() == triangles[[0, 2]].tolist()
    assert rays.intersects_first(*UP).tolist() == [*triangles[[0, 2]], -1]
    assert rays.intersects_any(*UP).tolist() == [True, True, False]
    first = rays.intersects_first(*UP)
    assert rays.intersects_first(*UP, excluded=first).tolist() == [triangles[1], -1, -1]
    assert rays.intersects_id(*UP, excluded=first)[0].tolist() == [triangles[1]]
    assert rays.intersects_any(*UP, excluded=[-1, -1, -1]).tolist() == [True, True, False]
    with pytest.raises(ValueError, match="excluded: a shape of"):
        rays.intersects_any(*UP, excluded=[1])
    with pytest.raises(ValueError, match="ray_origins: elements of the array are masked"):
        rays.intersects_any(np.ma.masked_equal(UP[0], 9), UP[1])
    for max_hits, count in [(0, 0), (1, 2), (2, 3), (100, 3)]:
        assert len(rays.intersects_id(*UP, max_hits=max_hits)[0]) == count
        assert len(rays.intersects_id(*UP, False, max_hits)[0]) == min(count, 2)


def test_a_ray_hits_what_it_starts_on_and_nothing_behind():
    rays, _ = queries(Mesh(*cube()))
    origins, directions = [[0.5, 0.25, 0], [0.5, 0.25, 1e-3]], [[0, 0, 1], [0, 0, 1]]
    assert rays.intersects_id(origins, directions)[1].tolist() == [0, 0, 1]
    where, ray_ids, _ = rays.intersects_location(origins, directions, multiple_hits=False)
    assert ray_ids.tolist() == [0, 1] and where[:, 2].tolist() == [0, 1]


@pytest.mark.parametrize("scale", [1e-30, 1e-5, 1, 1e8])
@pytest.mark.parametrize("place", [0, 1e6])
def test_neither_scale_nor_place_matters(scale, place):
    points, faces = sphere()
    vertices = (points.astype(np.float64) + place) * scale
    rays, nearest = queries(Mesh(vertices, faces))
    centre = np.full(3, place * scale)
    directions = np.random.default_rng(1).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = centre + 3 * scale * directions
    for length in (scale, 1):
        where, ray_ids, _ = rays.intersects_location(origins, -directions * length)
        assert np.bincount(ray_ids).tolist() == [2] * 200
    apart = np.linalg.norm(where - centre, axis=1) / scale
    assert (apart > 0.97).all() and (apart < 1 + 1e-5).all()
    assert not rays.intersects_any(origins, directions).any()
    assert rays.contains_points(centre + 0.9 * scale * directions).all()
    assert not rays.contains_points(origins).any()
    distance = nearest.on_surface(origins)[1] / scale
    assert (distance > 2 - 1e-6).all() and (distance < 2.03).all()


def test_closest_points_are_those_of_the_library():
    points, faces = grid(8)
    _, nearest = queries(Mesh(points, faces))
    random = np.random.default_rng(3)
    # Above the middles of triangles, and beyond the edge of the sheet.
    corners = points.astype(np.float64)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    height = random.uniform(1e-7, 1e-3, len(faces))
    closest, distance, triangle_id = nearest.on_surface(
        corners.mean(axis=1) + height[:, None] * normals)
    assert np.array_equal(triangle_id, np.arange(len(faces))) and triangle_id.dtype == np.int64
    assert np.abs(distance - height).max() < 1e-6
    assert np.abs(closest - corners.mean(axis=1)).max() < 1e-6
    outside = [[-3, 0.5, points[4 * 9, 2]]]
    assert nearest.on_surface(outside)[1] == pytest.approx(3, abs=1e-6)


def test_of_equally_close_triangles_the_one_that_faces_the_point_is_chosen():
    # A wedge with its edge along x at y = 0.5.
    vertices = [[-1, 0.5, 0], [1, 0.5, 0], [0, -1, -0.5], [0, -1, 0.5]]
    _, nearest = queries(Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [3, 2, 1]])))
    points = [[0, 1, z] for z in (-1, -0.5, 0.5, 1)]
    closest, _, triangle_id = nearest.on_surface(points)
    assert (closest == [0, 0.5, 0]).all() and triangle_id.tolist() == [0, 0, 2, 2]


def test_distances_are_positive_inside():
    rays, nearest = queries(Mesh(*cube()))
    points = [[0.5, 0.5, 0.75], [0.5, 0.5, 2], [1, 1, 1], [0, 0, -5e-9]]
    signed = nearest.signed_distance(points)
    assert signed[:3].tolist() == [0.25, -1, 0] and 0 < signed[3] < 1e-8
    assert rays.contains_points(points).tolist() == [True, False, True, False]
    assert nearest.on_surface(points)[1].tolist() == np.abs(signed).tolist()


@pytest.mark.parametrize("turned", [[], [0, 1, 2, 3, 4, 5, 6, 7], [0, 5, 2], [4]])
def test_the_direction_of_triangles_says_nothing_about_insides(turned):
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2],
                      [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    faces[turned] = faces[turned, ::-1]
    rays, nearest = queries(Mesh(vertices, faces))
    # The sum of |x|, |y| and |z| tells the side.
    places = np.random.default_rng(0).normal(size=(1000, 3))
    places /= np.abs(places).sum(axis=1, keepdims=True)
    for height in (1e-6, 0.25):
        for side in (1, -1):
            points = places * (1 + side * height)
            assert (rays.contains_points(points) == (side < 0)).all()
            assert ((nearest.signed_distance(points) < 0) == (side > 0)).all()


def test_overlapping_bodies_are_one_by_nonzero():
    vertices, faces = cube()
    boxes = Mesh(np.concatenate([vertices, vertices + 0.5]),
                 np.concatenate([faces, faces + len(vertices)]))
    points = [[0.25, 0.25, 0.25], [0.75, 0.75, 0.75], [1.25, 1.25, 1.25], [1.25, 0.25, 0.25]]
    assert queries(boxes)[0].contains_points(points).tolist() == [True, False, True, False]
    rays = morphray.trimesh.RayMeshIntersector(boxes, rule="nonzero")
    assert rays.contains_points(points).tolist() == [True, True, True, False]


def test_no_point_outside_of_the_bounds_is_inside_a_mesh_with_holes():
    points, faces = cube()
    rays, _ = queries(Mesh(points, faces[2:]))
    assert not rays.contains_points([[0.5, 0.4, -0.5], [0.5, 0.4, 1.5]]).any()


@pytest.mark.parametrize("mesh_class", [Mesh, HashedMesh, CachedMesh, FortranMesh])
def test_a_mesh_that_changes_is_followed(mesh_class):
    mesh = mesh_class(*cube())
    rays, nearest = queries(mesh)
    inside = [[0.5, 0.5, 0.5]]
    assert rays.contains_points(inside).all()
    mesh.vertices[:, 0] += 1
    assert not rays.contains_points(inside).any()
    assert nearest.on_surface(inside)[1].tolist() == [0.5]
    mesh.vertices = mesh.vertices * 1e3
    assert rays.contains_points([[1500, 500, 500]]).all()
    mesh.faces, mesh.vertices = sphere()[1], np.asarray(sphere()[0], np.float64)
    assert rays.contains_points([[0, 0, -0.5]]).all()


def test_meshes_without_triangles_and_no_queries_have_answers():
    for mesh in [Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), Mesh([[1, 2, 3]], [])]:
        rays, nearest = queries(mesh)
        assert rays.intersects_first(*UP).tolist() == [-1, -1, -1]
        assert rays.intersects_location(*UP)[0].shape == (0, 3)
        assert not rays.contains_points(UP[0]).any()
        closest, distance, triangle_id = nearest.on_surface(UP[0])
        assert np.isnan(closest).all() and (distance == np.inf).all() and (triangle_id == -1).all()
    rays, nearest = queries(Mesh(*cube()))
    for none in [[], np.zeros((0, 3))]:
        assert rays.intersects_first(none, none).shape == (0,)
        assert rays.intersects_id(none, none, return_locations=True)[2].shape == (0, 3)
        assert rays.contains_points(none).shape == nearest.signed_distance(none).shape == (0,)
        assert nearest.on_surface(none)[0].shape == (0, 3)


def test_numbers_that_are_not_finite_have_answers():
    vertices, faces = cube()
    rays, nearest = queries(Mesh(vertices, faces))
    nan, inf = np.nan, np.inf
    bad = [[nan, 0, 0], [inf, 0, 0], [0, -inf, 0], [1e300, 0, 0]]
    forward = [[0, 0, 1.0]] * 4
    assert not rays.intersects_any(bad, forward).any() and not rays.contains_points(bad).any()
    assert not rays.intersects_any([[0.5, 0.4, -1]] * 4, [*bad[:3], [0, 0, 0]]).any()
    assert np.isnan(nearest.on_surface(bad)[0]).all()
    vertices[7] = np.nan
    rays, _ = queries(Mesh(vertices, faces))
    assert rays.intersects_id([[0.25, 0.3, -1]], [[0, 0, 1]])[1].tolist() == [0]


@pytest.mark.parametrize("ask, error, reason", [
    (lambda r, n: r.intersects_any([[0, 0, 0]], [[0, 0]]), ValueError,
     r"ray_directions: .* \(1, 2\)"),
    (lambda r, n: r.intersects_any([0, 0, 0], [0, 0, 1]), ValueError, "ray_origins: a shape"),
    (lambda r, n: r.intersects_id([[0, 0, 0]] * 2, [[0, 0, 1]]), ValueError, "2 and 1 rows"),
    (lambda r, n: r.intersects_id(*UP, max_hits=-1), ValueError, "max_hits: -1 is below 0"),
    (lambda r, n: r.contains_points([[0, 0]]), ValueError, "points: a shape"),
    (lambda r, n: n.on_surface("here"), ValueError, ""),
    (lambda r, n: n.on_surface([[[0, 0, 0]]]), ValueError, "points: a shape"),
    (lambda r, n: queries(Mesh(cube()[0], [[0, 1, 8]]))[0].contains_points([[0, 0, 0]]),
     morphray.Error, "vertex 8"),
    (lambda r, n: queries(Mesh(cube()[0], [[0, 1.5, 2]]))[0].contains_points([[0, 0, 0]]),
     TypeError, "faces: integers"),
    (lambda r, n: queries(Mesh(cube()[0][:, :2], cube()[1]))[0].contains_points([[0, 0, 0]]),
     ValueError, "vertices: a shape"),
    (lambda r, n: morphray.trimesh.ProximityQuery(Mesh(*cube()), device="x").on_surface([[0, 0, 0]]),
     ValueError, "device: "),
])
def test_bad_arguments(ask, error, reason):
    rays, nearest = queries(Mesh(*cube()))
    with pytest.raises(error, match=reason):
        ask(rays, nearest)
    assert rays.contains_points([[0.5, 0.5, 0.5]]).all()
