"""cameras -> the pictures of Cycles, pixel by pixel.

Cycles puts the first sample of a pixel into its middle.  So pictures of one sample, of things that
tell where they are, compare directions and places exactly; what is drawn at random (apertures,
pixel filters) is compared by z-tests.  The module is also imported by Blender's process.
"""

from pathlib import Path

import numpy as np
import pytest

WIDTH, HEIGHT = 24, 16
PANORAMAS = (
    "EQUIRECTANGULAR",
    "EQUIANGULAR_CUBEMAP_FACE",
    "MIRRORBALL",
    "FISHEYE_EQUIDISTANT",
    "FISHEYE_EQUISOLID",
    "FISHEYE_LENS_POLYNOMIAL",
    "CENTRAL_CYLINDRICAL",
)
# Cycles 4.2 finds places on these the wrong way round, left for right; it was mended since
MIRRORED = ("FISHEYE_EQUIDISTANT", "FISHEYE_EQUISOLID")
FACTS = (
    ("NewGeometry", "Position"),
    ("CameraData", "View Vector"),
    ("CameraData", "View Z Depth"),
    ("CameraData", "View Distance"),
    ("TexCoord", "Window"),
    ("TexCoord", "Camera"),
    ("LightPath", "Ray Length"),
)


# --- In Blender's process -----------------------------------------------------------------------


def stage(width=WIDTH, height=HEIGHT, samples=1):
    """Return an empty scene, its camera's object and a folder; both engines are set alike."""
    import bpy

    import penumbra

    bpy.ops.wm.read_factory_settings(use_empty=True)
    penumbra.register()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sampling_pattern = "TABULATED_SOBOL"
    for settings in (scene.cycles, scene.penumbra):
        settings.samples = samples
        settings.pixel_filter_type = "BOX"
        settings.sample_clamp_direct = settings.sample_clamp_indirect = settings.max_bounces = 0
    if samples == 1:
        scene.penumbra.pattern = "REGULAR"  # one sample: in the middle
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGBA"
    image.views_format = "INDIVIDUAL"
    return scene, camera


def shoot(scene, engine, folder):
    """Render; return the pictures (V, H, W, 4) of all views, the top row first."""
    import bpy
    import OpenImageIO

    scene.render.engine = engine
    for old in Path(folder).glob("shot*"):
        old.unlink()
    scene.render.filepath = f"{folder}/shot.exr"
    bpy.ops.render.render(write_still=True)
    files = sorted(Path(folder).glob("shot*"))
    return np.stack([OpenImageIO.ImageBuf(str(file)).get_pixels() for file in files])


def both(scene, folder):
    return [shoot(scene, engine, folder) for engine in ("PENUMBRA", "CYCLES")]


def show(thing, kind, output, scale=0.1):
    """Make a mesh or a world glow with half and a part of what a node says."""
    import bpy

    is_world = isinstance(thing, bpy.types.World)
    owner = thing if is_world else bpy.data.materials.new("Tells")
    if owner.node_tree is None or bpy.app.version < (5, 0):
        owner.use_nodes = True
    tree = owner.node_tree
    tree.nodes.clear()
    source = tree.nodes.new(f"ShaderNode{kind}")
    scaled = tree.nodes.new("ShaderNodeVectorMath")
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value, scaled.inputs[2].default_value = (scale,) * 3, (0.5,) * 3
    glow = tree.nodes.new("ShaderNodeBackground" if is_world else "ShaderNodeEmission")
    end = tree.nodes.new("ShaderNodeOutputWorld" if is_world else "ShaderNodeOutputMaterial")
    tree.links.new(source.outputs[output], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], glow.inputs[0])
    tree.links.new(glow.outputs[0], end.inputs["Surface"])
    if not is_world:
        thing.materials.clear()
        thing.materials.append(owner)


def room(scene, half=3.0):
    """Put a box around the camera; return its mesh."""
    import bpy

    data = bpy.data.meshes.new("Room")
    corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    data.from_pydata(corners, [], sides)
    scene.collection.objects.link(bpy.data.objects.new("Room", data))
    return data


def kinds_of_panoramas(camera):
    known = camera.bl_rna.properties["panorama_type"].enum_items
    return [kind for kind in PANORAMAS if kind in known]


