"""names -> rows of nodes.  What `carried` shows: UV maps, attributes, images, normals."""

# Name -> how to make the node: (kind, output, properties, inputs, shape)


def row(kind, output, shape="bent", **more):
    """A node, the output that is looked at, its properties, and by capital letters its inputs."""
    inputs = {k: v for k, v in more.items() if k[0].isupper()}
    return kind, output, {k: v for k, v in more.items() if k not in inputs}, inputs, shape


def attribute(name, output="Color", kind="GEOMETRY", shape="bent"):
    return row("Attribute", output, shape, attribute_name=name, attribute_type=kind)


def picture(name, output="Color", shape="bent", **more):
    return row("TexImage", output, shape, image=name, **more)


def carried():
    rows = {}
    for shape in ("bent", "smooth", "mirrored", "plain", "bare", "ngon"):
        rows[f"uv active {shape}"] = row("UVMap", "UV", shape)
        rows[f"uv second {shape}"] = row("UVMap", "UV", shape, uv_map="Second")
        rows[f"colour active {shape}"] = row("VertexColor", "Color", shape)
        rows[f"texcoord {shape}"] = row("TexCoord", "UV", shape)
    rows["uv missing"] = row("UVMap", "UV", uv_map="Nowhere")
    for output in ("Color", "Alpha"):
        for layer in ("", "Corner", "Byte", "Nowhere"):
            rows[f"layer '{layer}' {output}"] = row("VertexColor", output, layer_name=layer)
    names = ("float", "integer", "switch", "plane", "vector", "Corner", "Byte", "face", "UVMap")
    for name in (*names, "Nowhere", ""):
        for output in ("Color", "Vector", "Fac", "Alpha"):
            rows[f"attribute '{name}' {output}"] = attribute(name, output)
    for kind in ("OBJECT", "INSTANCER", "VIEW_LAYER"):
        for name in ("own", "own 3", "own 4", "scale", "color", "Nowhere"):
            for output in ("Color", "Vector", "Fac", "Alpha"):
                rows[f"{kind} '{name}' {output}"] = attribute(name, output, kind)
    return rows


def images():
    rows = {}
    for interpolation in ("Linear", "Closest", "Cubic", "Smart"):
        for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR"):
            how = {"interpolation": interpolation, "extension": extension, "Vector": "edge"}
            how["shape"] = "plain"
            rows[f"{interpolation} {extension}"] = picture("byte", **how)
            rows[f"{interpolation} {extension} alpha"] = picture("alpha", "Alpha", **how)
    for name in ("byte", "alpha", "float", "data", "packed", "generated", "grey", "premul"):
        for output in ("Color", "Alpha"):
            rows[f"{name} {output}"] = picture(name, output)
    for name in ("channels", "none", "alpha"):
        rows[f"{name} both"] = picture(name, "Color", both=True)
        rows[f"{name} both Alpha"] = picture(name, "Alpha", both=True)
    for shape in ("bent", "smooth", "mirrored", "plain", "bare"):
        for output in ("Color", "Alpha"):
            for blend in (0.0, 0.3, 1.0):
                how = {"projection": "BOX", "projection_blend": blend, "Vector": "object"}
                rows[f"box {blend} {shape} {output}"] = picture("alpha", output, shape, **how)
        rows[f"unlinked {shape}"] = picture("byte", "Color", shape)
    for projection in ("SPHERE", "TUBE"):
        rows[projection] = picture("byte", projection=projection, Vector="aside")
    for interpolation in ("Linear", "Closest", "Cubic", "Smart"):
        for projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):
            how = {"interpolation": interpolation, "projection": projection, "Vector": "aside"}
            rows[f"{projection} {interpolation}"] = row(
                "TexEnvironment", "Color", image="byte", **how
            )
    for where in ("wide", "tiles"):
        rows[f"tiles {where}"] = picture("tiles", Vector=where)
        how = {"projection": "BOX", "Vector": where}
        rows[f"tiles box {where}"] = picture("tiles", **how)  # as Blender 5 has it
    rows["missing"] = picture("missing")
    rows["sequence"] = picture("sequence")
    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        rows[f"legacy {kind}"] = picture("byte", legacy=kind)
    rows["legacy limits"] = picture("byte", legacy="limits")
    rows["legacy axes"] = picture("byte", legacy="axes")
    return rows


def normals():
    rows = {}
    for shape in ("bent", "smooth", "mirrored", "plain", "bare", "behind", "smooth behind", "ngon"):
        for space in ("TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD"):
            how = {"space": space, "Color": "P"}
            rows[f"map {space} {shape}"] = row("NormalMap", "Normal", shape, **how)
    for strength in (0.0, 0.4, 1.7):
        for space in ("TANGENT", "OBJECT"):
            how = {"space": space, "Color": "P", "Strength": strength}
            rows[f"map {space} {strength}"] = row("NormalMap", "Normal", "smooth", **how)
    for shape in ("displaced", "smooth displaced", "sharp displaced", "smooth mirrored displaced"):
        for base in ("ORIGINAL", "DISPLACED"):
            for strength in (0.4, 1.0, 1.7):
                how = {"base": base, "Color": "P", "Strength": strength}
                rows[f"map {base} {strength} {shape}"] = row("NormalMap", "Normal", shape, **how)
    rows["map ORIGINAL"] = row("NormalMap", "Normal", "smooth", base="ORIGINAL", Color="P")
    for shape in ("bent", "smooth", "mirrored", "plain", "bare", "smooth bare", "behind",
                  "smooth behind", "ngon"):  # fmt: skip
        how = {"space": "TANGENT", "Vector": "P", "Midlevel": 0.2, "Scale": 1.7}
        rows[f"displacement {shape}"] = row("VectorDisplacement", "Displacement", shape, **how)
    for convention in ("OPENGL", "DIRECTX"):
        how = {"convention": convention, "Color": "P"}
        rows[f"map {convention}"] = row("NormalMap", "Normal", "smooth", **how)
    rows["map second"] = row("NormalMap", "Normal", "smooth", uv_map="Second", Color="P")
    rows["map nowhere"] = row("NormalMap", "Normal", "smooth", uv_map="Nowhere", Color="P")
    for shape in ("bent", "smooth", "mirrored", "bare"):
        how = {"direction_type": "UV_MAP"}
        rows[f"tangent {shape}"] = row("Tangent", "Tangent", shape, **how)
        rows[f"tangent second {shape}"] = row("Tangent", "Tangent", shape, uv_map="Second", **how)
    return rows


def bumps():
    rows = {}
    for shape in ("bent", "smooth", "mirrored", "behind", "smooth behind"):
        for height in ("wave", "picture", "attribute"):
            rows[f"bump {height} {shape}"] = row(
                "Bump", "Normal", shape, Height=height, Distance=0.05, Strength=1.0
            )
    rows["bump strength"] = row("Bump", "Normal", Height="wave", Distance=0.05, Strength=0.4)
    rows["bump invert"] = row("Bump", "Normal", Height="wave", Distance=0.05, invert=True)
    rows["bump normal"] = row("Bump", "Normal", Height="wave", Distance=0.05, Normal="map")
    rows["bump none"] = row("Bump", "Normal", "smooth", Distance=0.05)
    return rows


FAMILIES = {"carried": carried, "images": images, "normals": normals, "bumps": bumps}
