"""The add-on comes and goes: registration, properties, panels."""

import math

import pytest

from penumbra.core.film.passes import PASSES
from penumbra.core.settings import OPTIONS


def register_and_leave():
    import bpy

    import penumbra

    def traces():
        return {
            "types": sorted(name for name in dir(bpy.types) if "penumbra" in name.lower()),
            "groups": sorted(
                t for t in dir(bpy.types) if hasattr(getattr(bpy.types, t), "penumbra")
            ),
            "engine": selectable(),
            "operators": [name for name in dir(bpy.ops) if name == "penumbra"],
            "panels": sorted(panels(bpy.types.Panel)),
            "header": [draw.__module__ for draw in drawn() if "penumbra" in draw.__module__],
        }

    def drawn():
        return getattr(bpy.types.VIEW3D_HT_header.draw, "_draw_funcs", ())

    def selectable():
        try:
            bpy.context.scene.render.engine = "PENUMBRA"
        except TypeError:
            return False
        bpy.context.scene.render.engine = "CYCLES"
        return True

    def panels(base):
        for child in base.__subclasses__():
            if "PENUMBRA" in child.__dict__.get("COMPAT_ENGINES", ()):
                yield child.__name__
            yield from panels(child)

    before = traces()
    penumbra.unregister()
    penumbra.register()
    once = traces()
    penumbra.register()
    twice = traces()
    penumbra.unregister()
    penumbra.unregister()
    return before, once, twice, traces()


def test_registering_twice_is_like_once_and_unregistering_leaves_nothing(blender):
    before, once, twice, after = blender(register_and_leave)
    assert before == after
    assert once == twice
    assert before["engine"] is False
    assert once["engine"] is True
    assert once["header"] == ["penumbra.addon.ui"]
    for owner in ("Scene", "Object", "Light", "Material", "World", "Camera"):
        assert owner in once["groups"]
    for name in (
        "DATA_PT_lens",
        "DATA_PT_camera_dof",
        "DATA_PT_camera_dof_aperture",
        "DATA_PT_EEVEE_light",
        "EEVEE_MATERIAL_PT_surface",
        "EEVEE_MATERIAL_PT_context_material",
        "EEVEE_WORLD_PT_surface",
        "RENDER_PT_format",
    ):
        assert name in once["panels"]


def draw_panels():
    """Draw our panels of the render tab on a layout that takes notes; return what each shows."""
    from types import SimpleNamespace

    import bpy
    from inside import Layout

    import penumbra
    from penumbra.addon import ui

    penumbra.register()
    penumbra.register()
    scene, found = bpy.context.scene, {}
    layer = scene.view_layers[0]
    for label, options in ui.PANELS:
        cls = getattr(bpy.types, f"RENDER_PT_penumbra_{label.lower().replace(' ', '_')}")
        ours, other = (
            SimpleNamespace(engine=engine, scene=scene, view_layer=layer)
            for engine in ("PENUMBRA", "CYCLES")
        )
        assert cls.poll(ours)
        assert not cls.poll(other)
        layout = Layout()
        cls.draw(SimpleNamespace(layout=layout, options=options), ours)
        found[label] = layout.names()
    camera = bpy.data.cameras.new("Camera")
    camera.type = "PANO"
    for name in ("DATA_PT_penumbra_panorama", "VIEWLAYER_PT_penumbra_passes"):
        ours, other = (
            SimpleNamespace(engine=engine, camera=camera, view_layer=layer)
            for engine in ("PENUMBRA", "CYCLES")
        )
        cls, layout = getattr(bpy.types, name), Layout()
        assert cls.poll(ours)
        assert not cls.poll(other)
        cls.draw(SimpleNamespace(layout=layout), ours)
        found[name] = layout.names()
    return found


def test_panels_show_all_options_that_are_honoured_and_no_others(blender):
    found = blender(draw_panels)
    assert found.pop("DATA_PT_penumbra_panorama") == [
        "panorama_type",
        "fisheye_lens",
        "fisheye_fov",
    ]
    flags = [each.flag.removeprefix("own.") for each in PASSES]
    assert found.pop("VIEWLAYER_PT_penumbra_passes") == [
        *dict.fromkeys(flags),
        "pass_alpha_threshold",
    ]
    shown = {name for names in found.values() for name in names}
    honoured = {option.name for option in OPTIONS if not option.awaits}
    blenders = {"film_transparent", "threads_mode", "threads", "preview_pixel_size"}
    blenders |= {"use_motion_blur", "motion_blur_position", "motion_blur_shutter"}
    blenders |= {"motion_blur_shutter_curve", "penumbra.adopt_cycles"}
    assert shown == honoured | blenders


def panoramas():
    """Return what our panel shows of each panorama, and what of that cameras lack."""
    import bpy

    import penumbra

    penumbra.register()
    from penumbra.addon.ui import PANORAMAS

    known = bpy.types.Camera.bl_rna.properties
    kinds = {item.identifier for item in known["panorama_type"].enum_items}
    lacking = [
        name
        for kind, names in PANORAMAS.items()
        if kind in kinds
        for name in names
        if name not in known
    ]
    return set(PANORAMAS), kinds, lacking


def test_the_panorama_panel_knows_the_settings_of_blenders_panoramas(blender):
    shown, kinds, lacking = blender(panoramas)
    assert lacking == []
    assert kinds - shown == {"EQUIANGULAR_CUBEMAP_FACE", "MIRRORBALL"}  # which have none


