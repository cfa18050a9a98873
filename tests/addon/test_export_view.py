"""The core's camera looks exactly where Blender's does."""

import numpy as np


def project(camera, points):
    """Return pixel coordinates (N, 2) of world points, from the lower left corner."""
    rotation, position = camera.to_world[:, :3], camera.to_world[:, 3]
    local = (points - position) @ rotation
    if camera.projection == "PERSP":
        local = local / -local[:, 2:]
    left, right, bottom, top = camera.window
    x = (local[:, 0] - left) / (right - left) * camera.width
    y = (local[:, 1] - bottom) / (top - bottom) * camera.height
    return np.stack([x, y], axis=1)


def random_cameras(number):
    import bpy
    from inside import empty_scene, exported
    from mathutils import Euler, Vector

    scene = empty_scene()
    rng = np.random.default_rng(3)
    item = scene.camera
    data, render = item.data, scene.render
    depsgraph = bpy.context.evaluated_depsgraph_get()
    cases = []
    for _ in range(number):
        data.type = ("PERSP", "ORTHO")[rng.integers(2)]
        data.sensor_fit = ("AUTO", "HORIZONTAL", "VERTICAL")[rng.integers(3)]
        data.sensor_width, data.sensor_height = rng.uniform(5, 60, 2)
        data.lens, data.ortho_scale = rng.uniform(10, 90), rng.uniform(0.1, 20)
        data.shift_x, data.shift_y = rng.uniform(-1, 1, 2)
        data.clip_start, data.clip_end = 0.01, 500
        render.resolution_x, render.resolution_y = map(int, rng.integers(4, 90, 2))
        render.resolution_percentage = int(rng.choice([25, 50, 100, 130]))
        render.pixel_aspect_x, render.pixel_aspect_y = rng.uniform(1, 3, 2)
        item.location = rng.uniform(-5, 5, 3)
        item.rotation_euler = Euler(rng.uniform(-4, 4, 3))
        item.scale = rng.uniform(0.2, 4, 3)
        size = [
            int(side * render.resolution_percentage / 100)
            for side in (render.resolution_x, render.resolution_y)
        ]
        core_scene, _ = exported()
        rigid = item.matrix_world.normalized()
        points = [rigid @ Vector((*rng.uniform(-3, 3, 2), -rng.uniform(0.5, 9))) for _ in range(4)]
        clip = (
            item.calc_matrix_camera(
                depsgraph,
                x=size[0],
                y=size[1],
                scale_x=render.pixel_aspect_x,
                scale_y=render.pixel_aspect_y,
            )
            @ rigid.inverted()
        )
        expected = []
        for point in points:
            x, y, _, w = clip @ point.to_4d()
            expected.append((0.5 + 0.5 * x / w, 0.5 + 0.5 * y / w))
        cases.append((core_scene.camera, size, np.array(points), np.array(expected)))
    return cases


def test_random_cameras_project_as_blender_does(blender):
    for camera, size, points, expected in blender(random_cameras, 80):
        assert [camera.width, camera.height] == size
        actual = project(camera, points) / (camera.width, camera.height)
        scale = max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(actual, expected, atol=1e-4 * scale, err_msg=str(camera))
        gram = camera.to_world[:, :3].T @ camera.to_world[:, :3]
        np.testing.assert_allclose(gram, np.eye(3), atol=1e-5)
        assert camera.border == (0, 0, camera.width, camera.height)


def borders():
    from inside import empty_scene, exported

    scene = empty_scene(41, 31)
    render = scene.render
    cases = []
    rng = np.random.default_rng(5)
    render.use_border = True
    for _ in range(25):
        x0, x1 = sorted(rng.uniform(0, 1, 2))
        y0, y1 = sorted(rng.uniform(0, 1, 2))
        x1, y1 = min(1.0, x1 + 0.05), min(1.0, y1 + 0.05)
        render.border_min_x, render.border_max_x = x0, x1
        render.border_min_y, render.border_max_y = y0, y1
        pair = []
        for crop in (False, True):
            render.use_crop_to_border = crop
            pair.append(exported()[0].camera)
        cases.append(((x0, y0, x1, y1), pair))
    return cases