def panoramas(folder):
    """Return {(kind, variant): pictures} of a world that tells directions."""
    import bpy

    scene, item = stage()
    camera, render = item.data, scene.render
    scene.world = bpy.data.worlds.new("World")
    show(scene.world, "TexCoord", "Generated", 0.5)
    item.rotation_euler, item.scale = (1.1, 0.3, -0.7), (2, 0.5, 1)
    camera.type = "PANO"
    found = {}
    rng = np.random.default_rng(1)
    for kind in kinds_of_panoramas(camera):
        camera.panorama_type = kind
        found[kind, 0] = both(scene, folder)
        for variant, fit in enumerate(("AUTO", "HORIZONTAL", "VERTICAL"), 1):
            camera.longitude_min, camera.longitude_max = -rng.uniform(0, 3), rng.uniform(0, 3)
            camera.latitude_min, camera.latitude_max = -rng.uniform(0, 1.5), rng.uniform(0, 1.5)
            camera.fisheye_fov, camera.fisheye_lens = rng.uniform(1, 6), rng.uniform(5, 20)
            camera.fisheye_polynomial_k1 = -rng.uniform(0.02, 0.06)
            camera.fisheye_polynomial_k2 = rng.uniform(-1e-3, 1e-3)
            camera.shift_x, camera.shift_y = rng.uniform(-0.2, 0.2, 2)
            camera.sensor_fit = fit
            camera.sensor_width, camera.sensor_height = rng.uniform(20, 40, 2)
            if hasattr(camera, "central_cylindrical_radius"):
                camera.central_cylindrical_radius = rng.uniform(0.5, 2)
                camera.central_cylindrical_range_v_min = -rng.uniform(0, 2)
                camera.central_cylindrical_range_u_max = rng.uniform(0, 3)
            render.pixel_aspect_x = rng.uniform(1, 2)
            render.resolution_percentage = (100, 150, 75)[variant - 1]
            render.use_border, render.use_crop_to_border = variant > 1, variant > 2
            render.border_min_x, render.border_max_y = 0.2, 0.7
            found[kind, variant] = both(scene, folder)
        render.use_border, render.resolution_percentage = False, 100
        camera.shift_x = camera.shift_y = 0
    return found, bpy.app.version


def facts(folder):
    """Return {(kind, output): pictures} of walls that tell what shaders may know."""
    import bpy

    scene, item = stage()
    camera = item.data
    item.rotation_euler, item.location = (1.3, 0.2, -0.4), (0.3, -0.2, 0.1)
    camera.clip_start = 0.4
    walls = room(scene)
    found = {}
    for kind in ("PERSP", "ORTHO", *kinds_of_panoramas(camera)):
        flat = kind in ("PERSP", "ORTHO")
        camera.type = kind if flat else "PANO"
        if not flat:
            camera.panorama_type = kind
        for node, output in FACTS:
            show(walls, node, output)
            ours, theirs = both(scene, folder)
            if output == "Window" and kind in MIRRORED and bpy.app.version < (4, 3):
                x = theirs[..., 0]
                x[:] = np.where(x > 0, 1.1 - x, 0)  # 0.5 + 0.1 x of what is in the picture
            found[kind, output] = ours, theirs
    return found


def eyes(folder):
    """Return {(kind, spherical, mode, poles): pictures} of both eyes, in a room."""
    scene, item = stage()
    camera = item.data
    item.rotation_euler, item.location = (1.3, 0.2, -0.4), (0.3, -0.2, 0.1)
    show(room(scene), "NewGeometry", "Position")
    scene.render.use_multiview = True
    stereo = camera.stereo
    stereo.interocular_distance, stereo.convergence_distance = 0.3, 1.5
    stereo.pole_merge_angle_from, stereo.pole_merge_angle_to = 0.3, 0.9
    found = {}
    cases = [(False, mode, False) for mode in ("OFFAXIS", "PARALLEL", "TOE")]
    cases += [(True, "OFFAXIS", False), (True, "PARALLEL", True), (True, "TOE", True)]
    for kind in ("PERSP", "ORTHO", "EQUIRECTANGULAR", "MIRRORBALL", "FISHEYE_EQUISOLID"):
        flat = kind in ("PERSP", "ORTHO")
        camera.type = kind if flat else "PANO"
        if not flat:
            camera.panorama_type = kind
        for case in cases:
            stereo.use_spherical_stereo, stereo.convergence_mode, stereo.use_pole_merge = case
            found[kind, *case] = both(scene, folder)

    # Views with cameras of their own, by the ends of their names
    render = scene.render
    render.views_format = "MULTIVIEW"
    camera.type = "PERSP"
    item.name = "Camera_L"
    other = item.copy()
    other.data = camera.copy()
    other.name, other.location, other.data.lens = "Camera_R", (-1, 0.5, 0.3), 20
    scene.collection.objects.link(other)
    found["cameras", 0, 0, 0] = both(scene, folder)
    return found


