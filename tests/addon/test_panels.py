"""Panels of objects, lights, materials, worlds; the report; preferences; the system check."""


def draw_datablocks():
    from types import SimpleNamespace

    import bpy
    from inside import Layout

    import penumbra
    from penumbra.addon import panels

    bpy.ops.wm.read_factory_settings()
    penumbra.register()
    scene = bpy.context.scene
    light = bpy.data.objects["Light"].data
    blocks = {
        "object": bpy.data.objects["Cube"],
        "light": light,
        "material": bpy.data.materials["Material"],
        "world": scene.world,
    }

    def draw(name, datablock, engine="PENUMBRA"):
        cls = getattr(bpy.types, name)
        context = SimpleNamespace(engine=engine, scene=scene, **{datablock: blocks[datablock]})
        if not cls.poll(context):
            return None
        layout = Layout()
        cls.draw(SimpleNamespace(layout=layout, datablock=datablock, rows=rows[name]), context)
        return layout.names()

    rows = {name: rows for name, _, _, _, rows in panels.PANELS}
    found = {name: draw(name, each) for name, _, _, each, _ in panels.PANELS}
    light.type = "AREA"
    blocks["light"] = bpy.data.objects["Light"].data
    found["area"] = draw("DATA_PT_penumbra_light", "light")
    blocks["object"] = bpy.data.objects["Light"]
    found["lamp"] = draw("OBJECT_PT_penumbra_motion", "object")
    others = {draw(name, each, "CYCLES") for name, _, _, each, _ in panels.PANELS}

    # Whose bounces count?
    light, bounces = blocks["light"], ("penumbra.max_bounces", "cycles.max_bounces")
    light.cycles.max_bounces = 5
    before = panels.place(light, bounces)[0] == light.cycles
    light.penumbra.max_bounces = 3
    after = panels.place(light, bounces)[0] == light.penumbra
    layout = Layout()
    bpy.types.WORLD_PT_penumbra_preview.draw(
        SimpleNamespace(layout=layout), SimpleNamespace(world=scene.world)
    )
    # What the Cycles add-on shows of them, as long as it is there
    theirs = {}
    for name, _, tab, source in panels.THEIRS:
        cls = getattr(bpy.types, name, None)
        context = SimpleNamespace(engine="PENUMBRA", view_layer=scene.view_layers[0])
        setattr(context, tab, blocks[tab])
        if cls is not None:
            assert cls.poll(context)
            note = Layout()
            cls.draw(SimpleNamespace(layout=note, theirs=source), context)
            theirs[name] = note.names()
    return found, others, before, after, layout.shown, bpy.app.version, theirs


def test_datablocks_show_what_the_renderer_reads(blender):
    found, others, before, after, shown, version, theirs = blender(draw_datablocks)
    for name in ("OBJECT_PT_penumbra_group", "WORLD_PT_penumbra_group"):
        assert theirs.pop(name) == ["lightgroup", "scene.view_layer_add_lightgroup"]
    assert len(theirs) == (0 if version >= (5, 0) else 2)
    kinds = ["camera", "diffuse", "glossy", "transmission"]
    assert found["OBJECT_PT_penumbra_visibility"] == [
        *(f"visible_{kind}" for kind in (*kinds, "shadow")),
        "is_shadow_catcher",
        "is_holdout",
    ]
    second = "shadow_terminator_shading_offset" if version >= (5, 0) else "shadow_terminator_offset"
    assert found["OBJECT_PT_penumbra_terminator"] == ["shadow_terminator_geometry_offset", second]
    light = ["use_shadow", "use_multiple_importance_sampling"]
    moves = ["use_motion_blur", "use_deform_motion", "motion_steps"]
    assert found["OBJECT_PT_penumbra_motion"] == moves
    assert found["lamp"] == moves[2:]
    stars = ["use_stars", "star_strength", "star_temperature"]
    assert found["OBJECT_PT_penumbra_stars"] == stars
    assert found["WORLD_PT_penumbra_stars"][:3] == ["use_stars", "star_count", "star_seed"]
    assert found["DATA_PT_penumbra_light"] == [*light, "max_bounces", "use_motion_blur"]
    assert found["area"] == ["spread", *light, "is_portal", "max_bounces", "use_motion_blur"]
    assert found["MATERIAL_PT_penumbra_settings"] == [
        "pass_index",
        "displacement_method",
        "emission_sampling",
        "use_transparent_shadow",
    ]
    world = found["WORLD_PT_penumbra_settings"]
    assert world[:5] == [*kinds, "sampling_method"]
    assert world[-1] == "max_bounces"
    assert others == {None}
    assert before
    assert after
    assert shown == [("preview", "World", None)]


