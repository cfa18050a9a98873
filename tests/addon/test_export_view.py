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
    return exported()[0]


def test_clipping_frame_and_transparency_are_handed_over(blender):
    scene = blender(animated_camera)
    assert (scene.camera.clip_start, scene.camera.clip_end) == (0.25, 33.0)
    left, right, _, _ = scene.camera.window
    np.testing.assert_allclose(right - left, 36.0 / 80.0, rtol=1e-6)
    assert scene.frame == 12
    assert scene.film_transparent is True
