"""what a scene does not need -> changes that add it, skipped or not.  The rest of costs.

Each adds something to the Cornell box that cannot change its picture: unused, in a way that the
plan can see and leave out; kept, in a way that it cannot (a thousandth of it is there), so that
the one over the other is what skipping gains.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Change = Callable[[Any], None]
LITTLE = 1e-3  # what cannot be left out
SKIP_STATES = ("plain", "unused", "kept")


@dataclass(frozen=True)
class Skip:
    """What adds something that can be left out, and what adds it so that it cannot be."""

    name: str
    unused: Change
    kept: Change | None = None

    def states(self) -> tuple[str, ...]:
        """Return which of `SKIP_STATES` are rendered."""
        return SKIP_STATES if self.kept is not None else SKIP_STATES[:2]

    def apply(self, state: str, scene: Any) -> None:
        """Change the plain scene to a state."""
        if state == "unused":
            self.unused(scene)
        elif state == "kept":
            assert self.kept is not None
            self.kept(scene)


# ---- materials


def _trees(scene: Any) -> list[Any]:
    """Return the node trees of all materials that are seen."""
    slots = (slot for item in scene.objects if item.type == "MESH" for slot in item.material_slots)
    return [each.node_tree for each in dict.fromkeys(slot.material for slot in slots)]


def _wrap(make: Callable[[Any, Any], Any]) -> Change:
    """Return a change of all materials: make(tree, socket of the shader) returns the new socket."""

    def change(scene: Any) -> None:
        for tree in _trees(scene):
            end = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
            link = end.inputs["Surface"].links[0]
            tree.links.new(make(tree, link.from_socket), end.inputs["Surface"])

    return change


def _mixed(kind: str, factor: float) -> Change:
    """Return a change that mixes a shader into all materials."""

    def make(tree: Any, socket: Any) -> Any:
        mix, other = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new(f"ShaderNode{kind}")
        mix.inputs[0].default_value = factor
        tree.links.new(socket, mix.inputs[1])
        tree.links.new(other.outputs[0], mix.inputs[2])
        return mix.outputs[0]

    return _wrap(make)


def _added(kind: str, **inputs: Any) -> Change:
    """Return a change that adds a shader to all materials."""

    def make(tree: Any, socket: Any) -> Any:
        both, other = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            other.inputs[name].default_value = value
        tree.links.new(socket, both.inputs[0])
        tree.links.new(other.outputs[0], both.inputs[1])
        return both.outputs[0]

    return _wrap(make)


def _by_backfacing(tree: Any, socket: Any) -> Any:
    mix, side = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeNewGeometry")
    other = tree.nodes.new("ShaderNodeBsdfAnisotropic")
    tree.links.new(side.outputs["Backfacing"], mix.inputs[0])
    tree.links.new(socket, mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    return mix.outputs[0]


def _turned_back(scene: Any) -> None:
    """Give closed things a back side of another shader, which nobody sees."""
    for name in ("Block", "Ball"):
        slot = scene.objects[name].material_slots[0]
        slot.link, slot.material = "OBJECT", slot.material.copy()
        tree = slot.material.node_tree
        end = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
        socket = end.inputs["Surface"].links[0].from_socket
        tree.links.new(_by_backfacing(tree, socket), end.inputs["Surface"])


def _colour(source: str, output: str, weight: float) -> Change:
    """Return a change that makes colours by nodes, with this much of a texture or attribute."""

    def change(scene: Any) -> None:
        for tree in _trees(scene):
            shader = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
            socket, node = shader.inputs["Color"], tree.nodes.new(f"ShaderNode{source}")
            mix = tree.nodes.new("ShaderNodeMix")
            mix.data_type = "RGBA"
            mix.inputs[0].default_value = weight
            mix.inputs[6].default_value = socket.default_value
            tree.links.new(node.outputs[output], mix.inputs[7])
            tree.links.new(mix.outputs[2], socket)

    return change


def _chain(varies: bool) -> Change:
    """Return a change that computes colours in steps, from a constant or a place."""

    def change(scene: Any) -> None:
        for tree in _trees(scene):
            shader = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
            kind = "NewGeometry" if varies else "CombineXYZ"
            last = tree.nodes.new(f"ShaderNode{kind}").outputs[0]
            for operation, other in (("SINE", 0.0), ("SCALE", LITTLE), ("ADD", None)):
                node = tree.nodes.new("ShaderNodeVectorMath")
                node.operation = operation
                tree.links.new(last, node.inputs[0])
                if operation == "SCALE":
                    node.inputs["Scale"].default_value = other
                elif operation == "ADD":
                    node.inputs[1].default_value = shader.inputs["Color"].default_value[:3]
                last = node.outputs[0]
            tree.links.new(last, shader.inputs["Color"])

    return change


def _closure(kind: str, is_seen: bool) -> Change:
    """Return a change that puts a material in a slot, for no face or a small one."""

    def change(scene: Any) -> None:
        import bpy

        made = bpy.data.materials.new(kind)
        if bpy.app.version < (5, 0):
            made.use_nodes = True
        tree = made.node_tree
        shader = tree.nodes.new(f"ShaderNode{kind}")
        tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
        mesh = scene.objects["Ball"].data
        mesh.materials.append(made)
        if is_seen:
            mesh.polygons[0].material_index = len(mesh.materials) - 1

    return change


# ---- light


def _lamp(energy: float, turned: float) -> Change:
    """Return a change that adds a lamp behind the box, which looks away from it or into it."""

    def change(scene: Any) -> None:
        import bpy

        data = bpy.data.lights.new("More", "AREA")
        data.energy, data.size = energy, 0.5
        thing = bpy.data.objects.new("More", data)
        thing.location, thing.rotation_euler = (0, 3, 0), (turned, 0, 0)
        scene.collection.objects.link(thing)

    return change


def _world(strength: float) -> Change:
    def change(scene: Any) -> None:
        background = scene.world.node_tree.nodes["Background"]
        background.inputs["Color"].default_value = (1, 1, 1, 1)
        background.inputs["Strength"].default_value = strength

    return change


def _sky(strength: float) -> Change:
    """Return a change to a world of a texture, which is sampled if it shines."""

    def change(scene: Any) -> None:
        tree = scene.world.node_tree
        _world(strength)(scene)
        noise = tree.nodes.new("ShaderNodeTexNoise")
        tree.links.new(noise.outputs["Color"], tree.nodes["Background"].inputs["Color"])

    return change


def _whole_border(scene: Any) -> None:
    scene.render.use_border = scene.render.use_crop_to_border = True


def _half_border(scene: Any) -> None:
    _whole_border(scene)
    scene.render.border_max_x = 0.5


def _nothing(_scene: Any) -> None:
    """Leave the scene as it is."""


def _threshold(value: float) -> Change:
    def change(scene: Any) -> None:
        scene.penumbra.light_sampling_threshold = value

    return change


CLOSURES = {
    "glossy": "BsdfAnisotropic",
    "glass": "BsdfGlass",
    "refraction": "BsdfRefraction",
    "translucent": "BsdfTranslucent",
    "sheen": "BsdfSheen",
    "toon": "BsdfToon",
    "Principled": "BsdfPrincipled",
}
OUT, IN = 1.5707963, -1.5707963  # around x: to +y, away from the box, and to -y
SKIPS = (
    *(Skip(f"closure: {n}", _closure(k, False), _closure(k, True)) for n, k in CLOSURES.items()),
    Skip(
        "procedural texture", _colour("TexNoise", "Color", 0), _colour("TexNoise", "Color", LITTLE)
    ),
    Skip("attribute", _colour("VertexColor", "Color", 0), _colour("VertexColor", "Color", LITTLE)),
    Skip("transparency", _mixed("BsdfTransparent", 0), _mixed("BsdfTransparent", LITTLE)),
    Skip("even world", _world(0), _world(LITTLE)),
    Skip("world sampling", _sky(0), _sky(LITTLE)),
    Skip("glowing surfaces", _added("Emission", Strength=0), _added("Emission", Strength=LITTLE)),
    Skip("roulette of light samples", _threshold(0.0), _threshold(0.01)),
    Skip("border around all", _whole_border),
    Skip("pixels out of a border", _half_border, _nothing),
    Skip("back faces never seen", _turned_back),
    Skip("lamp of no power", _lamp(0, IN), _lamp(LITTLE, IN)),
    Skip("lamp that looks away", _lamp(1, OUT), _lamp(1, IN)),
    Skip("dead lobe", _mixed("BsdfAnisotropic", 0), _mixed("BsdfAnisotropic", LITTLE)),
    Skip(
        "black branch",
        _added("BsdfAnisotropic", Color=(0, 0, 0, 1)),
        _added("BsdfAnisotropic", Color=(LITTLE, LITTLE, LITTLE, 1)),
    ),
    Skip("constant nodes", _chain(False), _chain(True)),
)