def draw_pause():
    from types import SimpleNamespace

    import bpy
    from inside import Layout

    import penumbra
    from penumbra.addon import ui

    penumbra.register()
    found = []
    for engine, shading in (
        ("PENUMBRA", "RENDERED"),
        ("PENUMBRA", "SOLID"),
        ("CYCLES", "RENDERED"),
    ):
        layout = Layout()
        space = SimpleNamespace(shading=SimpleNamespace(type=shading))
        context = SimpleNamespace(engine=engine, scene=bpy.context.scene, space_data=space)
        ui._draw_pause(SimpleNamespace(layout=layout), context)
        found.append(layout.names())
    return found


def test_only_a_rendered_viewport_of_ours_can_be_paused(blender):
    assert blender(draw_pause) == [["preview_pause"], [], []]


def report_culprits():
    """Render a scene with things that are not honoured; draw the report and press its buttons."""
    from types import SimpleNamespace

    import bpy
    from inside import Layout, empty_scene

    from penumbra.addon import report

    scene = empty_scene()
    scene.view_layers[0].use_pass_vector = scene.render.use_motion_blur = True  # blank
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.name = "A 'quoted' plane"
    plain, wavy = (bpy.data.materials.new(name) for name in ("Plain", "Wavy"))
    for material in (plain, wavy):
        plane.data.materials.append(material)
    wavy.use_nodes = True
    nodes = wavy.node_tree.nodes
    volume = nodes.new("ShaderNodeVolumeScatter")
    wavy.node_tree.links.new(volume.outputs[0], nodes["Material Output"].inputs["Volume"])
    bpy.ops.object.light_add(type="POINT")
    report.clear()
    bpy.ops.render.render()
    report.errors.append("It went wrong " * 9)

    cls = bpy.types.RENDER_PT_penumbra_report
    context = SimpleNamespace(engine="PENUMBRA", region=SimpleNamespace(width=400))
    assert cls.poll(context)
    assert not cls.poll(SimpleNamespace(engine="CYCLES"))
    layout = Layout()
    cls.draw(SimpleNamespace(layout=layout), context)
    buttons = [what.owner for _, name, what in layout.shown if name == "penumbra.select_owner"]
    texts = [text for kind, text, _ in layout.shown if kind == "label"]

    results = [bpy.ops.penumbra.select_owner(owner=owner) for owner in buttons]
    chosen = [each.name for each in bpy.context.selected_objects]
    active, slot = bpy.context.object.name, plane.active_material_index
    plane.select_set(False)
    results.append(bpy.ops.penumbra.select_owner(owner="Object 'A 'quoted' plane'"))
    again = [each.name for each in bpy.context.selected_objects]
    gone = bpy.ops.penumbra.select_owner(owner="Material 'Gone'")
    report.clear()
    layout = Layout()
    cls.draw(SimpleNamespace(layout=layout), context)
    return texts, buttons, results, chosen, active, slot, again, gone, layout.shown[:1]


def test_the_report_names_culprits_and_selects_them(blender):
    texts, buttons, results, chosen, active, slot, again, gone, empty = blender(report_culprits)
    assert texts[0].startswith("Frame 1, ViewLayer: 2 samples in ")
    assert any("volume shader is not honoured" in text for text in texts)
    assert "View layer 'ViewLayer'" in texts
    assert max(len(text) for text in texts[1:]) <= 50
    assert sum("It went wrong" in text for text in texts) > 1  # in lines
    assert buttons == ["Material 'Wavy'"]
    assert results == [{"FINISHED"}, {"FINISHED"}]
    assert chosen == again == ["A 'quoted' plane"]
    assert (active, slot) == ("A 'quoted' plane", 1)
    assert gone == {"CANCELLED"}
    assert empty[0][0] == "operator"


def keep_limits():
    """Read the limits of preferences, without any and with some."""
    from types import SimpleNamespace

    import bpy

    import penumbra
    from penumbra.addon import preferences
    from penumbra.core.settings import Settings

    penumbra.register()
    settings = Settings(instance_memory=4.0, texture_memory=1.0)
    render = bpy.context.scene.render
    render.threads_mode = "AUTO"

    def limits():
        kept = preferences.limit_memory(settings)
        return kept.instance_memory, kept.texture_memory, preferences.thread_count(render)

    found = [preferences.read_preferences() is None, limits()]
    for memory, texture, threads in ((0.0, 0.0, 0), (2.0, 0.001, 3), (8.0, 0.5, 3)):
        wished = SimpleNamespace(instance_memory=memory, texture_memory=texture, threads=threads)
        preferences.read_preferences = lambda wished=wished: wished
        found.append(limits())
    render.threads_mode, render.threads = "FIXED", 7
    return [*found, limits()]


