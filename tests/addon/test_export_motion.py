"""keyframes in Blender -> motion in the core: who moves, when, in how many steps."""

import numpy as np
import pytest


def animated(shutter=1.0, position="CENTER", blurs=True, asks_for_vectors=False):
    """Everything that can move, in frame 1 between keys at 0 and 2; return the core's scene."""
    import bpy
    from inside import add, empty_scene, exported, mesh

    def keyed(owner, name, values):
        for frame, value in zip((0, 2), values, strict=True):
            setattr(owner, name, value)
            owner.keyframe_insert(name, frame=frame)
        action = owner.id_data.animation_data.action
        curves = action.fcurves if hasattr(action, "fcurves") else None
        if curves is None:
            curves = action.layers[0].strips[0].channelbags[0].fcurves
        for curve in curves:
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"

    scene = empty_scene()
    scene.render.use_motion_blur = blurs
    scene.view_layers[0].use_pass_vector = asks_for_vectors
    scene.render.motion_blur_shutter = shutter
    scene.render.motion_blur_position = position
    add("Rest", mesh())
    mover = add("Mover", mesh())
    keyed(mover, "location", ((-2, 0, 0), (2, 0, 0)))
    add("Child", mesh(), parent=mover, location=(0, 1, 0))
    follower = add("Follower", mesh())
    follower.constraints.new("COPY_LOCATION").target = mover
    fine = add("Fine", mesh())
    keyed(fine, "rotation_euler", ((0, 0, 0), (0, 0, 2)))
    fine.cycles.motion_steps = 3
    still = add("Still", mesh())
    keyed(still, "location", ((0, -2, 0), (0, 2, 0)))
    still.penumbra.use_motion_blur = False

    # Deformation, by shape keys; with and without it, and with faces that change
    for name in ("Bent", "Stiff"):
        bent = add(name, mesh(name))
        bent.shape_key_add(name="Basis")
        key = bent.shape_key_add(name="Up")
        key.data[2].co.z = 1.0
        keyed(key, "value", (0.0, 1.0))
    bent.cycles.use_deform_motion = False
    growing = add("Growing", mesh("Growing"))
    keyed(growing.modifiers.new("Array", "ARRAY"), "count", (1, 5))

    # Instances, and a child of what makes them
    collection = bpy.data.collections.new("Shown")
    add("Inner", mesh("Inner"), collection)
    maker = add("Maker", None, instance_type="COLLECTION", instance_collection=collection)
    keyed(maker, "location", ((0, 0, -1), (0, 0, 1)))

    for name in ("Lamp", "Dark"):
        lamp = add(name, bpy.data.lights.new(name, "POINT"))
        keyed(lamp, "location", ((0, 0, 1), (0, 0, 3)))
    bpy.data.lights["Lamp"].penumbra.use_motion_blur = True
    keyed(scene.camera.data, "lens", (30.0, 50.0))
    dof = scene.camera.data.dof
    dof.use_dof, dof.aperture_fstop = True, 0.5
    keyed(dof, "focus_distance", (4.0, 8.0))
    scene.frame_set(1)
    found, _ = exported()
    return found, scene.frame_current, scene.frame_subframe


@pytest.fixture(scope="module")
def moving(blender):
    return blender(animated)


def by_name(scene):
    return {each.name: each for each in (*scene.instances, *scene.lamps)}


def path(thing):
    """Where a thing is at its steps: (K, 3)."""
    return thing.motion[:, :, 3]


def test_objects_go_where_their_keys_and_what_they_follow_say(moving):
    things = by_name(moving[0])
    for name, aside in (("Mover", 0), ("Child", 1), ("Follower", 0)):
        expected = [(-1, aside, 0), (0, aside, 0), (1, aside, 0)]
        np.testing.assert_allclose(path(things[name]), expected, atol=1e-6)
    np.testing.assert_allclose(path(things["Inner"])[:, 2], (-0.5, 0, 0.5), atol=1e-6)


def test_steps_are_those_of_the_object(moving):
    turn = by_name(moving[0])["Fine"].motion
    np.testing.assert_allclose(
        np.arctan2(turn[:, 1, 0], turn[:, 0, 0]), np.linspace(0.5, 1.5, 9), atol=1e-6
    )


def test_what_rests_or_is_not_blurred_has_no_motion(moving):
    things = by_name(moving[0])
    for name in ("Rest", "Still", "Bent", "Stiff", "Growing", "Dark"):
        assert things[name].motion is None, name
    for name in ("Rest", "Mover", "Stiff", "Growing", "Inner"):
        assert things[name].mesh.deformation is None, name


def test_meshes_deform_step_by_step(moving):
    shapes = by_name(moving[0])["Bent"].mesh.deformation
    np.testing.assert_allclose(shapes.positions[:, 2, 2], (0.25, 0.5, 0.75), atol=1e-6)


def test_faces_that_change_are_not_blurred_and_noted(moving):
    notes = [(note.owner, note.what) for note in moving[0].notes]
    assert [owner for owner, _ in notes] == ["Object 'Growing'"]
    assert "faces change" in notes[0][1]


