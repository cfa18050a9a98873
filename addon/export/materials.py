"""bpy node trees -> core.scene.Node.  Every node as it stands; the core decides what it honours.

A tree becomes a DAG of nodes: groups, reroutes, muted nodes and muted links are gone, a node
that is used twice is one object.  Inputs are keyed by socket identifier; a socket without a
link carries its constant, one that stands for something of the hit point while unlinked (Normal,
Vector) carries None.  Properties are the node's own RNA properties; nodes whose value sits on
an output (RGB, Value, Normal) have it among the properties, under the output's identifier; those
that show an image have its ImageSource under `image`, None if none is chosen; ramps and curves
have their values as a `table`; what makes colours of spectra says what the scene-linear space is.
"""

import pathlib
from collections import deque
from collections.abc import Iterator
from typing import Any

import bpy

from ...core.scene import Link, Material, Node, Note, Socket
from .broken import broken_notes, is_endless
from .curves import sample_curves, sample_ramp
from .images import Images, configuration, working_space
from .mapping import export_mapping
from .sockets import constant, converted, finite, is_number, nothing, shining

Path = tuple[bpy.types.Node, ...]  # the group nodes that one is inside of

_GREY = Node("BsdfDiffuse", inputs={"Color": (0.8, 0.8, 0.8)})
DEFAULT_SURFACE = Material("default_surface", _GREY)

# Properties of every node: where it is drawn, not what it does
_COMMON = {prop.identifier for prop in bpy.types.ShaderNode.bl_rna.properties}
_SIMPLE = {"BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"}
# Nodes that make colours of physical quantities ask what the scene-linear space is
_COLOUR_MAKERS = {"ShaderNodeTexSky", "ShaderNodeBlackbody", "ShaderNodeWavelength"}
# Nodes that hold a constant -> the property that it is, under the output's identifier
_HELD = {
    "FunctionNodeInputBool": ("Boolean", "boolean"),
    "FunctionNodeInputInt": ("Integer", "integer"),
    "FunctionNodeInputVector": ("Vector", "vector"),
}
_INLINE = {"MATERIAL": "from_material", "WORLD": "from_world", "LIGHT": "from_light"}


def export_material(
    material: bpy.types.Material | None,
    notes: list[Note],
    images: Images | None = None,
    aovs: frozenset[str] = frozenset(),
) -> Material:
    """Return a material as Cycles would see it; an empty slot is its grey default surface.

    With what it writes into the user's own passes `aovs`.
    """
    if material is None:
        return DEFAULT_SURFACE
    tree = active_tree(material)
    if tree is None:
        colour = tuple(material.diffuse_color[:3])
        return Material(material.name, Node("BsdfDiffuse", inputs={"Color": colour}))
    owner = f"Material '{material.name}'"
    reader = _Reader(notes, images or Images(notes))
    surface, displacement = reader.read_shader(material, tree, owner)
    written = reader.read_aovs(aovs) if aovs else {}
    cycles = getattr(material, "cycles", None)  # there while the Cycles add-on is enabled
    return Material(
        material.name,
        surface,
        getattr(material, "use_transparent_shadow", True),
        index=material.pass_index,
        emission_sampling=getattr(cycles, "emission_sampling", "AUTO"),
        displacement=displacement,
        displacement_method=material.displacement_method,
        aovs=written,
        bump_width=0.1 if bpy.app.version >= (4, 4) else 1.0,
        bump_softening=_softening(cycles),
        bump_at_rest=bpy.app.version >= (5, 0),
    )


def _softening(cycles: Any) -> str:
    """Return how this Blender's Cycles softens what bent normals make of the terminator."""
    if not getattr(cycles, "use_bump_map_correction", True):
        return "NONE"
    return "MICROFACET" if bpy.app.version >= (4, 5) else "CUBIC"


def active_tree(datablock: bpy.types.ID) -> bpy.types.NodeTree | None:
    """Return the node tree that shades a material, light or world; None if it uses none."""
    switch = datablock.bl_rna.properties["use_nodes"]
    deprecated = getattr(switch, "is_deprecated", False)  # Blender >= 5: always on
    return datablock.node_tree if deprecated or datablock.use_nodes else None


def export_tree(
    datablock: bpy.types.ID, owner: str, notes: list[Note], images: Images | None = None
) -> Node | None:
    """Return the node that feeds Surface of the active output of a light or world, or None."""
    reader = _Reader(notes, images or Images(notes))
    return reader.read_shader(datablock, datablock.node_tree, owner)[0]


