"""points and worlds of Blender -> stars of the core, and their picture."""

import math

import numpy as np
import pytest

FOUR_PI = 4 * math.pi


def described():
    """Stars of all sorts; return what the core gets of them."""
    import bpy
    from inside import add, empty_scene, exported, mesh

    scene = empty_scene()

    def star(name, data, **properties):
        item = add(name, data, **properties)
        item.penumbra.use_stars = True
        return item

    def attribute(data, name, kind, field, values, domain="POINT"):
        data.attributes.new(name, kind, domain).data.foreach_set(field, np.ravel(values))

    # A mesh with modifiers, scaled: its power stays
    plain = star("Plain", mesh("Plain"), location=(1, 2, 3), scale=(2, 2, 2))
    plain.penumbra.star_strength = FOUR_PI
    plain.modifiers.new("Array", "ARRAY").count = 2

    # Numbers of its own for each point
    data = mesh("Own")
    attribute(data, "star_strength", "FLOAT", "value", [1, 2, 4])
    attribute(data, "star_temperature", "FLOAT", "value", [0, 2000, 0])
    attribute(
        data, "star_color", "FLOAT_COLOR", "color", [[1, 1, 1, 1], [1, 1, 1, 1], [0, 1, 0, 1]]
    )
    star("Own", data).penumbra.star_strength = FOUR_PI
    wrong = mesh("Wrong")
    attribute(wrong, "star_strength", "FLOAT", "value", [9], domain="FACE")
    star("Wrong", wrong)
    star("Warm", mesh("Warm")).penumbra.star_temperature = 3000

    # Points without faces, of Blender and of geometry nodes
    star("Loose", mesh("Loose", ((0, 0, 0), (5, 0, 0)), ()))
    tree = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    points, out = tree.nodes.new("GeometryNodePoints"), tree.nodes.new("NodeGroupOutput")
    points.inputs["Count"].default_value = 7
    tree.links.new(points.outputs[0], out.inputs[0])
    star("Cloud", mesh("Cloud")).modifiers.new("Points", "NODES").node_group = tree
    add("Other", mesh("Other")).modifiers.new("Points", "NODES").node_group = tree
    star("Own cloud", bpy.data.pointclouds.new("Empty"))

    # Not seen, and instances
    star("Unseen", mesh("Unseen")).visible_camera = False
    star("Held out", mesh("Held")).is_holdout = True
    collection = bpy.data.collections.new("Shown")
    inner = add("Inner", mesh("Inner", ((0, 0, 0),), ()), collection)
    inner.penumbra.use_stars = True
    for name, x in (("First", 1), ("Second", 2)):
        add(name, None, instance_type="COLLECTION", instance_collection=collection).location.x = x
    add("Faces", mesh("Faces"))

    scene.world = world = bpy.data.worlds.new("World")
    found, _ = exported()
    world.penumbra.use_stars = True
    world.penumbra.star_count = 77
    field, _ = exported()
    stars = [
        (each.name, each.mesh.positions, each.to_world, each.intensity, each.motion)
        for each in found.stars
    ]
    faces = [instance.name for instance in found.instances]
    return stars, faces, found.notes, found.world.stars, field.world.stars


@pytest.fixture(scope="module")
def found(blender):
    return blender(described)


def of(found, name):
    return next(rest for each, *rest in found[0] if each == name)


def test_points_of_modified_meshes_are_stars_in_place_of_faces(found):
    positions, to_world, intensity, motion = of(found, "Plain")
    assert positions.shape == (6, 3)
    assert to_world[:, 3].tolist() == [1, 2, 3]
    np.testing.assert_allclose(intensity, 1, rtol=1e-6)
    assert motion is None
    assert found[1] == ["Faces"]


def test_points_may_have_strength_temperature_and_colour_of_their_own(found):
    _, _, intensity, _ = of(found, "Own")
    np.testing.assert_allclose(intensity[0], 1, rtol=1e-6)
    np.testing.assert_allclose(intensity[2], (0, 4, 0), rtol=1e-6)
    luminance = intensity[1] @ (0.2126, 0.7152, 0.0722)
    assert 1.9 < luminance < 2.2  # what is below 0 in blue is cut off
    assert intensity[1][0] > 2 * intensity[1][1] > 2 * intensity[1][2]
    _, _, warm, _ = of(found, "Warm")
    assert (warm == warm[0]).all()
    assert warm[0][0] > warm[0][1] > warm[0][2]