def sparks(folder):
    """Return {name: pictures, one engine after the other} of small lights, random samples."""
    import bpy

    scene, item = stage(32, 32, samples=2048)
    camera = item.data
    dof = camera.dof
    item.rotation_euler = (np.pi / 2, 0, 0)  # along y
    camera.type, camera.lens, camera.ortho_scale = "ORTHO", 50, 3.2
    spark = bpy.data.meshes.new("Spark")
    tall = bpy.data.objects.new("Spark", spark)
    scene.collection.objects.link(tall)
    show(spark, "NewGeometry", "Position", 0.0)
    found = {}

    def place(*corners):
        spark.clear_geometry()
        spark.from_pydata(corners, [], [range(len(corners))])
        spark.update()

    # A dot of half a pixel over the corner of four, for the filters
    low, high = -0.03, 0.02
    place((low, 2, low), (high, 2, low), (high, 2, high), (low, 2, high))
    for kind, width in (("BOX", 1.5), ("GAUSSIAN", 3.0), ("BLACKMAN_HARRIS", 2.5)):
        for settings in (scene.cycles, scene.penumbra):
            settings.pixel_filter_type, settings.filter_width = kind, width
        found[kind] = both(scene, folder)

    # A square before and behind the focus, for the apertures
    for settings in (scene.cycles, scene.penumbra):
        settings.pixel_filter_type = "BOX"
    apertures = {
        "ORTHO": {"aperture_fstop": 0.5, "aperture_blades": 3},
        "PERSP": {"aperture_fstop": 0.05, "aperture_blades": 5, "aperture_rotation": 0.4},
        "PERSP wide": {"aperture_fstop": 0.06, "aperture_blades": 2, "aperture_ratio": 0.7},
        "EQUIRECTANGULAR": {"aperture_fstop": 0.06, "aperture_blades": 4, "aperture_ratio": 2.0},
        "MIRRORBALL": {"aperture_fstop": 0.06, "aperture_blades": 3, "aperture_rotation": 0.4},
    }
    dof.use_dof, dof.focus_distance = True, 3.0
    half = 0.15
    for name, options in apertures.items():
        dof.aperture_blades = dof.aperture_rotation = 0
        dof.aperture_ratio = 1
        for key, value in options.items():
            setattr(dof, key, value)
        kind = name.split()[0]
        flat = kind in ("PERSP", "ORTHO")
        camera.type = kind if flat else "PANO"
        aside = 0.0
        if not flat:
            camera.panorama_type = kind
            camera.longitude_min, camera.longitude_max = -0.6, 0.6
            camera.latitude_min, camera.latitude_max = -0.6, 0.6
            aside = 0.7
        for distance in (1.7, 8.0):
            x, z = (aside * distance * side for side in (0.4, 0.25))
            size = half * (distance / 1.7 if kind != "ORTHO" else 1)
            place(
                (x - size, distance, z - size),
                (x + size, distance, z - size),
                (x + size, distance, z + size),
                (x - size, distance, z + size),
            )
            found[f"{name} {distance}"] = both(scene, folder)
    return found


