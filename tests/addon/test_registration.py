"""The add-on comes and goes: registration, properties, panels."""

import math

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
        }

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
    for owner in ("Scene", "Object", "Light", "Material", "World", "Camera"):
        assert owner in once["groups"]
    for name in (
        "DATA_PT_lens",
        "DATA_PT_EEVEE_light",
        "EEVEE_MATERIAL_PT_surface",
        "EEVEE_MATERIAL_PT_context_material",
        "EEVEE_WORLD_PT_surface",
        "RENDER_PT_format",
        "RENDER_PT_penumbra_sampling",
        "RENDER_PT_penumbra_film",
    ):
        assert name in once["panels"]


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
    assert set(table) == {option.name for option in OPTIONS}
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


def adopt():
    import bpy

    import penumbra
    from penumbra.addon.properties import read_settings

    penumbra.register()
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.diffuse_bounces, scene.cycles.film_exposure = 17, 2, 0.5
    scene.penumbra.diffuse_bounces = 3
    result = bpy.ops.penumbra.adopt_cycles()
    return result, read_settings(scene, bpy.context.view_layer)


def test_settings_of_cycles_are_adopted_except_where_ours_are_set(blender):
    result, settings = blender(adopt)
    assert result == {"FINISHED"}
    assert (settings.samples, settings.diffuse_bounces, settings.film_exposure) == (17, 3, 0.5)
