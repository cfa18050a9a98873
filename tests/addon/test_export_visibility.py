"""Who sees what in Blender is what the core gets: flags, collections, instancers, light linking."""

import pytest

EVERY = (1 << 64) - 1


def flags_of_objects():
    import bpy
    from inside import add, empty_scene, exported, mesh

    scene = empty_scene()
    add("Plain", mesh())
    rays = ("camera", "diffuse", "glossy", "transmission", "shadow", "volume_scatter")
    for hidden in rays:
        add(hidden, mesh(), **{f"visible_{hidden}": False})
    add("Fog", mesh(), **{f"visible_{name}": name == "volume_scatter" for name in rays})
    add("Hole", mesh(), is_holdout=True)
    add("Catcher", mesh(), is_shadow_catcher=True)

    # Collections of the view layer; those within them have flags of their own
    for name in ("Held", "Indirect", "Both"):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        inner = bpy.data.collections.new(f"{name}Inner")
        collection.children.link(inner)
        add(name, mesh(), collection)
        add(f"{name}Inner", mesh(), inner)
        layer = bpy.context.view_layer.layer_collection.children[name]
        layer.holdout, layer.indirect_only = name != "Indirect", name != "Held"
    lamp = bpy.data.lights.new("Lamp", "POINT")
    add("Lamp", lamp, bpy.data.collections["Indirect"], visible_camera=True)

    # Materials and lights
    solid = bpy.data.materials.new("Solid")
    solid.use_transparent_shadow = False
    if bpy.app.version < (5, 0):
        solid.use_nodes = True
    for name, material in (("Solid", solid), ("Clear", bpy.data.materials.new("Clear"))):
        add(name, mesh(name)).data.materials.append(material)
    for name in ("Shadow", "Importance", "All"):
        light = bpy.data.lights.new(name, "POINT")
        light.use_shadow = name != "Shadow"
        light.cycles.use_multiple_importance_sampling = name != "Importance"
        item = add(name, light)
        item.is_shadow_catcher = name != "All"
    core_scene, _ = exported()
    return (
        {i.name: i for i in core_scene.instances},
        {lamp.name: lamp for lamp in core_scene.lamps},
        core_scene.notes,
    )


@pytest.fixture(scope="module")
def objects(blender):
    return blender(flags_of_objects)


def test_each_flag_hides_an_object_from_its_rays(objects):
    instances, _, notes = objects
    kinds = ("camera", "diffuse", "glossy", "transmission", "shadow")
    for hidden in (*kinds, "volume_scatter", "Plain"):
        seen = instances[hidden].seen_by
        assert [kind for kind in kinds if not getattr(seen, kind)] == [hidden] * (hidden in kinds)
    assert "Fog" not in instances
    assert notes == ()


def test_holdouts_and_catchers_are_told(objects):
    instances, *_ = objects
    assert {n for n, i in instances.items() if i.is_holdout} == {"Hole", "Held", "Both"}
    assert {n for n, i in instances.items() if i.is_shadow_catcher} == {"Catcher"}


def test_indirect_only_collections_hide_from_the_camera_what_is_no_holdout(objects):
    instances, lamps, _ = objects
    assert not instances["Indirect"].seen_by.camera
    assert instances["Indirect"].seen_by.diffuse
    assert instances["Both"].seen_by.camera
    assert instances["IndirectInner"].seen_by.camera
    assert not lamps["Lamp"].seen_by.camera


def test_what_lights_and_materials_say_of_shadows_is_told(objects):
    instances, lamps, _ = objects
    assert {n for n, lamp in lamps.items() if not lamp.casts_shadow} == {"Shadow"}
    assert {n for n, lamp in lamps.items() if not lamp.sampled} == {"Importance"}
    assert {n for n, lamp in lamps.items() if not lamp.lights_catchers} == {"All"}
    shadows = [instances[name].materials[0].transparent_shadow for name in ("Solid", "Clear")]
    assert shadows == [False, True]