def test_attributes_that_are_not_of_points_are_named(found):
    notes = [note for note in found[2] if note.owner == "Object 'Wrong'"]
    assert [note.what for note in notes] == [
        "its attribute 'star_strength' is not one of points, and does not count"
    ]
    np.testing.assert_allclose(of(found, "Wrong")[2], 1 / FOUR_PI, rtol=1e-6)


def test_point_clouds_and_loose_vertices_are_stars(found):
    assert len(of(found, "Loose")[0]) == 2
    assert len(of(found, "Cloud")[0]) == 7
    names = [each[0] for each in found[0]]
    assert names.count("Cloud") == 1
    owners = [note.owner for note in found[2] if "point clouds" in note.what]
    assert owners == ["Object 'Other'"]


def test_stars_are_hidden_and_instanced_like_other_objects(found):
    names = [each[0] for each in found[0]]
    assert not {"Unseen", "Held out", "Own cloud"} & set(names)
    places = sorted(rest[1][0, 3] for name, *rest in found[0] if name == "Inner")
    assert places == [1, 2]


def test_a_world_has_stars_if_it_is_asked_for(found):
    _, _, _, without, field = found
    assert without is None
    assert field.count == 77
    assert field.irradiance == pytest.approx(1e-6)
    rows = np.array(field.rgb_of_xyz)
    np.testing.assert_allclose(rows.sum(axis=1)[1], rows[1].sum())
    np.testing.assert_allclose(rows @ (0.9505, 1.0, 1.089), 1, atol=2e-3)  # D65 is white


def moving():
    """Stars that move, deform and rest; return their motion, and the sums of two pictures."""
    import bpy
    from inside import add, empty_scene, exported, mesh, pixels, use_exr

    scene = empty_scene(32, 32)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 1.0
    mover = add("Mover", mesh("Mover"))
    for frame, x in ((0, -1.0), (2, 1.0)):
        mover.location.x = x
        mover.keyframe_insert("location", frame=frame)
    bent = add("Bent", mesh("Bent", faces=()))
    bent.shape_key_add(name="Basis")
    key = bent.shape_key_add(name="Up")
    key.data[2].co.z = 1.0
    for frame, value in ((0, 0.0), (2, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    flying = mesh("Flying", ((0, 0, 0),), ())
    speed = flying.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    speed.data.foreach_set("vector", [24.0, 0.0, 0.0])
    add("Flying", flying)
    add("Rest", mesh("Rest"))
    for item in scene.objects:
        item.penumbra.use_stars = item.type == "MESH"
    found, _ = exported()
    motion = {
        each.name: (
            None if each.motion is None else each.motion[:, 0, 3],
            None if each.mesh.deformation is None else each.mesh.deformation.positions,
        )
        for each in found.stars
    }

    # A point light of no size that the camera sees, in Blender's watts, is a star
    for item in list(scene.objects):
        if item.type == "MESH":
            bpy.data.objects.remove(item)
    scene.render.use_motion_blur = False
    dot = add("Dot", mesh("Dot", ((0, 0, 0),), ()))
    dot.penumbra.use_stars, dot.penumbra.star_strength = True, 100.0
    path = f"{bpy.app.tempdir}/stars.exr"
    use_exr(scene, path)
    bpy.ops.render.render(write_still=True)
    star = pixels(path)[..., :3].sum(axis=(0, 1))
    bpy.data.objects.remove(dot)
    light = bpy.data.lights.new("Light", "POINT")
    light.energy, light.shadow_soft_size = 100.0, 0.3
    add("Light", light, visible_camera=True)
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 256, False
    scene.cycles.use_denoising = False
    bpy.ops.render.render(write_still=True)
    return motion, star, pixels(path)[..., :3].sum(axis=(0, 1))


def test_stars_move_and_have_the_watts_of_point_lights(blender):
    motion, star, lamp = blender(moving)
    x, deformation = motion["Mover"]
    np.testing.assert_allclose(x[[0, -1]], (-0.6875, 0.6875), atol=1e-3)  # keys ease in and out
    assert deformation is None
    x, deformation = motion["Bent"]
    assert x is None
    np.testing.assert_allclose(deformation[[0, -1], 2, 2], (0.15625, 0.84375), atol=1e-3)
    np.testing.assert_allclose(motion["Flying"][1][:, 0, 0], (-0.5, 0.5), atol=1e-6)
    assert motion["Rest"] == (None, None)
    np.testing.assert_allclose(star, lamp, rtol=0.01)
