"""What Blender shows is what the core gets: each thing once, with its normals and materials."""

import numpy as np
import pytest


def kinds_of_objects():
    import bpy
    from inside import add, counts, empty_scene, exported, mesh

    empty_scene()
    for name, data in (
        ("Text", bpy.data.curves.new("Text", "FONT")),
        ("Curve", bpy.data.curves.new("Curve", "CURVE")),
        ("Surface", bpy.data.curves.new("Surface", "SURFACE")),
        ("Meta", bpy.data.metaballs.new("Meta")),
        ("Mesh", mesh()),
        ("Unfaced", mesh("Unfaced", faces=())),
    ):
        add(name, data)
    bpy.data.objects["Text"].data.body = "Hi"
    meta = bpy.data.objects["Meta"].data.elements.new()
    meta.radius = 2.0
    curve = bpy.data.objects["Curve"].data
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    spline.points[1].co = (1, 0, 0, 1)
    surface = bpy.data.objects["Surface"].data.splines.new("NURBS")
    surface.points.add(3)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.data.objects.remove(bpy.data.objects["Surface"])
    bpy.ops.surface.primitive_nurbs_surface_torus_add()
    bpy.context.object.name = "Surface"

    # Things that must not show
    add("Hidden", mesh(), hide_render=True)
    add(
        "Unseen",
        mesh(),
        **{
            f"visible_{kind}": False
            for kind in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")
        },
    )
    add("Empty", None)
    off = bpy.data.collections.new("Off")
    bpy.context.scene.collection.children.link(off)
    off.hide_render = True
    add("Off", mesh(), off)
    add("Excluded", mesh(), excluded := bpy.data.collections.new("Excluded"))
    bpy.context.scene.collection.children.link(excluded)
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    add("Viewport", mesh(), hide_viewport=True)
    return counts(exported()[0])


def test_every_kind_of_object_that_makes_a_surface_counts_once(blender):
    assert blender(kinds_of_objects) == {
        "Text": 1,
        "Curve": 1,
        "Surface": 1,
        "Meta": 1,
        "Mesh": 1,
        "Viewport": 1,
    }