def test_preferences_limit_memory_and_the_threads_that_a_scene_leaves_open(blender):
    found = blender(keep_limits)
    none, few, many = (4.0, 1.0, 0), (2.0, 0.01, 3), (4.0, 0.5, 3)
    assert found == [True, none, none, few, many, (4.0, 0.5, 7)]


def check_system():
    from types import SimpleNamespace

    import bpy

    import penumbra
    from penumbra.addon import system

    penumbra.register()
    rows = dict(system.check())
    done = bpy.ops.penumbra.system_check()
    whole = system.core.render

    def dark(plan):
        return SimpleNamespace(combined=lambda: 0 * whole(plan).combined())

    def broken(plan):
        raise RuntimeError("no rays today")

    found = []
    for fake in (dark, broken):
        system.core.render = fake
        found.append(dict(system.check())["Test render"])
    return rows, done, found, bpy.app.version_string


def test_the_system_check_tells_versions_and_renders(blender):
    import platform

    import embreex
    import numpy

    rows, done, (dark, broken), blenders = blender(check_system)
    assert rows["Test render"] == "passed"
    assert done == {"FINISHED"}
    assert rows["Blender"].startswith(blenders)
    assert rows["Python"] == platform.python_version()
    assert rows["NumPy"] == numpy.__version__
    assert rows["embreex"][:2] == "4."
    assert rows["embreex from"] in embreex.__file__
    assert rows["Processor"]
    assert dark.startswith("FAILED: [0.0")
    assert broken == "FAILED: RuntimeError: no rays today"


def use_presets():
    """Use our presets, keep one of the user's, use it, remove it."""
    import tempfile
    from types import SimpleNamespace

    import bpy
    from inside import Layout

    import penumbra

    penumbra.register()
    settings, found = bpy.context.scene.penumbra, []

    def values():
        return settings.samples, settings.denoising_quality, settings.light_samples, settings.seed

    settings.seed, settings.light_samples = 5, 7
    for name in ("Draft", "Final"):
        bpy.ops.penumbra.sampling_preset(preset=name)
        found.append(values())
    settings.samples, settings.light_samples = 12, 3
    with tempfile.TemporaryDirectory() as folder:
        resource, bpy.utils.user_resource = bpy.utils.user_resource, lambda *_, **__: folder
        bpy.ops.penumbra.sampling_preset_add(name="My own")
        bpy.utils.user_resource = resource
        settings.samples, settings.light_samples = 1, 1
        menu = "RENDER_PT_penumbra_presets"
        bpy.ops.script.execute_preset(filepath=f"{folder}/My_own.py", menu_idname=menu)
    found.append(values())
    layout = Layout()
    header = bpy.types.RENDER_PT_penumbra_sampling.draw_header_preset
    header(SimpleNamespace(layout=layout), bpy.context)
    return found, layout.shown


def test_presets_hold_what_the_sampling_panel_shows_and_nothing_else(blender):
    found, shown = blender(use_presets)
    assert found == [(32, "FAST", 0, 5), (4096, "HIGH", 0, 5), (12, "HIGH", 3, 5)]
    assert shown == [("popover", "RENDER_PT_penumbra_presets", None)]


def compare_panels():
    """Return which of Blender's panels are shown for us and what is read of them."""
    import bpy

    import penumbra

    bpy.ops.wm.read_factory_settings()
    before = _shown("CYCLES")
    penumbra.register()
    ours = _shown("PENUMBRA")
    try:
        bpy.context.scene.render.engine = "PENUMBRA"
        bpy.ops.object.bake(type="COMBINED")
        baked = ""
    except RuntimeError as error:
        baked = str(error)
    return before, ours, _shown("CYCLES"), baked


def _shown(engine):
    from bpy.types import Panel

    from penumbra.addon.ui import _subclasses

    panels = _subclasses(Panel)
    return {each.__name__ for each in panels if engine in getattr(each, "COMPAT_ENGINES", ())}


def test_no_panel_of_blender_promises_what_is_not_rendered(blender):
    cycles, ours, after, baked = blender(compare_panels)
    assert after == cycles
    alike = {name for name in ours if name.startswith("CYCLES")}
    assert alike == {"CYCLES_VIEW3D_PT_shading_lighting"}
    words = ("_bake", "motion_blur", "render_pt_eevee", "subdivision", "debug")
    assert not [name for name in ours if any(word in name.lower() for word in words)]
    assert {"EEVEE_WORLD_PT_mist", "EEVEE_MATERIAL_PT_displacement"} <= ours
    assert "does not support baking" in baked
