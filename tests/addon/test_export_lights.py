"""Lights keep Blender's units; the golden values are measured with Cycles 5.2."""

import math

import numpy as np
import pytest

PLANE_AT_2M = 0.633254  # radiance of a white plane, 2 m from a point light of 100 W


def lights():
    import bpy
    from inside import add, empty_scene, exported

    empty_scene()
    made = {}

    def light(name, kind, item=None, **properties):
        data = made[name] = bpy.data.lights.new(name, kind)
        data.use_shadow = True
        for key, value in properties.items():
            if hasattr(data, key):
                setattr(data, key, value)
        add(name, data, **(item or {}))
        return data

    old = bpy.app.version < (4, 5)
    light("Point", "POINT", energy=100, shadow_soft_size=0.3, use_soft_falloff=False)
    light(
        "Dim",
        "POINT",
        {"scale": (3, 3, 3)},
        energy=100,
        color=(0.5, 0.25, 1.0),
        shadow_soft_size=0.2,
    )
    light(
        "Spot",
        "SPOT",
        {"scale": (1, 2, 1)},
        energy=100,
        spot_size=1.0,
        spot_blend=0.4,
        shadow_soft_size=0.1,
    )
    light("Sun", "SUN", energy=3, angle=0.1)
    light("Square", "AREA", {"scale": (2, 3, 1)}, energy=100, shape="SQUARE", size=0.5, spread=1.2)
    light("Ellipse", "AREA", energy=100, shape="ELLIPSE", size=0.5, size_y=2.0)
    light("Disk", "AREA", energy=100, shape="DISK", size=0.5, size_y=2.0)
    light("Rectangle", "AREA", energy=100, shape="RECTANGLE", size=0.5, size_y=2.0)
    light("Nothing", "AREA", {"scale": (0, 1, 1)}, energy=100)
    light("Off", "POINT", energy=0)
    light("Bright", "POINT", energy=100, exposure=2.0)
    light("RawPoint", "POINT", energy=100, shadow_soft_size=0.3, normalize=False)
    light("RawDot", "POINT", energy=100, shadow_soft_size=0.0, normalize=False)
    light("RawSun", "SUN", energy=3, angle=0.1, normalize=False)
    light("RawArea", "AREA", energy=100, size=0.5, normalize=False)
    warm = light("Warm", "POINT", energy=100, use_temperature=True, temperature=3000)
    portal = light("Portal", "AREA")
    portal.cycles.is_portal = True
    light("Seen", "POINT", {"visible_camera": True, "visible_glossy": False})
    light("Ours", "POINT").penumbra.max_bounces = 2
    light("Cycles", "POINT").cycles.max_bounces = 5
    light("Shadowless", "POINT", use_shadow=False).use_shadow = False

    # Nodes: a constant, and something that is not
    for name, link in (("Nodes", False), ("Textured", True)):
        data = light(name, "POINT", energy=100)
        if old:
            data.use_nodes = True
        emission = data.node_tree.nodes["Emission"]
        emission.inputs["Color"].default_value = (1, 0.5, 0.25, 1)
        emission.inputs["Strength"].default_value = 2
        if link:
            texture = data.node_tree.nodes.new("ShaderNodeTexNoise")
            data.node_tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    light("Hidden", "POINT", {"hide_render": True})
    light("Told", "POINT", {"color": (0.2, 0.4, 0.6, 0.8), "pass_index": 7})
    colour = None if old else tuple(warm.temperature_color)
    core_scene, _ = exported()
    notes = [(note.owner, note.what) for note in core_scene.notes]
    return {lamp.name: lamp for lamp in core_scene.lamps}, notes, colour, old


@pytest.fixture(scope="module")
def exported(blender):
    return blender(lights)


def test_point_and_spot_are_watts_over_the_sphere(exported):
    lamps, *_ = exported
    for name in ("Point", "Spot"):
        intensity = np.array(lamps[name].strength)
        np.testing.assert_allclose(intensity / (math.pi * 2.0**2), PLANE_AT_2M, rtol=1e-5)
    np.testing.assert_allclose(
        lamps["Dim"].strength, np.array([0.5, 0.25, 1.0]) * 100 / (4 * math.pi), rtol=1e-6
    )
    assert lamps["Point"].soft_falloff is False
    assert lamps["Dim"].soft_falloff is True
    assert lamps["Dim"].radius == pytest.approx(0.2)
    spot = lamps["Spot"]
    assert (spot.spot_angle, spot.spot_blend) == pytest.approx((1.0, 0.4))
    np.testing.assert_allclose(np.linalg.norm(spot.to_world[:, :3], axis=0), (1, 2, 1), rtol=1e-6)