def instances():
    import bpy
    from inside import add, counts, empty_scene, exported, mesh

    empty_scene()
    source = bpy.data.collections.new("Source")
    pebble = mesh("Pebble")
    pebble.materials.append(bpy.data.materials.new("Stone"))
    add("Pebble", pebble, source)

    # A collection in three places
    for index in range(3):
        add(
            f"Instancer{index}",
            None,
            location=(index, 0, 0),
            instance_type="COLLECTION",
            instance_collection=source,
            scale=(1, 1, -1),
        )

    # Faces that show a child, and the parent does not
    parent = add(
        "Parent",
        mesh("Grid", [(x, y, 0) for x in range(3) for y in range(2)], [(0, 2, 3, 1), (2, 4, 5, 3)]),
    )
    parent.instance_type, parent.show_instancer_for_render = "FACES", False
    child = add("Child", mesh("Child"))
    child.parent = parent

    # Particles, and the emitter with them
    emitter = add("Emitter", mesh("Emitter"))
    bpy.context.view_layer.objects.active = emitter
    emitter.modifiers.new("Rain", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.render_type = "HAIR", 5, "OBJECT"
    drop = add("Drop", mesh("Drop"), hide_render=True)
    settings.instance_object = drop

    # The same with an emitter that does not show
    unseen = add("Unseen", mesh("Unseen"), show_instancer_for_render=False)
    bpy.context.view_layer.objects.active = unseen
    unseen.modifiers.new("Rain", "PARTICLE_SYSTEM").particle_system.settings = settings

    # Geometry nodes: instances of an object, of a mesh made there, with a material set there
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new = tree.nodes.new
    into, out = new("NodeGroupInput"), new("NodeGroupOutput")
    join = new("GeometryNodeJoinGeometry")
    for kind in ("OBJECT", "CUBE"):
        scatter = new("GeometryNodeInstanceOnPoints")
        tree.links.new(into.outputs[0], scatter.inputs["Points"])
        if kind == "OBJECT":
            info = new("GeometryNodeObjectInfo")
            info.inputs["Object"].default_value = add("Leaf", mesh("Leaf"), hide_render=True)
            info.inputs["As Instance"].default_value = True
            made = info.outputs["Geometry"]
        else:
            paint = new("GeometryNodeSetMaterial")
            paint.inputs["Material"].default_value = bpy.data.materials.new("Painted")
            tree.links.new(new("GeometryNodeMeshCube").outputs["Mesh"], paint.inputs["Geometry"])
            made = paint.outputs["Geometry"]
        tree.links.new(made, scatter.inputs["Instance"])
        tree.links.new(scatter.outputs["Instances"], join.inputs["Geometry"])
    tree.links.new(join.outputs["Geometry"], out.inputs[0])
    field = add("Field", mesh("Field", [(i, 5, 0) for i in range(4)], ()))
    field.modifiers.new("Scatter", "NODES").node_group = tree

    core_scene, _ = exported()
    meshes = {instance.name: set() for instance in core_scene.instances}
    materials = {}
    for instance in core_scene.instances:
        meshes[instance.name].add(id(instance.mesh))
        used = {0} if instance.mesh.slots is None else set(instance.mesh.slots.tolist())
        names = tuple(instance.materials[slot].name for slot in used)
        materials.setdefault(instance.name, set()).add(names)
    x = sorted(i.to_world[0, 3] for i in core_scene.instances if i.name == "Pebble")
    mirrored = {
        np.linalg.det(i.to_world[:, :3]) < 0 for i in core_scene.instances if i.name == "Pebble"
    }
    triangles = {i.name: len(i.mesh.triangles) for i in core_scene.instances}
    return (
        counts(core_scene),
        {n: len(m) for n, m in meshes.items()},
        materials,
        x,
        mirrored,
        triangles,
    )


def test_instances_of_all_kinds_count_once_and_share_their_mesh(blender):
    counts, meshes, materials, x, mirrored, triangles = blender(instances)
    assert counts == {"Pebble": 3, "Child": 2, "Emitter": 1, "Drop": 10, "Leaf": 4, "Field": 4}
    assert set(meshes.values()) == {1}
    assert x == [0.0, 1.0, 2.0]
    assert mirrored == {True}
    assert triangles["Field"] == 12
    assert materials["Pebble"] == {("Stone",)}
    assert materials["Field"] == {("Painted",)}
    assert materials["Leaf"] == {("default_surface",)}


def shapes(edited):
    """Build meshes of all face sizes; return ours and Blender's own triangles and normals."""
    import bpy  # noqa: I001  (bmesh comes with it)
    import bmesh
    from inside import add, empty_scene, exported

    empty_scene()
    rng = np.random.default_rng(7)
    reference = {}

    def shape(name, prepare=None, smooth=None):
        graph = bmesh.new()
        bmesh.ops.create_grid(graph, x_segments=5, y_segments=4, size=1.0)
        graph.verts.ensure_lookup_table()
        for vertex in graph.verts:
            vertex.co = [c + 0.35 * rng.normal() for c in vertex.co]
        if prepare:
            prepare(graph)
        data = bpy.data.meshes.new(name)
        graph.to_mesh(data)
        if smooth:
            smooth(data)
        add(name, data)

    def triangulate(graph):
        bmesh.ops.triangulate(graph, faces=graph.faces[:])

    def mix(graph):
        bmesh.ops.triangulate(graph, faces=list(graph.faces)[::3])

    def dissolve(graph):
        bmesh.ops.dissolve_edges(graph, edges=[e for e in graph.edges if not e.is_boundary][::5])

    def shade_smooth(data):
        data.shade_smooth()

    def half(data):
        data.shade_smooth()
        for face in list(data.polygons)[::2]:
            face.use_smooth = False

    def custom(data):
        data.shade_smooth()
        normals = rng.normal(size=(len(data.loops), 3))
        data.normals_split_custom_set(normals / np.linalg.norm(normals, axis=1)[:, None])

    shape("Quads")
    shape("Triangles", triangulate, shade_smooth)
    shape("Mixed", mix, half)
    shape("Polygons", dissolve, custom)
    if edited:
        bpy.context.view_layer.objects.active = bpy.data.objects["Mixed"]
        bpy.ops.object.mode_set(mode="EDIT")
        shown = bpy.data.collections.new("Shown")
        shown.objects.link(bpy.data.objects["Mixed"])
        add("Instancer", None, instance_type="COLLECTION", instance_collection=shown)
    else:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for name in ("Quads", "Triangles", "Mixed", "Polygons"):
            data = bpy.data.objects[name].evaluated_get(depsgraph).data
            data.calc_loop_triangles()
            loops = np.array([t.loops for t in data.loop_triangles])
            vertices = np.array([t.vertices for t in data.loop_triangles])
            normals = np.array([n.vector for n in data.corner_normals])[loops]
            reference[name] = (data.normals_domain, vertices, normals)
    scene, _ = exported()
    meshes = {instance.name: instance.mesh for instance in scene.instances}
    return reference, meshes, len(scene.instances)


def test_faces_are_cut_into_the_same_triangles_with_the_same_normals_as_in_blender(blender):
    reference, meshes, _ = blender(shapes, False)
    assert set(meshes) == set(reference) == {"Quads", "Triangles", "Mixed", "Polygons"}
    domains = {}
    for name, (domain, triangles, normals) in reference.items():
        domains[name] = domain
        mesh = meshes[name]
        np.testing.assert_array_equal(mesh.triangles, triangles, err_msg=name)
        assert mesh.positions.dtype == np.float32
        assert mesh.triangles.dtype == np.int32
        if domain == "FACE":
            assert mesh.normals is None
        elif domain == "POINT":
            assert mesh.normals.shape == mesh.positions.shape
            np.testing.assert_array_equal(mesh.normals[mesh.triangles], normals.astype("f4"))
        else:
            np.testing.assert_array_equal(mesh.normals, normals.astype("f4"))
    assert domains == {
        "Quads": "FACE",
        "Triangles": "POINT",
        "Mixed": "CORNER",
        "Polygons": "CORNER",
    }


def test_a_mesh_in_edit_mode_is_exported_like_any_other(blender):
    _, meshes, instances = blender(shapes, True)
    assert instances == 5
    assert set(meshes) == {"Quads", "Triangles", "Mixed", "Polygons"}
    assert len(meshes["Mixed"].triangles) == 40


def slots():
    import bpy
    from inside import add, empty_scene, exported, mesh

    scene = empty_scene()
    red, green, blue = (bpy.data.materials.new(name) for name in ("Red", "Green", "Blue"))
    strip = mesh(
        "Strip",
        [(x, y, 0) for x in range(5) for y in range(2)],
        [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(4)],
    )
    for material in (red, None, blue):
        strip.materials.append(material)
    strip.polygons.foreach_set("material_index", [0, 1, 2, 2])
    add("Data", strip)
    linked = add("Linked", strip)
    linked.material_slots[0].link = "OBJECT"
    linked.material_slots[0].material = green
    beyond = mesh("Beyond", faces=[(0, 1, 2)])
    beyond.materials.append(red)
    beyond.polygons.foreach_set("material_index", [6])
    add("Beyond", beyond)
    add("Bare", mesh("Bare"))
    one, _ = exported()
    bpy.context.view_layer.material_override = blue
    two, _ = exported()
    bpy.context.view_layer.material_override = None
    bpy.context.view_layer.use_solid = bpy.context.view_layer.use_sky = False
    scene.world = bpy.data.worlds.new("World")
    three, _ = exported()

    def table(scene):
        return {
            item.name: (
                None if item.mesh.slots is None else item.mesh.slots.tolist(),
                [material.name for material in item.materials],
            )
            for item in scene.instances
        }

    default = one.instances[0].materials[1]
    return table(one), table(two), table(three), three.world, default


def test_each_triangle_finds_the_material_of_its_slot(blender):
    one, two, three, world, default = blender(slots)
    assert one["Data"] == ([0, 0, 1, 1, 2, 2, 2, 2], ["Red", "default_surface", "Blue"])
    assert one["Linked"] == (one["Data"][0], ["Green", "default_surface", "Blue"])
    assert one["Bare"] == (None, ["default_surface"])
    index, materials = one["Beyond"]
    assert materials[index[0]] == "Red"
    assert (default.surface.kind, default.surface.inputs) == ("BsdfDiffuse", {"Color": (0.8,) * 3})
    for _, materials in two.values():
        assert set(materials) == {"Blue"}
    assert three == {}
    assert world is None


def transforms():
    import bpy
    from inside import add, corners, empty_scene, exported, mesh

    empty_scene()
    far = add(
        "Far", mesh(), location=(1e5, -2e5, 3e4), rotation_euler=(0.4, 0.5, 0.6), scale=(-1, 2, 0.5)
    )
    parent = add("Parent", None, scale=(1, 3, 1), rotation_euler=(0, 0, 0.3))
    child = add("Child", mesh(), rotation_euler=(0, 0, 0.7))
    child.parent = parent
    flat = add("Flat", mesh(), scale=(1, 1, 0))
    bpy.context.view_layer.update()
    expected = {}
    for item in (far, child, flat):
        matrix = np.array(item.matrix_world, np.float64)
        points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
        expected[item.name] = points @ matrix[:3, :3].T + matrix[:3, 3]
    scene, _ = exported()
    return expected, {i.name: (corners(i)[0], i.to_world.dtype.str) for i in scene.instances}


def test_matrices_are_blenders_with_shear_mirror_and_zero_scale(blender):
    expected, actual = blender(transforms)
    assert set(actual) == set(expected)
    for name, (points, dtype) in actual.items():
        assert dtype == "<f8"
        np.testing.assert_allclose(points, expected[name], rtol=1e-12, atol=1e-9)


def asks_too_much():
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    hairy = add("Hairy", mesh())
    hairy.modifiers.new("Hair", "PARTICLE_SYSTEM")
    hairy.particle_systems[0].settings.type = "HAIR"
    add("Strands", bpy.data.hair_curves.new("Strands"))
    add("Smoke", bpy.data.volumes.new("Smoke"))
    bpy.context.view_layer.use_pass_normal = True  # these two are drawn
    bpy.context.view_layer.aovs.add().name = "Extra"
    bpy.context.view_layer.use_pass_vector = True  # blank with motion blur
    bpy.context.scene.render.use_motion_blur = True
    add("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    return [(note.owner, note.what) for note in exported()[0].notes]


def test_what_is_not_honoured_is_noted_once_by_name(blender):
    notes = blender(asks_too_much)
    assert len(set(notes)) == len(notes)
    owners = sorted(owner for owner, _ in notes)
    assert owners == sorted(
        [
            "Object 'Hairy'",
            "Object 'Strands'",
            "Object 'Smoke'",
            "View layer 'ViewLayer'",
        ]
    )


def plain_scene():
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    add("Triangle", mesh())
    return exported()[0].notes


def test_a_plain_scene_has_nothing_to_note(blender):
    assert blender(plain_scene) == ()


def many_instances(number):
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    points = mesh("Points", np.random.default_rng(1).uniform(-9, 9, (number, 3)).tolist(), ())
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    into, out, scatter, info, lamp, join = (
        tree.nodes.new(kind)
        for kind in (
            "NodeGroupInput",
            "NodeGroupOutput",
            "GeometryNodeInstanceOnPoints",
            "GeometryNodeObjectInfo",
            "GeometryNodeCollectionInfo",
            "GeometryNodeJoinGeometry",
        )
    )
    info.inputs["Object"].default_value = add("Leaf", mesh("Leaf"), hide_render=True)
    info.inputs["As Instance"].default_value = True
    tree.links.new(into.outputs[0], scatter.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], scatter.inputs["Instance"])
    tree.links.new(scatter.outputs["Instances"], join.inputs[0])

    # As many lights, of one collection
    lights = bpy.data.collections.new("Lights")
    add("Lamp", bpy.data.lights.new("Lamp", "POINT"), lights)
    lamp.inputs["Collection"].default_value = lights
    second = tree.nodes.new("GeometryNodeInstanceOnPoints")
    tree.links.new(into.outputs[0], second.inputs["Points"])
    tree.links.new(lamp.outputs[0], second.inputs["Instance"])
    tree.links.new(second.outputs["Instances"], join.inputs[0])
    tree.links.new(join.outputs[0], out.inputs[0])
    add("Cloud", points).modifiers.new("Scatter", "NODES").node_group = tree
    scene, _ = exported()
    return (
        len(scene.instances),
        len({id(i.mesh) for i in scene.instances}),
        len({id(i.materials) for i in scene.instances}),
        len(scene.lamps),
    )


@pytest.mark.parametrize("number", [20_000])
def test_many_instances_share_all_but_their_matrix(blender, number):
    instances, meshes, materials, lamps = blender(many_instances, number)
    assert (instances, meshes, materials, lamps) == (number, 1, 1, number)
