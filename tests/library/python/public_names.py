"""Uses each public name that no program of docs/guide/python.md uses: for `mypy --strict`, never run."""

from typing import List

import numpy as np
from numpy.typing import NDArray

import morphray


def use(*values: object) -> None:
    """Only types matter."""


points, triangles, rays = np.zeros((3, 3), np.float32), [[0, 1, 2]], np.zeros((4, 6), np.float32)
cancel = morphray.Cancel()
cancel.set()
cancel.clear()
use(cancel.is_set(), morphray.__version__, morphray.simd_targets())
for info in morphray.vulkan_devices():
    use(info.index, info.name, info.type, info.driver, info.uuid, info.memory_bytes, info.unusable)
cpu = morphray.Device.cpu(threads=2, simd="off")
use(morphray.Device.vulkan("llvmpipe", validate=True).name, morphray.Device.brute_force().description,
    cpu.digest() == morphray.DIGEST)

textures = morphray.Textures(np.zeros((2, 2, 3), np.uint8), np.zeros((1, 3, 2), np.float32), wrap="clamp")
mesh = morphray.Mesh(points, triangles, deforms=False, textures=textures)
scene = morphray.Scene([mesh, (points, triangles)], device="brute")
scene = morphray.Scene(points, triangles, device=cpu, update="auto", budget_ms=1, budget=0.5, deterministic=True,
                       albedo=[7], record_cost_ratio=True, textures=textures, origin=np.zeros(3))
scene.detach(scene.attach(points, triangles, False, None, textures))
update: morphray.Update = scene.update(0, first=1, count=1)
use(scene.update_with_new_bounds(), update.cost_ratio, update.read_ms, update.upload_ms, update.refit_ms,
    update.decide_ms, update.restructure_ms, update.rebuild_ms, update.build_pending)
use(scene.update(poses=np.zeros((1, 3, 4)), geom_ids=[0]),
    scene.render_views([(0, 0, 9)], (0, 0, 0), channels=("depth", "uv"), out={})["depth"])
left: List[morphray.LeftOut] = scene.last_update().left_out
use(left[0].geom_id, left[0].not_finite, left[0].too_far)
edges: morphray.EdgeCounts = scene.edge_counts()
use(edges.open, edges.shared, edges.turned, edges.uneven, edges.twins, edges.is_closed)
tree: morphray.TreeStatistics = scene.on("cpu").tree_statistics()
use(tree.sah_cost, tree.node_count, tree.leaf_count, tree.depth, tree.bytes, tree.hash)
use(scene.device.name, scene.bounds[1][0], scene.origin[0], scene.triangle_count, scene.vertex_count)

hits: NDArray[np.void] = scene.intersect(np.empty(4, morphray.ray_dtype), np.empty(4, morphray.hit_dtype),
                                         coherence=64, visible=[True], threads="calling", cancel=cancel)
bits: NDArray[np.bool_] = scene.occluded([0, 0, 1, 0, 0, -1], excluded=hits, coherence="sort")
counts: NDArray[np.int64] = scene.count(rays, crossing="owner", excluded=[[0, 0]])
normals: NDArray[np.float32] = scene.normals(hits, smooth=True)
hits = scene.closest_points(points, out=np.empty(3, morphray.closest_dtype))
use(hits["prim_id"][0] == morphray.INVALID_ID, scene.contains(points, rule="odd", visible=[True]),
    scene.signed_distance(points, excluded=[[0, -1]]))

frame: morphray.Image = scene.render((64, 48), target=[0, 0, 0], fov=40, light=(1, 2, 3), rays="ao", ao_count=4,
                                     ao_distance=1, flat=True, cancel=cancel)
use(frame.width, frame.height, frame.samples, frame.ray_count, frame.hits_hash, frame.image_hash, frame.trace_ms,
    frame.pixels, frame.hits, frame.occlusion, np.asarray(frame))
difference: morphray.Comparison = morphray.compare(frame, frame, keep=1)
if morphray.compare(scene, scene.on(cpu), rays):
    use(difference.equal, difference.compared, difference.different, difference.differences)