def flags_of_instances():
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    source = bpy.data.collections.new("Source")
    add("Pebble", mesh("Pebble"), source, visible_diffuse=False, is_holdout=True)
    add("Caught", mesh("Caught"), source, is_shadow_catcher=True)
    add("Bulb", bpy.data.lights.new("Bulb", "POINT"), source, visible_camera=True)
    linked = bpy.data.collections.new("Linked")
    emitter = add("Emitter", bpy.data.lights.new("Emitter", "POINT"))
    emitter.light_linking.receiver_collection = linked
    linked.objects.link(source.objects["Pebble"])
    other = bpy.data.collections.new("Other")
    second = add("Second", bpy.data.lights.new("Second", "POINT"))
    second.light_linking.receiver_collection = other
    for index, changes in enumerate(
        ({}, {"visible_glossy": False}, {"is_holdout": True}, {"is_shadow_catcher": True}, {})
    ):
        maker = add(
            f"Maker{index}",
            None,
            location=(index, 0, 0),
            instance_type="COLLECTION",
            instance_collection=source,
            **changes,
        )
    other.objects.link(maker)
    core_scene, _ = exported()
    found = {}
    for instance in core_scene.instances:
        found[instance.name, round(instance.to_world[0, 3])] = instance
    for lamp in core_scene.lamps:
        found[lamp.name, round(lamp.to_world[0, 3])] = lamp
    return found


def test_instances_inherit_from_what_makes_them_as_in_cycles(blender):
    found = blender(flags_of_instances)
    pebbles = [found["Pebble", index] for index in range(5)]
    assert not any(pebble.seen_by.diffuse for pebble in pebbles)
    assert [pebble.seen_by.glossy for pebble in pebbles] == [True, False, True, True, True]
    assert [pebble.is_holdout for pebble in pebbles] == [False, False, True, False, False]
    assert [pebble.is_shadow_catcher for pebble in pebbles] == [False] * 3 + [True, False]
    assert all(found["Caught", index].is_shadow_catcher for index in range(5))
    bulbs = [found["Bulb", index] for index in range(5)]
    assert [bulb.seen_by.glossy for bulb in bulbs] == [True, False, True, True, True]
    assert all(bulb.seen_by.camera for bulb in bulbs)

    # The maker's light linking set goes before the object's own.
    own, makers = pebbles[0].receiver_set, pebbles[4].receiver_set
    assert {pebble.receiver_set for pebble in pebbles[:4]} == {own}
    assert [found["Caught", index].receiver_set for index in range(5)] == [0] * 4 + [makers]
    assert found["Emitter", 0].receivers == 1 << own
    assert found["Second", 0].receivers == 1 << makers
    assert own != makers != 0 != own


def light_linking():
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    things = {name: add(name, mesh(name)) for name in "ABCDEF"}

    def collection(name, **states):
        """A collection of objects and their states; of a dictionary, a collection inside."""
        made = bpy.data.collections.new(name)
        for key, state in states.items():
            if key in things:
                made.objects.link(things[key])
                made.collection_objects[len(made.objects) - 1].light_linking.link_state = state
            else:
                inner = collection(name + key, **state[1])
                made.children.link(inner)
                place = len(made.children) - 1
                made.collection_children[place].light_linking.link_state = state[0]
        return made

    def light(name, receivers=None, blockers=None):
        lamp = add(name, bpy.data.lights.new(name, "POINT"))
        lamp.light_linking.receiver_collection = receivers
        lamp.light_linking.blocker_collection = blockers

    only_a = collection("OnlyA", A="INCLUDE")
    light("OnlyA", only_a)
    light("Again", only_a)
    light("NotB", collection("NotB", B="EXCLUDE"))
    light("Mixed", collection("Mixed", A="INCLUDE", C="INCLUDE", B="EXCLUDE"))
    inside = {"D": "INCLUDE", "E": "EXCLUDE", "Deep": ("INCLUDE", {"F": "INCLUDE"})}
    light("Nested", collection("Nested", In=("EXCLUDE", inside), D="INCLUDE"))
    light("Deep", collection("Deep", In=("INCLUDE", {"Far": ("EXCLUDE", {"F": "EXCLUDE"})})))
    light("Twice", collection("Twice", In=("INCLUDE", {"A": "INCLUDE"}), A="EXCLUDE"))
    light("Empty", collection("Empty"))
    light("Plain")
    light("Shade", None, collection("Shade", A="INCLUDE"))
    light("NoShade", collection("Both", A="INCLUDE"), collection("NoShade", C="EXCLUDE"))
    things["F"].light_linking.receiver_collection = only_a
    core_scene, _ = exported()
    return (
        {i.name: (i.receiver_set, i.blocker_set, i.receivers, i.blockers)
         for i in core_scene.instances},
        {lamp.name: (lamp.receivers, lamp.blockers) for lamp in core_scene.lamps},
    )  # fmt: skip


