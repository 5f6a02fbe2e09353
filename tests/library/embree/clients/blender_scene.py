"""blender -b -P blender_scene.py -- SCENE FOLDER THREADS: renders SCENE with Cycles as 16-bit PNG."""
import math
import sys

import bpy

name, folder, threads = sys.argv[sys.argv.index("--") + 1:]


def principled(material):
    material.use_nodes = True
    return material.node_tree.nodes["Principled BSDF"].inputs


def set_first(inputs, names, value):
    """Sets the input that has one of these names, which differ between versions."""
    next(inputs[n] for n in names if n in inputs).default_value = value


def add_shape(mesh):
    mesh.shape_key_add(name="rest")
    key = mesh.shape_key_add(name="tall")
    for vertex in key.data:
        vertex.co.z *= 1.4
    for value, frame in ((0, 1), (1, 4)):
        key.value = value
        key.keyframe_insert("value", frame=frame)


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
render = scene.render
render.engine = "CYCLES"
cycles = scene.cycles
cycles.device = "CPU"
cycles.samples = 1
cycles.use_denoising = cycles.use_adaptive_sampling = False
render.resolution_x = render.resolution_y = 64
render.resolution_percentage = 100
render.threads_mode = "FIXED"
render.threads = int(threads)
render.image_settings.file_format = "PNG"
render.image_settings.color_depth = "16"

bpy.ops.mesh.primitive_plane_add(size=8)
bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, location=(0, 0, 1))
sphere = bpy.context.object
bpy.ops.mesh.primitive_monkey_add(location=(2, 0, 1))
monkey = bpy.context.object

if name == "instances":
    for i in range(4):
        other = bpy.data.objects.new(f"copy {i}", monkey.data)
        other.location = (i - 3, 2, 0.6 + 0.1 * i)
        other.rotation_euler = (0.1 * i, 0.2, i)
        other.scale = (0.5, 0.6, 0.4)
        bpy.context.collection.objects.link(other)
if name == "deform":
    add_shape(monkey)
    render.use_persistent_data = True
if name == "glass":
    material = bpy.data.materials.new("inner")
    set_first(principled(material), ("Transmission", "Transmission Weight"), 1)
    sphere.data.materials.append(material)
    half = bpy.data.materials.new("half transparent")
    set_first(principled(half), ("Alpha",), 0.5)
    monkey.data.materials.append(half)

light = bpy.data.objects.new("light", bpy.data.lights.new("light", "POINT"))
light.data.energy = 500
light.location = (3, -3, 5)
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = (0, -9, 4)
camera.rotation_euler = (math.radians(70), 0, 0)
for thing in (light, camera):
    bpy.context.collection.objects.link(thing)
scene.camera = camera
scene.world = bpy.data.worlds.new("world")
scene.world.use_nodes = True

for frame in (1, 2, 3) if name == "deform" else (1,):
    scene.frame_set(frame)
    render.filepath = f"{folder}{name}{frame}"
    bpy.ops.render.render(write_still=True)
