"""Uses each public name once, as its documentation says: for `mypy --strict`, never run."""

from types import SimpleNamespace
from typing import List, Tuple

import numpy as np
from numpy.typing import NDArray

import morphray
import morphray.open3d
import morphray.trimesh

points = np.zeros((3, 3), np.float32)
triangles = [[0, 1, 2]]
rays = np.zeros((4, 6), np.float32)
texcoords = np.zeros((1, 3, 2), np.float32)
image = np.zeros((2, 2, 3), np.uint8)
cancel = morphray.Cancel()
cancel.set()
cancel.clear()
is_set: bool = cancel.is_set()

devices: List[morphray.VulkanDeviceInfo] = morphray.vulkan_devices()
texts: List[str] = [morphray.__version__, *morphray.simd_targets()]
for info in devices:
    texts += [info.name, info.type, info.driver, info.uuid, info.unusable]
    numbers: Tuple[int, int] = info.index, info.memory_bytes
cpu = morphray.Device.cpu(threads=2, simd="off")
vulkan = morphray.Device.vulkan("llvmpipe", validate=True)
texts += [morphray.Device.brute_force().name, cpu.description]

textures = morphray.Textures(image, texcoords, ids=None, wrap="clamp", alpha_cutoff=[0.5])
mesh = morphray.Mesh(points, triangles, deforms=False, albedo=None, textures=textures)
scene = morphray.Scene([mesh, (points, triangles)], device="brute")
scene = morphray.Scene([])
scene = morphray.Scene(points, triangles, device=vulkan, bounds=((0, 0, 0), (1, 1, 1)), update="every:8",
                       budget_ms=1, budget=0.5, deterministic=True, deforms=True, albedo=[7],
                       record_cost_ratio=True, textures=textures, origin=np.zeros(3))
geom_id: int = scene.attach(points, triangles, False, None, textures)
scene.detach(geom_id)
update: morphray.Update = scene.update()
update = scene.update(0, first=1, count=1)
update = scene.update(0, points)
update = scene.update_with_new_bounds()
update = scene.last_update()
texts += [update.step, update.reason]
times: List[float] = [update.cost_ratio, update.milliseconds, update.read_ms, update.upload_ms, update.refit_ms,
                      update.decide_ms, update.restructure_ms, update.rebuild_ms]
pending: bool = update.build_pending
left: List[morphray.LeftOut] = update.left_out
counts: List[int] = [left[0].geom_id, left[0].not_finite, left[0].too_far]
edges: morphray.EdgeCounts = scene.edge_counts()
counts += [edges.open, edges.shared, edges.turned, edges.uneven, edges.twins]
is_closed: bool = edges.is_closed
tree: morphray.TreeStatistics = scene.on("cpu").tree_statistics()
counts += [tree.node_count, tree.leaf_count, tree.depth, tree.bytes, tree.hash]
times += [tree.sah_cost, float(scene.origin[0]), *scene.bounds[0], *scene.bounds[1]]
counts += [scene.triangle_count, scene.vertex_count]
texts += [scene.device.name]

hits: NDArray[np.void] = scene.intersect(rays, np.empty(4, morphray.hit_dtype), coherence="sort", visible=[True],
                                         threads="calling", cancel=cancel)
hits = scene.intersect(np.empty(4, morphray.ray_dtype), excluded=hits, coherence=64)
bits: NDArray[np.bool_] = scene.occluded([0, 0, 1, 0, 0, -1], excluded=[[0, 0]])
every: morphray.AllHits = scene.intersect_all(rays, crossing="each", max_hits=3)
hits = every.hits[every.offsets[0]:every.left_out[0]]
hits = every.of_ray(int(every.ray_ids[0]))
whole: NDArray[np.int64] = scene.count(rays, crossing="owner")
normals: NDArray[np.float32] = scene.normals(hits, smooth=True)
winding: NDArray[np.int32] = scene.winding(points)
bits = scene.contains(points, rule="odd")
closest: NDArray[np.void] = scene.closest_points(points, 2, np.empty(3, morphray.closest_dtype))
is_miss: bool = closest["prim_id"][0] == morphray.INVALID_ID
distance: NDArray[np.float32] = scene.signed_distance(points, rule="nonzero", max_distance=3)

frame: morphray.Image = scene.render((64, 48), eye=(0, 0, 9), target=[0, 0, 0], up=(0, 1, 0), fov=40,
                                     light=(1, 2, 3), rays="ao", ao_count=4, ao_distance=1, shading="lit",
                                     samples=4, flat=True, cancel=cancel)
counts += [frame.width, frame.height, frame.samples, frame.ray_count, frame.hits_hash, frame.image_hash]
times += [frame.trace_ms, float(np.asarray(frame)[0, 0, 0])]
arrays: Tuple[NDArray[np.uint8], NDArray[np.void], NDArray[np.uint32]] = frame.pixels, frame.hits, frame.occlusion
frame.save("image.png")
difference: morphray.Comparison = morphray.compare(frame, frame, keep=1)
difference = morphray.compare(scene, scene.on(cpu), rays)
if difference and not difference.equal:
    counts += [difference.compared, difference.different, len(difference.differences)]
try:
    scene.update()
except morphray.Error as error:
    texts += [error.code]

raycaster = morphray.open3d.RaycastingScene(nthreads=1)
counts += [raycaster.add_triangles(points, triangles), raycaster.INVALID_ID]
views = raycaster.create_rays_pinhole(90, [0, 0, 0], [0, 0, 1], [0, 1, 0], 8, 8)
answers = [raycaster.cast_rays(views), raycaster.list_intersections(views), raycaster.compute_closest_points(points)]
bits = raycaster.test_occlusions(views, tnear=0, tfar=1)
counted: NDArray[np.int32] = raycaster.count_intersections(views)
distance = raycaster.compute_distance(points) + raycaster.compute_signed_distance(points)
distance = raycaster.compute_occupancy(points)

solid = SimpleNamespace(vertices=points, faces=triangles)
intersector = morphray.trimesh.RayMeshIntersector(solid, device=cpu)
found = intersector.intersects_id(points, points, max_hits=2, return_locations=True)
locations, index_ray, index_tri = intersector.intersects_location(points, points, excluded=[0])
whole = intersector.intersects_first(points, points)
bits = intersector.intersects_any(points, points) & intersector.contains_points(points)
nearest = morphray.trimesh.ProximityQuery(solid)
on, apart, triangle_id = nearest.on_surface(points)
apart = nearest.signed_distance(points)
