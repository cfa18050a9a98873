"""names and numbers -> a saved .blend.  What the example scripts share: materials, objects, lamps.

Only surfaces with constant inputs, no textures and no other files, so that a scene is its script.
"""

import importlib.util
import math
from pathlib import Path

import bpy

# isort: split
import bmesh  # which the bpy module brings along
from mathutils import Matrix, Vector


def start(width=640, height=400, samples=64, world=(0, 0, 0), view="AgX", exposure=0.0, **bounces):
    """Empty the file and set size, samples, world colour, view transform and bounce limits."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.view_settings.view_transform, scene.view_settings.exposure = view, exposure
    scene.view_settings.look = "AgX - Medium High Contrast" if view == "AgX" else "None"
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*world, 1)
    # Both engines get the same settings: no clamps, no blur, no adaptivity, no denoiser.
    settings = {"samples": samples, "sample_clamp_indirect": 0, "blur_glossy": 0}
    settings |= {"use_adaptive_sampling": False, "use_denoising": False, **bounces}
    scene.render.engine, engines = "CYCLES", [scene.cycles]
    if importlib.util.find_spec("penumbra"):
        import penumbra

        penumbra.register()
        scene.render.engine, engines = "PENUMBRA", [scene.cycles, scene.penumbra]
    for engine in engines:
        for name, value in settings.items():
            setattr(engine, name, value)


def surface(name, kind, color=(0.8, 0.8, 0.8), **inputs):
    """Return a material of one shader node, for instance kind 'BsdfDiffuse'."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shader = nodes.new("ShaderNode" + kind)
    shader.inputs[0].default_value = (*color, 1)
    for socket, value in inputs.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    material.diffuse_color = (*color, 1)
    return material


def matte(name, color):
    """Return a diffuse material."""
    return surface(name, "BsdfDiffuse", color)


def mirror(name, color=(0.95, 0.95, 0.95)):
    """Return a metal with roughness 0."""
    return surface(name, "BsdfPrincipled", color, Metallic=1.0, Roughness=0.0)


def glass(name, ior=1.45, color=(1, 1, 1)):
    """Return clear glass."""
    return surface(name, "BsdfGlass", color, Roughness=0.0, IOR=ior)


def glow(name, color, strength):
    """Return an emission material."""
    return surface(name, "Emission", color, Strength=strength)


def mesh(vertices, faces, smooth=False):
    """Return a mesh of the given vertices and polygons."""
    data = bpy.data.meshes.new("Mesh")
    data.from_pydata(vertices, [], faces)
    data.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    return data


def box(x=1.0, y=1.0, z=1.0):
    """Return a box of these edge lengths about the origin."""
    build = bmesh.new()
    bmesh.ops.create_cube(build, size=1, matrix=Matrix.Diagonal((x, y, z, 1)))
    return _finish(build, smooth=False)


def ball(radius=1.0, segments=64, smooth=True):
    """Return a sphere of longitudes and latitudes."""
    build = bmesh.new()
    bmesh.ops.create_uvsphere(build, u_segments=segments, v_segments=segments // 2, radius=radius)
    return _finish(build, smooth)


def orb(name, radius, material, at=(0, 0, 0), levels=5, inside=None):
    """Put a fine round ball: a cube, subdivided and cast onto its sphere by modifiers."""
    data = box(radius, radius, radius)
    data.polygons.foreach_set("use_smooth", [True] * len(data.polygons))
    thing = put(name, data, material, at, inside=inside)
    divide, cast = thing.modifiers.new("Divide", "SUBSURF"), thing.modifiers.new("Cast", "CAST")
    divide.subdivision_type, divide.levels, divide.render_levels = "SIMPLE", levels, levels
    cast.factor, cast.use_radius_as_size, cast.size = 1, False, radius
    return thing


def cone(radius, top, height, segments=64, smooth=False):
    """Return a closed cone, cylinder or prism that stands on z = 0."""
    build, lift = bmesh.new(), Matrix.Translation((0, 0, height / 2))
    size = {"radius1": radius, "radius2": top, "depth": height, "segments": segments}
    bmesh.ops.create_cone(build, cap_ends=True, matrix=lift, **size)
    return _finish(build, smooth)


def put(name, data, materials=(), at=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1), inside=None):
    """Link an object to the scene or collection; turn is Euler angles in degrees."""
    thing = bpy.data.objects.new(name, data)
    thing.location, thing.scale = at, scale
    thing.rotation_euler = [math.radians(angle) for angle in turn]
    for material in materials if isinstance(materials, list | tuple) else [materials]:
        data.materials.append(material)
    (inside or bpy.context.collection).objects.link(thing)
    return thing


def lamp(name, kind, energy, at, to=None, color=(1, 1, 1), **properties):
    """Add a lamp that looks from `at` to `to`, straight down by default."""
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    for key, value in properties.items():
        setattr(data, key, value)
    return _aim(put(name, data), at, to or Vector(at) - Vector((0, 0, 1)))


def camera(at, to, lens=50.0, **properties):
    """Add the camera that looks from `at` to `to`."""
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    for key, value in properties.items():
        setattr(data, key, value)
    bpy.context.scene.camera = _aim(put("Camera", data), at, to)


def save(script):
    """Save the .blend beside the script, compressed."""
    path = Path(script).resolve().with_suffix(".blend")
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


def _aim(thing, at, to):
    thing.location = at
    thing.rotation_euler = (Vector(to) - Vector(at)).to_track_quat("-Z", "Y").to_euler()
    return thing


def _finish(build, smooth):
    data = bpy.data.meshes.new("Mesh")
    for face in build.faces:
        face.smooth = smooth
    build.to_mesh(data)
    build.free()
    return data