def read_properties(path):
    import bpy

    import penumbra
    from penumbra.addon import ui
    from penumbra.addon.properties import read_settings

    penumbra.register()
    scene = bpy.context.scene
    group = scene.penumbra
    rna = group.bl_rna.properties
    table = {}
    for prop in rna:
        name = prop.identifier
        if name not in ("rna_type", "name"):
            low, high = getattr(prop, "hard_min", None), getattr(prop, "hard_max", None)
            table[name] = (prop.type, prop.default, prop.name, prop.description, low, high)
    untouched = read_settings(scene, bpy.context.view_layer)

    # Set every option to something else, save, start over, load
    for name, (kind, default, *_, high) in table.items():
        if kind == "ENUM":
            others = [
                item.identifier for item in rna[name].enum_items if item.identifier != default
            ]
            setattr(group, name, others[0])
        elif kind == "BOOLEAN":
            setattr(group, name, not default)
        else:
            setattr(group, name, min(default + 1, high) if default + 1 <= high else high / 2)
    light = bpy.data.lights.new("Lamp", "POINT")
    light.penumbra.max_bounces = 3
    light.use_fake_user = True
    changed = read_settings(scene, bpy.context.view_layer)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings()
    penumbra.register()
    bpy.ops.wm.open_mainfile(filepath=path)
    loaded = read_settings(bpy.context.scene, bpy.context.view_layer)
    bounces = bpy.data.lights["Lamp"].penumbra.max_bounces
    bpy.context.view_layer.samples = 7
    layered = read_settings(bpy.context.scene, bpy.context.view_layer)
    return table, untouched, changed, loaded, bounces, layered.samples, ui.PANELS


def test_properties_are_the_table_of_options_and_survive_a_saved_file(blender, tmp_path):
    table, untouched, changed, loaded, bounces, layered, panels = blender(
        read_properties, str(tmp_path / "settings.blend")
    )
    assert set(table) == {option.name for option in OPTIONS} | {"preview_pause"}
    for option in OPTIONS:
        _, default, label, text, low, high = table[option.name]
        assert (label, text) == (option.label, option.help)
        if isinstance(option.default, float):
            assert math.isclose(default, option.default, rel_tol=1e-6)
            assert option.maximum is None or math.isclose(high, option.maximum, rel_tol=1e-6)
        else:
            assert default == option.default
        if option.minimum is not None and not option.choices:
            assert math.isclose(low, option.minimum, rel_tol=1e-6)

    for option in OPTIONS:
        assert getattr(untouched, option.name) == option.default
        assert getattr(changed, option.name) != option.default
    assert loaded == changed
    assert bounces == 3
    assert layered == 7

    shown = [name for _, names in panels for name in names if ":" not in name]
    assert sorted(shown) == sorted(option.name for option in OPTIONS)


def set_to_ends():
    import bpy

    import penumbra
    from penumbra.addon.properties import read_settings

    penumbra.register()
    scene = bpy.context.scene
    found = []
    for end in ("hard_max", "hard_min"):
        for prop in scene.penumbra.bl_rna.properties:
            if hasattr(prop, end):
                setattr(scene.penumbra, prop.identifier, getattr(prop, end))
        found.append(read_settings(scene, bpy.context.view_layer))
    return found


def test_settings_may_be_all_that_blender_lets_users_set(blender):
    largest, least = blender(set_to_ends)
    for option in OPTIONS:
        if option.maximum is not None and not option.choices:
            assert getattr(largest, option.name) == pytest.approx(option.maximum, rel=1e-6)
        if option.minimum is not None and not option.choices:
            assert getattr(least, option.name) == pytest.approx(option.minimum, rel=1e-6)


def adopt():
    import bpy

    import penumbra
    from penumbra.addon.properties import read_settings

    penumbra.register()
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.diffuse_bounces, scene.cycles.film_exposure = 17, 2, 0.5
    scene.penumbra.diffuse_bounces = 3
    followed = read_settings(scene, bpy.context.view_layer)
    result = bpy.ops.penumbra.adopt_cycles()
    return followed, result, read_settings(scene, bpy.context.view_layer)


def test_settings_of_cycles_count_where_ours_were_never_set_and_can_be_copied_again(blender):
    followed, result, copied = blender(adopt)
    assert (followed.samples, followed.diffuse_bounces, followed.film_exposure) == (17, 3, 0.5)
    assert result == {"FINISHED"}
    assert (copied.samples, copied.diffuse_bounces, copied.film_exposure) == (17, 2, 0.5)


def open_files(folder):
    import bpy

    import penumbra

    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.samples = 17
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/cycles.blend")
    penumbra.register()
    bpy.context.scene.render.engine = "PENUMBRA"
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/chosen.blend")

    found = {}
    for name in ("cycles", "chosen"):
        bpy.ops.wm.open_mainfile(filepath=f"{folder}/{name}.blend")
        ours = bpy.context.scene.penumbra
        found[name] = ours.samples, ours.is_property_set("samples")
    # From now on the two are apart, whatever engine is chosen.
    scene = bpy.context.scene
    scene.cycles.samples, scene.penumbra.max_bounces = 5, 2
    scene.render.engine = "CYCLES"
    scene.render.engine = "PENUMBRA"
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/again.blend")
    bpy.ops.wm.open_mainfile(filepath=f"{folder}/again.blend")
    scene = bpy.context.scene
    found["again"] = scene.penumbra.samples, scene.penumbra.max_bounces, scene.cycles.samples
    return found


def test_a_file_that_has_never_seen_our_engine_opens_with_the_values_of_cycles(blender, tmp_path):
    found = blender(open_files, str(tmp_path))
    assert found["cycles"] == (4096, False)  # it renders with another engine
    assert found["chosen"] == (17, True)
    assert found["again"] == (17, 2, 5)
