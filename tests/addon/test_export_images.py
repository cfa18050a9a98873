"""What an image node shows is read from the right place, and looks as Cycles shows it."""

import numpy as np
import pytest

CASES = (
    "byte",
    "closest",
    "cubic",
    "mirror ball",
    "data",
    "data alpha",
    "wide gamut",
    "alpha",
    "float",
    "float alpha",
    "packed",
    "packed float",
    "generated",
    "missing",
    "none",
)


def world_of(path, case):
    """Make a world that shows the case's image; return its Environment Texture node."""
    import bpy

    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    bpy.context.scene.world = world
    tree = world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    background = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    tree.links.new(node.outputs[0], background.inputs[0])
    names = {"alpha": "alpha.png", "float": "float.exr", "packed float": "float.exr"}
    names |= {"float alpha": "alpha.exr", "data alpha": "alpha.png"}
    if case == "generated":
        node.image = bpy.data.images.new("Grid", 32, 16)
        node.image.generated_type = "COLOR_GRID"
    elif case == "missing":
        node.image = bpy.data.images.new("Lost", 1, 1)
        node.image.source, node.image.filepath = "FILE", str(path / "missing.png")
    elif case != "none":
        node.image = bpy.data.images.load(str(path / names.get(case, "byte.png")))
    if case.startswith("packed"):
        node.image.pack()
    if case.startswith("data"):
        node.image.colorspace_settings.name = "Non-Color"
    if case == "wide gamut":
        node.image.colorspace_settings.name = "Linear Rec.2020"
    if case == "mirror ball":
        node.projection = "MIRROR_BALL"
    if case in ("closest", "cubic"):
        node.interpolation = case.title()
    return node


def write(path):
    """Write the pictures that the cases read."""
    import OpenImageIO as oiio

    random = np.random.default_rng(1)
    colour = random.random((6, 12, 3)).astype(np.float32)
    alpha = np.concatenate([colour, random.random((6, 12, 1), np.float32)], axis=2)
    for name, pixels, kind in (
        ("byte.png", colour, "uint8"),
        ("alpha.png", alpha, "uint8"),
        ("float.exr", colour * 9, "half"),
        ("alpha.exr", alpha, "float"),
    ):
        spec = oiio.ImageSpec(12, 6, pixels.shape[2], kind)
        spec.attribute("oiio:UnassociatedAlpha", int(name == "alpha.png"))
        file = oiio.ImageOutput.create(str(path / name))
        file.open(str(path / name), spec)
        file.write_image(pixels)
        file.close()


def render_and_look_up(path, cases):
    """Return Cycles' pixels and ours of each case, both (H, W, 3), and the notes."""
    import bpy
    from inside import pixels

    from penumbra.addon.export.materials import export_tree
    from penumbra.core.arrays import F32
    from penumbra.core.images import MAGENTA
    from penumbra.core.images.files import load_image
    from penumbra.core.images.lookup import lookup
    from penumbra.core.images.projection import PROJECTIONS, equirectangular_invert

    write(path)
    found = {}
    width, height = 256, 128
    grid = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    direction = equirectangular_invert(*(each.ravel().astype(F32) for each in grid))
    for case in cases:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        node = world_of(path, case)
        notes = []
        background = export_tree(scene.world, "World", notes)
        properties = background.inputs["Color"].node.properties
        source = properties["image"]
        image = load_image(source, notes) if source else MAGENTA
        u, v = PROJECTIONS[properties["projection"]](direction)
        ours = lookup(image, u, v, properties["interpolation"])[:3]

        scene.render.engine = "CYCLES"
        scene.cycles.samples, scene.cycles.use_adaptive_sampling = 1, False
        scene.cycles.use_denoising = False
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
        scene.world.cycles.sampling_method = "NONE"
        scene.render.resolution_x, scene.render.resolution_y = width, height
        scene.render.resolution_percentage = 100
        camera = bpy.data.cameras.new("Camera")
        camera.type = "PANO"
        panorama = camera if hasattr(camera, "panorama_type") else camera.cycles
        panorama.panorama_type = "EQUIRECTANGULAR"
        scene.camera = bpy.data.objects.new("Camera", camera)
        scene.camera.rotation_euler = np.pi / 2, 0, -np.pi / 2
        scene.collection.objects.link(scene.camera)
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_depth = "OPEN_EXR", "32"
        scene.render.filepath = str(path / "out.exr")
        bpy.ops.render.render(write_still=True)
        theirs = pixels(path / "out.exr")[:, :, :3]
        found[case] = (
            theirs,
            np.moveaxis(ours.reshape(3, height, width), 0, 2),
            [(note.owner, note.what) for note in notes],
            node.image and node.image.name,
        )
    return found


@pytest.fixture(scope="module")
def seen(blender, tmp_path_factory):
    pytest.importorskip("OpenImageIO")
    return blender(render_and_look_up, tmp_path_factory.mktemp("images"), CASES)


@pytest.mark.parametrize("case", CASES)
def test_an_image_looks_as_in_cycles(seen, case):
    theirs, ours, notes, name = seen[case]
    assert theirs.mean() > 0.01
    error = np.abs(theirs - ours) / np.maximum(theirs, 0.1 * theirs.mean())
    assert np.median(error) < 1e-3
    assert np.quantile(error, 0.999) < 0.02  # the filter is 0.01 pixel wide, texels have edges
    assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)
    assert [owner for owner, _ in notes] == ([f"Image '{name}'"] if case == "missing" else [])