def test_a_lamp_moves_if_it_is_told_to(moving):
    things = by_name(moving[0])
    np.testing.assert_allclose(path(things["Lamp"])[:, 2], (1.5, 2, 2.5), atol=1e-6)


def test_the_camera_zooms(moving):
    camera = moving[0].camera
    widths = [step.window[1] - step.window[0] for step in camera.motion]
    np.testing.assert_allclose(widths, [36 / lens for lens in (35, 40, 45)], rtol=1e-5)


def test_the_lens_focuses_at_other_distances_and_is_as_wide_as_its_length_says(moving):
    lenses = [step.aperture for step in moving[0].camera.motion]
    np.testing.assert_allclose([lens.focus for lens in lenses], (5, 6, 7), rtol=1e-6)
    np.testing.assert_allclose([lens.radius for lens in lenses], (0.035, 0.04, 0.045), rtol=1e-6)


def test_the_frame_is_what_it_was(moving):
    assert moving[1:] == (1, 0.0)


@pytest.mark.parametrize(
    ("position", "first", "middle"), [("START", 0.0, 0.5), ("CENTER", -0.5, 0.0), ("END", -1, -0.5)]
)
def test_the_shutter_opens_when_the_scene_says(blender, position, first, middle):
    found, *_ = blender(animated, 0.5, position)
    things = by_name(found)
    np.testing.assert_allclose(path(things["Mover"])[:, 0], [first, middle, first + 1], atol=1e-6)
    np.testing.assert_allclose(things["Still"].to_world[1, 3], middle, atol=1e-6)


def test_without_motion_blur_nothing_moves(blender):
    found, *_ = blender(animated, 1.0, "CENTER", False)
    assert not any(each.motion is not None for each in by_name(found).values())
    assert not any(each.mesh.deformation for each in found.instances)
    assert found.camera.motion == () and found.shutter is None


@pytest.fixture(scope="module")
def from_frame_to_frame(blender):
    return blender(animated, 0.5, "START", False, True)


def test_for_vectors_all_objects_are_read_in_the_frames_before_and_after(from_frame_to_frame):
    found, *frame = from_frame_to_frame
    things = by_name(found)
    assert found.spans_frames and found.shutter is None and frame == [1, 0.0]
    np.testing.assert_allclose(path(things["Mover"])[:, 0], (-2, 0, 2), atol=1e-6)
    np.testing.assert_allclose(path(things["Still"])[:, 1], (-2, 0, 2), atol=1e-6)
    np.testing.assert_allclose(path(things["Inner"])[:, 2], (-1, 0, 1), atol=1e-6)
    for name in ("Bent", "Stiff"):
        shapes = things[name].mesh.deformation.positions
        np.testing.assert_allclose(shapes[:, 2, 2], (0, 0.5, 1), atol=1e-6)
    assert len(things["Fine"].motion) == 3
    assert things["Rest"].motion is None and things["Lamp"].motion is None


def test_for_vectors_the_camera_zooms_from_frame_to_frame(from_frame_to_frame):
    widths = [step.window[1] - step.window[0] for step in from_frame_to_frame[0].camera.motion]
    np.testing.assert_allclose(widths, [36 / lens for lens in (30, 40, 50)], rtol=1e-5)


def test_faces_that_change_have_no_vectors_and_are_noted(from_frame_to_frame):
    notes = [(note.owner, note.what) for note in from_frame_to_frame[0].notes]
    text = "its faces change from frame to frame: Vector does not show its deformation"
    assert notes == [("Object 'Growing'", text)]


def curve_scene():
    from inside import add, empty_scene, exported, mesh

    scene = empty_scene()
    add("Triangle", mesh())
    even = exported()[0].shutter
    scene.render.use_motion_blur = True
    still = exported()[0].shutter
    mapping = scene.render.motion_blur_shutter_curve
    mapping.curves[0].points[0].location = (0, 0)
    mapping.update()
    return even, still, exported()[0].shutter


def test_the_curve_of_the_shutter_is_read(blender):
    off, even, curve = blender(curve_scene)
    assert off is None and even is None
    assert curve[0] == pytest.approx(0, abs=1e-6) and curve[-1] == pytest.approx(1, abs=1e-6)
    assert len(curve) == 256


def flying(blurs=True):
    from inside import add, empty_scene, exported, mesh

    scene = empty_scene()
    scene.render.use_motion_blur = blurs
    scene.view_layers[0].use_pass_vector = not blurs
    scene.render.motion_blur_shutter = 0.5
    scene.render.fps = 25
    data = mesh()
    speed = data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    for item in speed.data:
        item.vector = (50, 0, 0)
    add("Spray", data)
    return exported()[0]


def test_the_velocity_of_vertices_takes_the_place_of_other_frames(blender):
    (spray,) = blender(flying).instances
    moved = spray.mesh.deformation.positions - spray.mesh.positions
    np.testing.assert_allclose(moved[:, :, 0], [[-0.5] * 3, [0.5] * 3], atol=1e-6)


def test_for_vectors_velocity_counts_from_frame_to_frame(blender):
    (spray,) = blender(flying, False).instances
    moved = spray.mesh.deformation.positions - spray.mesh.positions
    np.testing.assert_allclose(moved[:, :, 0], [[-2.0] * 3, [2.0] * 3], atol=1e-6)