def test_a_border_is_the_same_part_of_the_frame_with_and_without_crop(blender):
    for (x0, y0, x1, y1), (kept, cropped) in blender(borders):
        assert kept.border == cropped.border
        assert kept.window == cropped.window
        assert (kept.width, kept.height) == (41, 31)
        np.testing.assert_allclose(kept.border, (x0 * 41, y0 * 31, x1 * 41, y1 * 31), atol=1.0001)


def animated_camera():
    import bpy
    from inside import empty_scene, exported

    scene = empty_scene()
    scene.frame_set(12)
    scene.render.film_transparent = True
    data = scene.camera.data
    data.clip_start, data.clip_end = 0.25, 33.0
    data.lens = 20.0
    data.keyframe_insert("lens", frame=1)
    data.lens = 80.0
    data.keyframe_insert("lens", frame=12)
    return exported()[0], bpy.app.version


def test_clipping_frame_and_transparency_are_handed_over(blender):
    scene, version = blender(animated_camera)
    assert (scene.camera.clip_start, scene.camera.clip_end) == (0.25, 33.0)
    left, right, _, _ = scene.camera.window
    np.testing.assert_allclose(right - left, 36.0 / 80.0, rtol=1e-6)
    assert scene.frame == 12
    assert scene.film_transparent is True
    assert scene.spare_passes == (version < (5, 0))


# --- Lenses -------------------------------------------------------------------------------------


def lenses():
    import bpy
    from inside import add, empty_scene, exported
    from mathutils import Euler

    scene = empty_scene()
    item = scene.camera
    data, dof = item.data, item.data.dof
    found = {"off": exported()[0].camera.aperture}
    dof.use_dof = True
    data.lens, dof.aperture_fstop, dof.focus_distance = 80.0, 0.5, 3.5
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 7, 0.25, 1.5
    found["perspective"] = exported()[0].camera.aperture
    scene.unit_settings.scale_length = 0.01
    found["centimetres"] = exported()[0].camera.aperture
    data.type = "PANO"
    found["panorama"] = exported()[0].camera.aperture
    data.type = "ORTHO"
    found["orthographic"] = exported()[0].camera.aperture
    dof.focus_distance = 0.0
    found["at the lens"] = exported()[0].camera.aperture

    # An object aside and behind, seen by a turned and scaled camera; a bone of an armature
    item.location, item.rotation_euler, item.scale = (1, 2, 3), Euler((0.4, 0.5, 0.6)), (2, 2, 2)
    target = add("Target", None, location=(-3, 4, 1))
    dof.focus_object = target
    found["object"] = exported()[0].camera.aperture
    axis = item.matrix_world.normalized().col[2].to_3d()
    expected = {"object": abs(axis.dot(target.matrix_world.translation - item.location))}

    armature = bpy.data.armatures.new("Armature")
    rig = add("Rig", armature, location=(5, 1, 0), rotation_euler=(0.1, 0.2, 1.0))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.edit_bones.new("Finger")
    bone.head, bone.tail = (1, 0, 2), (1, 0, 3)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.pose.bones["Finger"].location = (0, 0.5, 0)
    dof.focus_object, dof.focus_subtarget = rig, "Finger"
    found["bone"] = exported()[0].camera.aperture
    head = rig.matrix_world @ rig.pose.bones["Finger"].matrix.translation
    expected["bone"] = abs(axis.dot(head - item.location))
    dof.focus_subtarget = "Nobody"
    found["no such bone"] = exported()[0].camera.aperture
    expected["no such bone"] = abs(axis.dot(rig.matrix_world.translation - item.location))
    return found, expected


def test_apertures_have_the_size_and_the_focus_of_blenders(blender):
    found, expected = blender(lenses)
    assert found["off"] is None
    first = found["perspective"]
    np.testing.assert_allclose(first.radius, 0.080 / 0.5 / 2, rtol=1e-6)  # half of lens / f-stop
    assert (first.focus, first.blades, first.rotation, first.ratio) == (3.5, 7, 0.25, 1.5)
    assert found["centimetres"] == first  # millimetres are thousandths of the unit, whatever it is
    assert found["panorama"] == first
    np.testing.assert_allclose(found["orthographic"].radius, 1 / 0.5 / 2, rtol=1e-6)
    np.testing.assert_allclose(found["at the lens"].focus, 1e-5)
    assert len({round(value, 3) for value in expected.values()}) == 3
    for name, focus in expected.items():
        np.testing.assert_allclose(found[name].focus, focus, rtol=1e-5)