def pulls(folder):
    """Return {name: pictures} of focuses that are pulled; Cycles' are means of stills.

    Cycles itself has the focus of the frame at all times.
    """
    import bpy
    from mathutils import Matrix

    count, ends = 32, (2.2, 5.8)
    scene, item = stage(32, 32, samples=256)
    camera = item.data
    item.rotation_euler = (np.pi / 2, 0, 0)  # along y
    camera.lens, camera.ortho_scale = 50, 3.2
    spark = bpy.data.meshes.new("Spark")
    spark.from_pydata([(x, 3, z) for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))], [], [range(4)])
    spark.transform(Matrix.Diagonal((0.2, 1, 0.2, 1)))
    scene.collection.objects.link(bpy.data.objects.new("Spark", spark))
    show(spark, "NewGeometry", "Position", 0.0)
    dof = camera.dof
    dof.use_dof = True
    bpy.context.preferences.edit.keyframe_new_interpolation_type = "LINEAR"
    found = {}
    for kind, stop in (("PERSP", 0.06), ("ORTHO", 0.6)):
        camera.type, dof.aperture_fstop = kind, stop
        scene.render.use_motion_blur = False
        stills = []
        for number in range(count):
            part = (number + 0.5) / count
            dof.focus_distance = ends[0] + (ends[1] - ends[0]) * part
            scene.cycles.seed = number
            stills.append(shoot(scene, "CYCLES", folder))

        # The same in frame 1, between keys in 0 and 2
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 2.0
        for frame, focus in zip((0, 2), ends, strict=True):
            dof.focus_distance = focus
            dof.keyframe_insert("focus_distance", frame=frame)
        scene.penumbra.samples = 256 * count
        scene.frame_set(1)
        found[kind] = shoot(scene, "PENUMBRA", folder), np.mean(stills, axis=0)
        camera.animation_data_clear()
    return found


# --- Verdicts -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cameras")


def assert_same(ours, theirs, label, atol=1.5e-4):
    assert ours.shape == theirs.shape
    wrong = (np.abs(ours - theirs) > atol).any(axis=-1)
    assert not wrong.any(), f"{label}: {np.count_nonzero(wrong)} of {wrong.size} pixels"
    assert np.ptp(theirs[..., :3]) > 0.01, label


def test_every_pixel_of_a_panorama_looks_where_it_does_in_cycles(blender, folder):
    found, version = blender(panoramas, folder)
    for label, (ours, theirs) in found.items():
        # At the rim of a mirror ball a thousandth of a pixel is a long way; Cycles 4.2 takes angles
        # around a fisheye's axis from their cosine, which loses half of the digits near the horizon
        atol = 3e-3 if label[0] == "MIRRORBALL" else 1.5e-4
        if label[0].startswith("FISHEYE") and tuple(version) < (4, 3):
            atol = 5e-4
        assert_same(ours, theirs, label, atol)


def test_shaders_see_points_through_all_cameras_as_in_cycles(blender, folder):
    for label, (ours, theirs) in blender(facts, folder).items():
        assert_same(ours, theirs, label, 4e-4 if label[0] == "MIRRORBALL" else 1.5e-4)


def test_both_eyes_see_what_they_see_in_cycles(blender, folder):
    found = blender(eyes, folder)
    for label, (ours, theirs) in found.items():
        assert ours.shape[0] == 2
        assert np.abs(theirs[0] - theirs[1]).max() > 0.02, label
        assert_same(ours, theirs, label, 4e-4 if label[0] == "MIRRORBALL" else 1.5e-4)


def test_apertures_and_pixel_filters_spread_light_as_in_cycles(blender, folder):
    compare_shares(blender(sparks, folder), 2048)


def test_a_focus_that_is_pulled_is_the_mean_of_cycles_pictures_of_all_times(blender, folder):
    compare_shares(blender(pulls, folder), 256 * 32)


def compare_shares(found, samples):
    """The share of samples of a pixel that hit is binomial, or better if they are stratified."""
    for label, (ours, theirs) in found.items():
        ours, theirs = (picture[0, ..., 1].astype(float) / 0.5 for picture in (ours, theirs))
        share = 0.5 * (ours + theirs)
        assert theirs.sum() > 0.2, label
        assert theirs.max() <= 1 + 1e-6
        assert 4 <= np.count_nonzero(theirs) < 700, label
        spread = np.sqrt(2 * share * (1 - share) / samples + (2 / samples) ** 2)
        z = (ours - theirs) / spread
        assert np.abs(z).max() < 5, f"{label}: {np.abs(z).max():.1f} standard errors"
        assert (z[share > 0] ** 2).mean() < 1.5, label