def sources(path):
    """Export images of every kind of source; return what was read of each, and the notes."""
    import bpy

    from penumbra.addon.export.images import export_image

    write(path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path / "file.blend"))
    found = {}

    def export(key, image, user=None):
        notes = []
        source = export_image(image, user, notes)
        pixels = None if source.pixels is None else (source.pixels.dtype.name, source.pixels.shape)
        found[key] = (source.path, pixels, [note.what for note in notes], source.alpha_mode)
        return source

    image = bpy.data.images.load(str(path / "alpha.png"))
    image.filepath = "//alpha.png"
    export("relative", image)
    image.alpha_mode = "CHANNEL_PACKED"
    export("alpha mode", image)
    image.pixels[0] = 0.5
    export("edited", image)
    first = bpy.data.images.load(str(path / "float.exr"))
    first.pack()
    found["packed is float"] = export("packed", first).pixels.dtype.name
    for source in ("SEQUENCE", "MOVIE", "TILED"):
        other = bpy.data.images.load(str(path / "byte.png"))
        other.source = source
        export(source, other)
    export("generated", bpy.data.images.new("New", 8, 4, float_buffer=True))
    found["config"] = export_image(image, None, []).config
    return found


def test_pixels_come_from_the_file_unless_blender_alone_has_them(blender, tmp_path):
    pytest.importorskip("OpenImageIO")
    found = blender(sources, tmp_path)
    path = str(tmp_path / "alpha.png")
    assert found["relative"] == (path, None, [], "STRAIGHT")
    assert found["alpha mode"] == (path, None, [], "CHANNEL_PACKED")
    assert found["edited"][:2] == ("", ("uint8", (6, 12, 4)))
    assert found["packed"][0] == ""
    assert found["packed is float"] == "float32"
    assert found["generated"][:2] == ("", ("float32", (4, 8, 4)))
    assert found["SEQUENCE"][2] == []
    assert "magenta" in found["MOVIE"][2][0]
    assert found["MOVIE"][:2] == ("", None)
    assert found["TILED"][2] == []
    assert found["config"].endswith("config.ocio")


def second_renders(path):
    """Render a packed image again and again; return what was read and what was seen."""
    import bpy
    from inside import add, empty_scene, mesh, pixels, use_exr

    from penumbra.addon import engine
    from penumbra.addon.export import images

    write(path)
    scene = empty_scene(8, 8)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1
    image = bpy.data.images.load(str(path / "byte.png"))
    image.pack()
    material = bpy.data.materials.new("Shown")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    glow, shown = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeTexImage")
    shown.image = image
    tree.links.new(shown.outputs[0], glow.inputs["Color"])
    tree.links.new(glow.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    plane = mesh("Plane", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)])
    plane.materials.append(material)
    plane.uv_layers.new(name="UV").data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])
    add("Plane", plane)
    use_exr(scene, path / "out.exr")
    asked, original = [], images._pixels

    def counted(image):
        asked.append(image.name)
        return original(image)

    def render():
        bpy.ops.render.render(write_still=True)
        return len(asked), pixels(path / "out.exr")[:, :, :3]

    images._pixels = counted
    try:
        found = [render(), render()]
        image.colorspace_settings.name = "Non-Color"
        found.append(render())
        black = np.zeros(len(image.pixels), np.float32)
        image.pixels.foreach_set(black)
        found.append(render())
        image.pack()
        found += [render(), render()]
    finally:
        images._pixels = original
    engine.shelf.put("something", images.Pixels(black))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return found, engine.shelf.find("something") is None


def test_a_packed_image_is_taken_from_blender_once_and_again_when_it_changes(blender, tmp_path):
    pytest.importorskip("OpenImageIO")
    found, is_empty = blender(second_renders, tmp_path)
    counts, seen = zip(*found, strict=True)
    assert counts == (1, 1, 2, 3, 4, 4)
    assert seen[0].mean() > 0.05
    np.testing.assert_array_equal(seen[0], seen[1])
    assert seen[2].mean() > 1.1 * seen[1].mean()
    assert not seen[3].any() and not seen[4].any() and not seen[5].any()
    assert is_empty


def skies():
    """Return the properties of an exported Sky Texture."""
    import bpy

    from penumbra.addon.export.materials import export_tree

    bpy.ops.wm.read_factory_settings(use_empty=True)
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    tree = world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sun_direction = (0, 1, 0)
    background = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    tree.links.new(sky.outputs[0], background.inputs[0])
    node = export_tree(world, "World", []).inputs["Color"].node
    return dict(node.properties)


def test_a_sky_brings_all_that_its_model_needs(blender):
    from penumbra.core.shading.sky import compile_sky

    properties = blender(skies)
    assert properties["sun_direction"] == pytest.approx((0, 1, 0))
    assert properties["working_space"] == "Linear Rec.709"
    for kind in ("SINGLE_SCATTERING", "MULTIPLE_SCATTERING", "PREETHAM"):
        assert compile_sky(properties | {"sky_type": kind}) is not None


def simplified():
    """Return the limits of an image's source before and after Simplify, in pictures and views."""
    import bpy
    import inside

    from penumbra.addon.export.images import Images
    from penumbra.addon.export.known import Known

    scene = inside.empty_scene()
    image = bpy.data.images.new("Picture", 8, 8)
    scene.cycles.texture_limit, scene.cycles.texture_limit_render = "128", "256"
    found = []
    known = {True: Known(), False: Known()}
    for use in (False, True, True):
        scene.render.use_simplify = use
        for is_viewport in (False, True):
            images = Images([], scene, known[is_viewport], is_viewport)
            source = images.noting([]).export(image, None)
            found.append((source.side, id(source)))
    return found


def test_simplify_limits_images_as_pictures_and_viewports_ask(blender):
    found = blender(simplified)
    assert [side for side, _ in found] == [0, 0, 256, 128, 256, 128]
    assert found[2:4] == found[4:6]  # the same sources
