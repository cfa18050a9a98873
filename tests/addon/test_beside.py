"""What Blender itself does with a picture: Freestyle, Grease Pencil, strips of the sequencer."""

import pytest


def draw(folder):
    """Render with both engines; return differences of ours from Cycles, and from nothing drawn."""
    import bpy
    import numpy as np
    from inside import pixels

    import penumbra

    bpy.ops.wm.read_factory_settings()
    penumbra.register()
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x = render.resolution_y = 64
    render.resolution_percentage = 100
    for settings in (scene.cycles, scene.penumbra):
        settings.samples, settings.use_denoising = 32, False
    lines = scene.view_layers[0].freestyle_settings.linesets
    if not lines:
        lines.new("Lines")
    scene.view_layers[0].use_freestyle = True
    operator = bpy.ops.object
    version = bpy.app.version
    add = operator.gpencil_add if version < (4, 3) else operator.grease_pencil_add
    add(type="MONKEY", location=(0, 0, 1.5))
    pencil, seen = bpy.context.object, {}
    for name in ("nothing", "lines", "pencil"):
        render.use_freestyle, pencil.hide_render = name == "lines", name != "pencil"
        for engine in ("CYCLES", "PENUMBRA"):
            render.engine = engine
            render.filepath = f"{folder}/{name}-{engine}.png"
            bpy.ops.render.render(write_still=True)
            seen[name, engine] = pixels(render.filepath)[..., :3]

    def difference(one, other):
        return float(np.abs(seen[one] - seen[other]).mean())

    names = "lines", "pencil"
    ours = {name: difference((name, "PENUMBRA"), (name, "CYCLES")) for name in names}
    drawn = {name: difference((name, "CYCLES"), ("nothing", "CYCLES")) for name in names}
    return ours, drawn


def test_lines_and_grease_pencil_are_drawn_upon_our_pictures_as_with_cycles(blender, tmp_path):
    off, drawn = blender(draw, str(tmp_path))
    assert drawn["lines"] > 2e-3
    if not drawn["pencil"]:
        pytest.skip("Blender cannot draw Grease Pencil here: there is no OpenGL")
    assert drawn["pencil"] > 2e-3
    for name in drawn:
        assert off[name] < 0.15 * drawn[name], (name, off, drawn)


def cut(folder):
    """Render a scene, and as a strip of another scene's sequence; return both pictures."""
    import bpy
    from inside import pixels

    import penumbra

    bpy.ops.wm.read_factory_settings()
    penumbra.register()
    shot = bpy.context.scene
    cutting = bpy.data.scenes.new("Cut")
    editor = cutting.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strips.new_scene("Shot", shot, channel=1, frame_start=1)
    found = []
    for scene in (shot, cutting):
        render = scene.render
        render.engine, scene.penumbra.samples = "PENUMBRA", 4
        scene.penumbra.use_denoising = False
        render.resolution_x = render.resolution_y = 48
        scene.view_settings.view_transform = "Standard"
        render.filepath = f"{folder}/{scene.name}.png"
        bpy.ops.render.render(write_still=True, scene=scene.name)
        found.append(pixels(render.filepath)[..., :3])
    return found


def test_a_scene_in_the_sequencer_is_rendered_as_it_is_alone(blender, tmp_path):
    alone, cut_in = blender(cut, str(tmp_path))
    assert alone.std() > 0.02
    assert abs(alone - cut_in).max() <= 2 / 255