def test_lights_light_what_their_collections_say(blender):
    instances, lamps = blender(light_linking)

    def lit(name):
        mask = lamps[name][0] if name in lamps else instances[name][2]
        return "".join(sorted(n for n, flags in instances.items() if mask >> flags[0] & 1))

    def shaded(name):
        return "".join(sorted(n for n, f in instances.items() if lamps[name][1] >> f[1] & 1))

    assert lit("OnlyA") == lit("Again") == lit("F") == "A"
    assert lit("NotB") == "ACDEF"
    assert lit("Mixed") == "AC"
    assert lit("Nested") == "D"
    assert lit("Deep") == "F"
    assert lit("Twice") == "BCDEF"
    assert lit("Empty") == lit("Plain") == "ABCDEF"
    assert lamps["Empty"] == lamps["Plain"] == (EVERY, EVERY)
    assert shaded("Shade") == "A"
    assert shaded("NoShade") == "ABDEF"
    assert shaded("OnlyA") == "ABCDEF"
    assert instances["A"][0] != instances["B"][0] != 0


def many_links(number, same):
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    for index in range(number):
        thing = add(f"Thing{index}", mesh(f"Mesh{index}"))
        only = bpy.data.collections.new(f"Only{index}")
        only.objects.link(bpy.data.objects["Thing0"] if same else thing)
        lamp = add(f"Lamp{index}", bpy.data.lights.new(f"Lamp{index}", "POINT"))
        lamp.light_linking.receiver_collection = only
    core_scene, _ = exported()
    sets = {i.name: i.receiver_set for i in core_scene.instances}
    return sets, {lamp.name: lamp.receivers for lamp in core_scene.lamps}


def test_more_links_than_there_are_sets_fall_back_to_the_default(blender):
    sets, masks = blender(many_links, 80, False)
    assert max(sets.values()) == 63
    linked = [n for n in range(80) if sets[f"Thing{n}"]]
    assert len(linked) == 63
    for n in linked:
        assert masks[f"Lamp{n}"] == 1 << sets[f"Thing{n}"]
    assert sum(mask == EVERY for mask in masks.values()) == 17


def test_more_collections_than_there_are_bits_link_nothing(blender):
    sets, masks = blender(many_links, 70, True)
    assert max(sets.values()) == sets["Thing0"] == 1
    assert sorted(masks.values()) == [0b10] * 64 + [EVERY] * 6


def terminators():
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    add("Plain", mesh())
    item = add("Own", mesh())
    if hasattr(item, "shadow_terminator_shading_offset"):
        item.shadow_terminator_geometry_offset = 0.25
        item.shadow_terminator_shading_offset = 0.5
    else:
        item.cycles.shadow_terminator_geometry_offset = 0.25
        item.cycles.shadow_terminator_offset = 0.5
    for name in ("AUTO", "FRONT"):
        material = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0):
            material.use_nodes = True
        material.cycles.emission_sampling = name
        add(name, mesh(name)).data.materials.append(material)
    core_scene, _ = exported()
    return {i.name: i for i in core_scene.instances}


def test_objects_bring_their_shadow_terminator_and_materials_how_they_are_sampled(blender):
    found = blender(terminators)
    for name, expected in (("Plain", (0.1, 0.0)), ("Own", (0.25, 0.5))):
        given = found[name].terminator_geometry, found[name].terminator_shading
        assert given == pytest.approx(expected)
    assert [found[n].materials[0].emission_sampling for n in ("AUTO", "FRONT")] == ["AUTO", "FRONT"]
