"""a scene of what moves from frame to frame -> its Vector pass.  Runs inside of Blender only."""

import bpy
import pass_stage


def straight(owner, name, values):
    """Key a property at the frames 0, 1 and 2; between them is nothing to see."""
    for frame, value in enumerate(values):
        setattr(owner, name, value)
        owner.keyframe_insert(name, frame=frame)


def build(kind="PERSP", zooms=True):
    """Make the scene: a camera that moves, turns and zooms, and what flies, turns and bends."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    pass_stage.penumbra.register()
    scene, ops = bpy.context.scene, bpy.ops.mesh
    scene.frame_set(1)
    data = bpy.data.cameras.new("Camera")
    camera = scene.camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(camera)
    data.type = kind
    straight(camera, "location", [(0.1, -6, 3), (0, -5.8, 3), (-0.3, -5.5, 3.1)])
    straight(camera, "rotation_euler", [(1.1, 0.02, -0.03), (1.1, 0, 0), (1.12, 0, 0.04)])
    if kind == "PERSP" and zooms:
        straight(data, "lens", [34, 35, 38])
    elif kind == "PANO":
        data.panorama_type = "FISHEYE_EQUIDISTANT"
        data.fisheye_fov = 2.5

    material, _, _ = pass_stage.shaded("Grey", "ShaderNodeBsdfDiffuse")
    pass_stage.put(ops.primitive_plane_add, "Floor", material, size=9)
    flyer = pass_stage.put(
        ops.primitive_cube_add, "Flyer", material, size=1, location=(-1.3, 0, 0.8)
    )
    straight(flyer, "location", [(-1.5, 0.1, 0.8), (-1.3, 0, 0.8), (-0.8, 0, 1.0)])
    straight(flyer, "rotation_euler", [(0, 0, 0), (0.2, 0.1, 0.3), (0.2, 0.4, 0.9)])
    flyer.cycles.use_motion_blur = False  # blurring it is another matter
    bent = pass_stage.put(ops.primitive_uv_sphere_add, "Bent", material, location=(1.3, 0, 1))
    bent.shape_key_add(name="Basis")
    key = bent.shape_key_add(name="Long")
    for point in key.data:
        point.co.z *= 2 + point.co.x
    straight(key, "value", [0.0, 0.3, 0.4])
    straight(bent, "location", [(1.3, 0.2, 1), (1.3, 0, 1), (1.2, 0, 1)])
    scene.frame_set(1)
    scene.view_layers[0].use_pass_vector = True
    scene.view_layers[0].use_pass_cryptomatte_object = True
    return scene
