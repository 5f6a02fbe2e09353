"""blender -P blender_viewport.py -- FOLDER: with a display, writes what the viewport shows of a mesh that deforms."""
import pathlib
import sys

import bpy

FRAMES = 4
folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])

for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
bpy.ops.mesh.primitive_plane_add(size=8)
bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 1))
monkey = bpy.context.object
monkey.shape_key_add(name="rest")
tall = monkey.shape_key_add(name="tall")
for vertex in tall.data:
    vertex.co.z *= 1.8
for value, frame in ((0, 1), (1, FRAMES)):
    tall.value = value
    tall.keyframe_insert("value", frame=frame)
light = bpy.data.objects.new("light", bpy.data.lights.new("light", "POINT"))
light.data.energy = 500
light.location = (3, -3, 5)
scene = bpy.context.scene
scene.collection.objects.link(light)
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.preview_samples = 1
scene.cycles.use_preview_denoising = scene.cycles.use_preview_adaptive_sampling = False
bpy.context.preferences.view.show_splash = False
frame = 0
before = None


def has_settled(photograph):
    """Whether the viewport shows what it did a second ago. A busy machine takes a while to trace a frame."""
    global before
    shown = photograph.read_bytes()
    is_same = shown == before
    before = shown
    return is_same


def step():
    """Photographs the frame that is shown until it has settled, and shows the next one."""
    global frame, before
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    view = area.spaces.active
    if frame == 0:
        view.overlay.show_overlays = view.show_gizmo = False
        view.show_region_header = view.show_region_toolbar = view.show_region_tool_header = False
        view.shading.type = "RENDERED"
    else:
        photograph = folder / f"viewport{frame}.png"
        with bpy.context.temp_override(window=window, area=area):
            bpy.ops.screen.screenshot_area(filepath=str(photograph))
        if not has_settled(photograph):
            return 1.0
    frame += 1
    if frame > FRAMES:
        bpy.ops.wm.quit_blender()
        return None
    before = None
    scene.frame_set(frame)
    return 3.0


bpy.app.timers.register(step, first_interval=2.0)
