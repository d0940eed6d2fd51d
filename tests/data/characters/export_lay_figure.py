"""Makes lay_figure_blender.fbx, an FBX as Blender writes it. Run where the wheel bpy is installed (5.0.1 was used):

python assets/make_doll.py doll.glb
python tests/data/characters/export_lay_figure.py doll.glb tests/data/characters/lay_figure_blender.fbx
"""

import sys

import bpy  # type: ignore[import-not-found]

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
for item in list(bpy.data.objects):
    if item.name.startswith("Icosphere"):  # what Blender's importer shows bones as
        bpy.data.objects.remove(item)
bpy.ops.export_scene.fbx(filepath=sys.argv[2], bake_anim=False, mesh_smooth_type="OFF")