def test_a_sun_has_its_irradiance_whatever_its_angle(exported):
    lamps, *_ = exported
    assert lamps["Sun"].strength == pytest.approx((3, 3, 3))
    assert lamps["Sun"].angle == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("name", "area", "size", "ellipse"),
    [
        ("Square", 0.5 * 2 * 0.5 * 3, (0.5, 0.5), False),
        ("Rectangle", 0.5 * 2.0, (0.5, 2.0), False),
        ("Disk", math.pi / 4 * 0.5**2, (0.5, 0.5), True),
        ("Ellipse", math.pi / 4 * 0.5 * 2.0, (0.5, 2.0), True),
    ],
)
def test_an_area_light_has_the_radiance_of_its_power_over_its_scaled_area(
    exported, name, area, size, ellipse
):
    lamp = exported[0][name]
    np.testing.assert_allclose(lamp.strength, 100 / (math.pi * area), rtol=1e-6)
    assert lamp.size == pytest.approx(size)
    assert lamp.ellipse is ellipse
    assert lamp.spread == pytest.approx(1.2 if name == "Square" else math.pi)


def test_exposure_normalize_and_temperature_count_where_blender_has_them(exported):
    lamps, _, temperature, old = exported
    expected = {
        "Bright": 4 * 100 / (4 * math.pi),
        "RawPoint": 100 * 0.3**2,
        "RawDot": 100 / math.pi,
        "RawSun": 3 * math.pi * math.sin(0.05) ** 2,
        "RawArea": 100 / math.pi,
    }
    if old:
        expected = {
            "Bright": 100 / (4 * math.pi),
            "RawPoint": 100 / (4 * math.pi),
            "RawDot": 100 / (4 * math.pi),
            "RawSun": 3,
            "RawArea": 100 / (math.pi * 0.5**2),
        }
    for name, value in expected.items():
        np.testing.assert_allclose(lamps[name].strength, value, rtol=1e-5, err_msg=name)
    warm = np.array(temperature or (1, 1, 1)) * 100 / (4 * math.pi)
    np.testing.assert_allclose(lamps["Warm"].strength, warm, rtol=1e-5)
    assert old or warm[0] > 2 * warm[2]


def test_portals_and_areas_of_no_size_emit_nothing_and_hidden_lights_are_gone(exported):
    lamps, *_ = exported
    assert not {"Portal", "Nothing", "Hidden"} & set(lamps)
    assert lamps["Off"].strength == (0.0, 0.0, 0.0)


def test_visibility_and_bounce_limits_are_handed_over(exported):
    lamps, *_ = exported
    seen, plain = lamps["Seen"].seen_by, lamps["Point"].seen_by
    assert (seen.camera, seen.diffuse, seen.glossy, seen.transmission) == (True, True, False, True)
    assert (plain.camera, plain.diffuse, plain.glossy, plain.transmission) == (False, *[True] * 3)
    assert [lamps[n].max_bounces for n in ("Point", "Ours", "Cycles")] == [1024, 2, 5]


def test_constant_nodes_colour_a_light_and_others_come_along(exported):
    lamps, notes, *_ = exported
    expected = np.array([2, 1, 0.5]) * 100 / (4 * math.pi)
    np.testing.assert_allclose(lamps["Nodes"].strength, expected, rtol=1e-6)
    assert lamps["Nodes"].surface is None
    np.testing.assert_allclose(lamps["Textured"].strength, 100 / (4 * math.pi), rtol=1e-6)
    textured = lamps["Textured"].surface
    assert (textured.kind, textured.inputs["Strength"]) == ("Emission", 2.0)
    assert textured.inputs["Color"].node.kind == "TexNoise"
    assert notes == []


def test_shaders_of_lamps_know_what_this_version_of_cycles_tells_them(exported):
    lamps, *_, old = exported
    told = lamps["Told"]
    assert told.is_object is not old
    known = (*told.label.colour, told.label.alpha, told.label.index)
    assert known == pytest.approx((0, 0, 0, 0, 0) if old else (0.2, 0.4, 0.6, 0.8, 7))
    assert told.label.random != lamps["Point"].label.random


def worlds():
    import bpy
    from inside import empty_scene, exported

    scene = empty_scene()
    none, _ = exported()
    world = scene.world = bpy.data.worlds.new("Sky")
    world.color = (0.1, 0.2, 0.3)
    plain, _ = exported()
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1)
    background.inputs["Strength"].default_value = 3
    world.cycles_visibility.camera = False
    world.penumbra.max_bounces = 4
    world.cycles.sampling_method = "NONE"
    nodes, _ = exported()
    other = bpy.data.worlds.new("Other")
    if hasattr(bpy.context.view_layer, "world_override"):
        bpy.context.view_layer.world_override = other
    override, _ = exported()
    noted = [note.owner for note in nodes.notes]
    worlds = (none.world, plain.world, nodes.world, override.world)
    return *worlds, noted, bpy.app.version >= (5, 0)


def test_a_world_is_its_background_shader(blender):
    none, plain, nodes, override, noted, new = blender(worlds)
    assert none is None
    assert plain.surface.kind == "Background"
    if not new:
        assert plain.surface.inputs["Color"] == pytest.approx((0.1, 0.2, 0.3))
    assert nodes.surface.kind == "Background"
    assert nodes.surface.inputs["Color"] == pytest.approx((0.5, 0.25, 0.125))
    assert nodes.surface.inputs["Strength"] == 3.0
    assert (nodes.seen_by.camera, nodes.seen_by.glossy) == (False, True)
    assert (plain.max_bounces, nodes.max_bounces) == (1024, 4)
    assert (plain.sampled, nodes.sampled) == (True, False)
    assert noted == []
    assert override.name == "Other"