def eyes():
    from inside import empty_scene

    scene = empty_scene()
    render, data = scene.render, scene.camera.data
    stereo = data.stereo
    stereo.interocular_distance, stereo.convergence_distance = 0.2, 3.0
    stereo.pole_merge_angle_from, stereo.pole_merge_angle_to = 0.5, 1.0
    stereo.use_spherical_stereo = True
    found = {"one eye": views()}
    render.use_multiview = True
    for mode in ("OFFAXIS", "PARALLEL", "TOE"):
        stereo.convergence_mode = mode
        found[mode] = views()
    stereo.use_pole_merge = True
    found["poles"] = views()
    data.type, stereo.convergence_mode = "ORTHO", "PARALLEL"
    found["orthographic"] = views()
    data.type, stereo.use_spherical_stereo = "PERSP", False
    found["flat"] = views()
    return found


def views():
    """Press F12; return the cameras of all views."""
    import bpy

    from penumbra import core

    seen, original = [], core.compile_plan

    def compile_plan(scene, settings, **_):
        seen.append(scene.camera)
        return original(scene, settings)

    core.compile_plan = compile_plan
    try:
        bpy.ops.render.render()
    finally:
        core.compile_plan = original
    return seen


def test_eyes_of_spherical_stereo_are_in_the_core_and_others_in_the_matrix(blender):
    found = blender(eyes)
    (only,) = found["one eye"]
    assert only.eye is None
    for mode, distance in (("OFFAXIS", 3.0), ("PARALLEL", np.inf), ("TOE", 3.0)):
        left, right = found[mode]
        np.testing.assert_allclose((left.eye.offset, right.eye.offset), (-0.1, 0.1), rtol=1e-6)
        assert left.eye.convergence == right.eye.convergence == distance
        assert left.eye.poles is None
        np.testing.assert_array_equal(left.to_world, only.to_world)
        assert left.window == right.window == only.window
    np.testing.assert_allclose(found["poles"][0].eye.poles, (0.5, 1.0))
    for name in ("orthographic", "flat"):
        left, right = found[name]
        assert left.eye is None
        assert right.eye is None
        np.testing.assert_allclose(right.to_world[0, 3] - left.to_world[0, 3], 0.2, rtol=1e-5)


def other_views():
    import bpy
    from inside import add, empty_scene, exported

    scene = empty_scene(20, 10)
    camera = scene.camera
    spot = bpy.data.lights.new("Spot", "SPOT")
    spot.spot_size = 1.0
    things = {
        "spot": add("Spot", spot),
        "lamp": add("Lamp", bpy.data.lights.new("Lamp", "POINT")),
        "empty": add("Empty", None, location=(1, 2, 3), scale=(2, 3, 4)),
    }
    found = {}
    for name, thing in things.items():
        scene.camera = thing
        found[name] = exported()[0]
    scene.camera = camera
    if bpy.app.version >= (5, 0):
        camera.data.type = "CUSTOM"
        found["custom"] = exported()[0]
    return found


def test_what_is_no_camera_is_looked_through_and_custom_cameras_are_told(blender):
    found = blender(other_views)
    custom = found.pop("custom", None)
    for name, lens in (("spot", 16 / np.tan(0.5)), ("lamp", 16 / np.tan(np.pi / 8)), ("empty", 50)):
        camera = found[name].camera
        np.testing.assert_allclose(camera.window[1], 18 / lens, rtol=1e-5)
        np.testing.assert_allclose(camera.window[3], 9 / lens, rtol=1e-5)
        assert camera.projection == "PERSP"
        assert found[name].notes == ()
    expected = [(1, 0, 0, 1), (0, 1, 0, 2), (0, 0, 1, 3)]
    np.testing.assert_allclose(found["empty"].camera.to_world, expected)
    if custom is not None:
        assert custom.camera.projection == "PERSP"
        (note,) = custom.notes
        assert note.owner == "Camera 'Camera'"
        assert note.what.startswith("custom (OSL) cameras are not supported")
