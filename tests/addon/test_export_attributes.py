"""Only what shaders ask for is exported: attributes by name, one source for each image."""


def export():
    import bpy
    from inside import add, empty_scene, exported

    empty_scene()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=2)
    grid = bpy.context.object
    grid.data.attributes.new("unused", "FLOAT", "POINT")
    grid.data.attributes.new("wanted", "FLOAT", "FACE")
    grid["own"] = 0.25
    plain = add("Plain", grid.data.copy())
    image = bpy.data.images.new("Picture", 2, 2)
    material = bpy.data.materials.new("Material")
    material.use_nodes = True
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    for socket in ("Base Color", "Roughness"):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        tree.links.new(node.outputs[0], shader.inputs[socket])
    for kind, name, socket in (("GEOMETRY", "wanted", "Metallic"), ("OBJECT", "own", "IOR")):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_type, node.attribute_name = kind, name
        tree.links.new(node.outputs["Fac"], shader.inputs[socket])
    grid.data.materials.append(material)
    scene = exported()[0]
    by_name = {instance.name: instance for instance in scene.instances}
    found = by_name[grid.name]
    inputs = found.materials[0].surface.inputs
    sources = [inputs[name].node.properties["image"] for name in ("Base Color", "Roughness")]
    shapes = {name: (a.domain, a.values.shape) for name, a in found.mesh.attributes.items()}
    uv = found.mesh.attributes[":uv"].values
    corners = found.mesh.positions[found.mesh.triangles][..., :2] / 2 + 0.5
    return (
        shapes,
        dict(found.attributes),
        sources[0] is sources[1],
        abs(uv - corners).max() < 1e-6,
        dict(by_name[plain.name].mesh.attributes),
    )


def test_meshes_bring_the_attributes_that_their_materials_ask_for(blender):
    shapes, own, is_one, fits, plain = blender(export)
    assert shapes == {":uv": ("CORNER", (12, 3, 2)), "wanted": ("FACE", (12, 1))}
    assert own == {":object:own": (0.25, 0.25, 0.25, 1.0)}
    assert is_one
    assert fits
    assert plain == {}


def displaced():
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    found = {}
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1))
    for method in ("BUMP", "DISPLACEMENT", "BOTH"):
        material = bpy.data.materials.new(method)
        material.use_nodes = True
        material.displacement_method = method
        tree = material.node_tree
        node = tree.nodes.new("ShaderNodeDisplacement")
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
        tree.links.new(node.outputs[0], output.inputs["Displacement"])
        item = mesh(method, corners, ((0, 1, 2), (1, 3, 2)))
        item.materials.append(material)
        item.polygons.foreach_set("use_smooth", [True, False])
        add(method, item)
    scene, _ = exported()
    for instance in scene.instances:
        sharp = instance.mesh.attributes.get("sharp_face")
        found[instance.name] = (
            instance.materials[0].displacement_method,
            instance.materials[0].displacement.node.kind,
            None if sharp is None else (sharp.domain, sharp.values[:, 0].tolist()),
            len(instance.mesh.positions),
            instance.materials[0].bump_at_rest,
        )
    return found, [note.what for note in scene.notes], bpy.app.version


def test_materials_say_how_they_displace_and_their_meshes_which_faces_are_flat(blender):
    found, notes, version = blender(displaced)
    # A flat and a smooth face come apart as they do in Cycles, before it knew normals of corners
    flat, vertices = ("FACE", [0.0, 1.0]), 6 if version < (5, 1) else 4
    at_rest = version >= (5, 0)
    assert found == {
        "BUMP": ("BUMP", "Displacement", None, 4, at_rest),
        "DISPLACEMENT": ("DISPLACEMENT", "Displacement", flat, vertices, at_rest),
        "BOTH": ("BOTH", "Displacement", flat, vertices, at_rest),
    }
    assert notes == []