class _Reader:
    """Reads one tree; breadth first, so that a long chain of nodes needs no deep recursion."""

    def __init__(self, notes: list[Note], images: Images) -> None:
        self.notes, self.images = notes, images
        self.nodes: dict[tuple[int, ...], Node] = {}
        self.links: dict[int, dict[int, bpy.types.NodeLink]] = {}
        self.inline: Any = None  # what owns the tree that Blender has unrolled
        self.tree: bpy.types.NodeTree | None = None
        self.unread: deque[tuple[bpy.types.Node, Path, dict[str, Socket]]] = deque()

    def read_shader(
        self, datablock: bpy.types.ID, tree: bpy.types.NodeTree, owner: str
    ) -> tuple[Node | None, Link | None]:
        """Return what feeds Surface and Displacement of a datablock's own tree."""
        self.notes.extend(broken_notes(tree, owner))
        # Blender unrolls outputs for every engine only, not those for Cycles alone; with a circle
        # of links in a group it does not come back (5.2)
        output = tree.get_output_node("CYCLES")
        is_own = output is not None and output.target == "CYCLES"
        if is_own or is_endless(tree) or not hasattr(bpy.types, "InlineShaderNodes"):
            return self.read_output(tree, owner)

        # Blender unrolls zones and groups, and folds constants; the tree lives as long as `inline`
        make = getattr(bpy.types.InlineShaderNodes, _INLINE[datablock.id_type])
        self.inline = make(datablock)
        return self.read_output(self.inline.node_tree, owner)

    def read_output(self, tree: bpy.types.NodeTree, owner: str) -> tuple[Node | None, Link | None]:
        """Return what feeds Surface and Displacement of the tree's active output."""
        self.tree = tree
        output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
        if output is None:
            return None, None
        found = {
            name: self.read(output.inputs[name], ())
            for name in ("Surface", "Volume", "Displacement")
            if name in output.inputs
        }
        if isinstance(found.get("Volume"), Link):
            self.notes.append(Note(owner, "its volume shader is not honoured"))
        self.finish()
        surface, displacement = found["Surface"], found.get("Displacement")
        return (
            surface.node if isinstance(surface, Link) else None,
            displacement if isinstance(displacement, Link) else None,
        )

    def read_aovs(self, names: frozenset[str]) -> dict[str, Node]:
        """Return the AOV Output nodes of these names in the tree that was read, also in groups."""
        found: dict[str, Node] = {}
        assert self.tree is not None
        waiting: list[tuple[bpy.types.NodeTree, Path]] = [(self.tree, ())]
        while waiting:
            inside, path = waiting.pop()
            for node in inside.nodes:
                name = getattr(node, "aov_name", "")
                if node.mute:
                    continue
                if node.bl_idname == "ShaderNodeOutputAOV" and name in names:
                    found.setdefault(name, self.node(node, path))
                elif isinstance(node, bpy.types.ShaderNodeGroup) and node.node_tree:
                    waiting.append((node.node_tree, (*path, node)))
        self.finish()
        return found

    def finish(self) -> None:
        """Read the inputs of all nodes that were met, until there is no new one."""
        while self.unread:
            node, path, inputs = self.unread.popleft()
            for socket in node.inputs:
                if not socket.is_unavailable:
                    inputs[socket.identifier] = self.read(socket, path)

    def read(self, socket: bpy.types.NodeSocket, path: Path) -> Socket:
        """Return what an input receives: a constant, a Link, or None."""
        target = socket
        default = constant(target)
        through: list[bpy.types.NodeSocket] = []  # outputs that hand on what an input of theirs has
        while True:
            source = self.source(socket)
            if source is None:
                return default if socket == target else converted(socket, None, through, target)
            node = source.node
            socket = None
            if node.mute:
                socket = _bypass(node, source)
                if socket is not None and self.source(socket) is None:
                    return nothing(default)
            elif node.bl_idname == "NodeReroute":
                socket = node.inputs[0]
            elif node.bl_idname == "NodeGroupInput" and path:
                *outer, group = path
                path, socket = (
                    tuple(outer),
                    _by_identifier(group.inputs, source.identifier),
                )
            elif isinstance(node, bpy.types.ShaderNodeGroup | bpy.types.ShaderNodeCustomGroup):
                socket = _group_output(node, source.identifier)
                path = (*path, node)
                if socket is None and node.node_tree is not None:
                    return nothing(default)
            else:
                made = Link(self.node(node, path), source.identifier, default)
                found = converted(source, made, through, target)
                return shining(found, node.name) if is_number(source, target) else found
            if socket is None:
                return default
            through.append(source)

    def source(self, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
        """Return the output that a link which counts brings to an input."""
        tree = socket.id_data
        links = self.links.get(tree.as_pointer())
        if links is None:
            links = {
                link.to_socket.as_pointer(): link
                for link in tree.links
                if link.is_valid and not link.is_muted
            }
            self.links[tree.as_pointer()] = links
        link = links.get(socket.as_pointer())
        return link.from_socket if link else None

    def node(self, node: bpy.types.Node, path: Path) -> Node:
        """Return the Node of a node; its inputs follow in `finish`."""
        key = tuple(item.as_pointer() for item in (*path, node))
        known = self.nodes.get(key)
        if known is None:
            inputs: dict[str, Socket] = {}
            kind = node.bl_idname.removeprefix("ShaderNode")
            name = node.name
            if self.inline is not None:
                name = name.partition("_")[2] or name  # Blender has put a number before it
            name = node.label or name
            known = Node(kind, name, inputs, dict(_properties(node, self.images)))
            self.nodes[key] = known
            self.unread.append((node, path, inputs))
        return known


def _bypass(node: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the input that a muted node hands through to one of its outputs."""
    for link in node.internal_links:
        if link.to_socket == output:
            return link.from_socket
    return None


def _group_output(group: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket | None:
    """Return the input of the group's active output node that feeds one of its outputs."""
    for node in group.node_tree.nodes if group.node_tree else ():
        if node.bl_idname == "NodeGroupOutput" and node.is_active_output:
            return _by_identifier(node.inputs, identifier)
    return None


def _by_identifier(
    sockets: bpy.types.bpy_prop_collection, identifier: str
) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)


def _properties(node: bpy.types.Node, images: Images) -> Iterator[tuple[str, Any]]:
    """Yield the node's own choices, its image, and its value if that sits on an output."""
    for prop in node.bl_rna.properties:
        if prop.identifier not in _COMMON and prop.type in _SIMPLE:
            value = getattr(node, prop.identifier)
            yield (
                prop.identifier,
                tuple(value) if getattr(prop, "is_array", False) else value,
            )
    if isinstance(getattr(node, "image_user", None), bpy.types.ImageUser):
        yield "image", node.image and images.export(node.image, node.image_user)
    if isinstance(getattr(node, "texture_mapping", None), bpy.types.TexMapping):
        mapping = export_mapping(node.texture_mapping)
        if mapping is not None:
            yield "texture_mapping", mapping
    if node.bl_idname == "ShaderNodeBsdfPrincipled" and bpy.app.version < (5, 0):
        # Until then there was a thin film on dielectrics only.
        yield "films_metal", False
    if node.bl_idname == "ShaderNodeTexVoronoi":
        # Until then cells were hashed as floats.
        yield "is_float", bpy.app.version < (5, 0, 0)
    if isinstance(getattr(node, "color_ramp", None), bpy.types.ColorRamp):
        yield "table", sample_ramp(node.color_ramp)
        yield "is_stepped", node.color_ramp.interpolation == "CONSTANT"
    if isinstance(getattr(node, "mapping", None), bpy.types.CurveMapping):
        table, span = sample_curves(node.mapping)
        yield "table", table
        yield "span", span
        yield "is_extended", node.mapping.extend == "EXTRAPOLATED"
    if node.bl_idname == "ShaderNodeTexCoord" and node.object is not None:
        yield "object", tuple(number for row in node.object.matrix_world[:3] for number in row)
    if node.bl_idname == "GeometryNodeInputSceneTime":
        yield from images.moment.items()
    if node.bl_idname == "ShaderNodeTexIES":
        yield "text", _ies_text(node)
    if node.bl_idname in _COLOUR_MAKERS:
        yield "working_space", working_space()
        yield "config", configuration()
    if node.bl_idname in ("ShaderNodeRGB", "ShaderNodeValue", "ShaderNodeNormal"):
        output = node.outputs[0]
        yield output.identifier, constant(output)
    if node.bl_idname in _HELD:
        output, name = _HELD[node.bl_idname]
        value = getattr(node, name)
        yield output, tuple(map(finite, value)) if name == "vector" else value


def _ies_text(node: bpy.types.ShaderNodeTexIES) -> str | None:
    """Return what the IES file or text of a node says, None if there is none."""
    if node.mode == "INTERNAL":
        return None if node.ies is None else node.ies.as_string()
    path = bpy.path.abspath(node.filepath, library=node.id_data.library)
    try:
        return pathlib.Path(path).read_text(encoding="latin-1")
    except OSError:
        return None  # the core notes that there is no profile
