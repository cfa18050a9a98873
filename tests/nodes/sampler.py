"""seed -> a random graph of shader nodes, in a picture by both engines.  A tile each.

Nodes are drawn from Blender's list less those of `table`; links join outputs to inputs of
whatever numbers, through reroutes, groups, muted nodes and muted links.  What varies comes from
fields that are constant over a pixel (see `stage`).  Run as a module it is the long tier:

    python -m penumbra.tests.nodes.sampler [FIRST [COUNT]]

renders that many graphs and prints what differs, each cut down to the least that still does.
"""

import random
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

from . import stage
from .rows import OFFSET, TILE

# Kinds of nodes that make numbers of their inputs alone, so that both engines look at the same;
# not White Noise, which makes another number of what differs in the last bit
KINDS = (  # noqa: SIM905
    "Blackbody BrightContrast Clamp CombineColor CombineXYZ FloatCurve Gamma HueSaturation "
    "Invert MapRange Mapping Math Mix MixRGB Normal RGB RGBCurve RGBToBW SeparateColor "
    "SeparateXYZ TexBrick TexChecker TexGradient TexMagic TexNoise TexVoronoi TexWave "
    "ValToRGB Value VectorCurve VectorMath VectorRotate Wavelength ObjectInfo LightPath "
    "Fresnel LayerWeight HairInfo PointInfo VolumeInfo CameraData ParticleInfo Squeeze "
    "Attribute VertexColor"
).split()
# Inputs for which Cycles has no number: details of waves below -1, bricks without a size
UNFED = {
    ("ShaderNodeTexWave", "Detail"),
    ("ShaderNodeTexBrick", "Brick Width"),
    ("ShaderNodeTexBrick", "Row Height"),
}
NUMBERS = {"VALUE", "VECTOR", "RGBA", "INT", "BOOLEAN"}


class Grower:
    """Grows a graph in a tree, by a random source of its own."""

    def __init__(self, tree, dice, skip):
        self.tree, self.dice, self.skip, self.count = tree, dice, skip, 0
        self.fields, self.names = {}, {}

    def field(self, tree):
        """Return an output that varies over the tile."""
        known = self.fields.setdefault(tree.as_pointer(), {})
        name = self.dice.choice(["A", "B", "P", "Q", "a", "b", "p"])
        output = stage.field(tree, name, known)
        self.names[output] = name
        return output

    def grow(self, tree, depth):
        """Return an output of a new node whose inputs are fed by others, `depth` deep."""
        self.count += 1
        place, dice = self.count, self.dice
        if place in self.skip or depth == 0:
            return self.leaf(tree) if dice.random() < 0.2 else self.field(tree)
        if dice.random() < 0.12 and depth > 1:
            return self.group(tree, depth)
        node = tree.nodes.new(f"ShaderNode{dice.choice(KINDS)}")
        self.choose(node)
        for socket in node.inputs:
            if socket.type not in NUMBERS or socket.is_unavailable:
                continue
            if (node.bl_idname, socket.identifier) in UNFED:
                continue
            # Left alone, textures read what varies over a pixel
            is_fed = node.bl_idname.startswith("ShaderNodeTex") and socket.identifier == "Vector"
            if is_fed or dice.random() < 0.6:
                source = self.grow(tree, depth - 1)
                self.link(tree, source, socket, can_mute=not is_fed)
            elif not socket.hide_value and dice.random() < 0.7:
                self.set(socket)
        if dice.random() < 0.07:
            node.mute = True
        outputs = [each for each in node.outputs if each.type in NUMBERS and each.enabled]
        return dice.choice(outputs) if outputs else self.leaf(tree)

    def leaf(self, tree):
        node = tree.nodes.new("ShaderNodeValue")
        node.outputs[0].default_value = self.dice.uniform(-1, 2)
        return node.outputs[0]

    def link(self, tree, source, socket, can_mute=True):
        if self.dice.random() < 0.15:
            reroute = tree.nodes.new("NodeReroute")
            tree.links.new(source, reroute.inputs[0])
            source = reroute.outputs[0]
        link = tree.links.new(source, socket)
        if can_mute and self.dice.random() < 0.06:
            link.is_muted = True

    def group(self, tree, depth):
        """Return an output of a group, whose input may go unused."""
        inside = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        kinds = ["NodeSocketFloat", "NodeSocketVector", "NodeSocketColor"]
        inside.interface.new_socket("In", in_out="INPUT", socket_type=self.dice.choice(kinds))
        inside.interface.new_socket("Out", in_out="OUTPUT", socket_type=self.dice.choice(kinds))
        start, end = inside.nodes.new("NodeGroupInput"), inside.nodes.new("NodeGroupOutput")
        made = self.grow(inside, depth - 1)
        sum_ = inside.nodes.new("ShaderNodeVectorMath")
        inside.links.new(made, sum_.inputs[0])
        inside.links.new(start.outputs[0], sum_.inputs[1])
        inside.links.new(sum_.outputs[0], end.inputs[0])
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = inside
        if self.dice.random() < 0.7:
            self.link(tree, self.grow(tree, depth - 1), node.inputs[0])
        else:
            self.set(node.inputs[0])
        return node.outputs[0]

    def choose(self, node):
        """Make the node's choices at random."""
        for name in own_choices(node):
            prop = node.bl_rna.properties[name]
            if prop.type == "BOOLEAN":
                setattr(node, name, self.dice.random() < 0.5)
                continue
            values = [item.identifier for item in prop.enum_items if item.identifier]
            try:
                setattr(node, name, self.dice.choice(values))
            except (TypeError, IndexError):
                continue  # not offered to this node

    def set(self, socket):
        """Give an input a random value within its soft limits."""
        if socket.type == "BOOLEAN":
            socket.default_value = self.dice.random() < 0.5
        elif socket.type == "INT":
            socket.default_value = self.dice.randint(0, 4)
        elif socket.type == "VALUE":
            low, high = limits(socket)
            socket.default_value = self.dice.uniform(max(low, -3.0), min(high, 3.0))
        else:
            size = len(socket.default_value)
            low = 0.0 if socket.type == "RGBA" else -1.5
            socket.default_value = [self.dice.uniform(low, 1.0) for _ in range(size)]


def limits(socket):
    prop = socket.bl_rna.properties["default_value"]
    return prop.soft_min, prop.soft_max


def plant(tree, seed, skip=frozenset()):
    """Grow the graph of a seed and let it be seen; return what grew it.

    Nodes whose numbers are in `skip` are leaves instead.
    """
    grower = Grower(tree, random.Random(seed), skip)
    output = grower.grow(tree, 4)

    # Of numbers of any size x / (1 + |x|) is seen: bounded, and rounding shows the less the larger
    size = stage.vector_node(tree, "ABSOLUTE", output)
    seen = stage.vector_node(tree, "DIVIDE", output)
    one_more = stage.vector_node(tree, "ADD", size, (1.0,) * 3)
    tree.links.new(one_more, seen.node.inputs[1])
    light = tree.nodes.new("ShaderNodeEmission")
    raised = stage.vector_node(tree, "MULTIPLY_ADD", seen, (1.0,) * 3, (OFFSET,) * 3)
    tree.links.new(raised, light.inputs["Color"])
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(light.outputs[0], end.inputs["Surface"])
    return grower


def render(graphs, folder):
    """Return both engines' tiles (2, N, TILE, TILE, 3) of graphs: (seed, skipped numbers)."""
    import penumbra

    penumbra.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    across = int(np.ceil(np.sqrt(len(graphs))))
    half = stage.SIDE / 2
    for k, (seed, skip) in enumerate(graphs):
        mesh = bpy.data.meshes.new(f"Mesh {k}")
        corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        thing = bpy.data.objects.new(f"Graph {k}", mesh)
        row, column = divmod(k, across)
        middle = (across - 1) / 2
        thing.location = ((column - middle) * stage.SIDE, (middle - row) * stage.SIDE, 0)
        material = bpy.data.materials.new(f"Graph {k}")
        mesh.materials.append(material)
        plant(stage.with_nodes(material), seed, skip)
        scene.collection.objects.link(thing)
    stage.look(scene, "ORTHO", across * stage.SIDE, across * stage.SIDE)
    scene.render.resolution_x = scene.render.resolution_y = across * TILE
    bpy.context.view_layer.update()
    pictures = []
    for picture in stage.shots(scene, folder):
        tiles = picture.reshape(across, TILE, across, TILE, 3).swapaxes(1, 2)
        pictures.append(tiles.reshape(-1, TILE, TILE, 3)[: len(graphs)])
    return np.array(pictures)


# A graph differs if more than so many of its numbers do, by so much: at jumps (a floor, the edge
# of a cell) rounding falls to either side, and a hundredth of a pixel shows what is steep
TOLERANCE, SHARE = 2e-3, 0.1


def differ(theirs, ours):
    """Return the share of pixels of each graph (N,) that differ, of tiles (N, TILE, TILE, 3)."""
    finite = np.isfinite(theirs) & (theirs != 0)  # Cycles has 0 for what is no number
    miss = (np.abs(theirs.astype(np.float64) - ours) > TOLERANCE) & finite
    seen = finite.any(axis=-1).sum(axis=(1, 2))
    return miss.any(axis=-1).sum(axis=(1, 2)) / np.maximum(seen, 1)


def shares(graphs, folder):
    """Return the share of pixels of each graph that differ; 1 where the render fails."""
    try:
        return [float(share) for share in differ(*render(graphs, folder))]
    except RuntimeError:
        if len(graphs) == 1:
            return [1.0]
    return [shares([graph], folder)[0] for graph in graphs]


def minimise(seed, folder):
    """Return the numbers of nodes that a graph can do without and still differ."""
    tree = bpy.data.node_groups.new("Tree", "ShaderNodeTree")
    count = plant(tree, seed).count
    skip = frozenset()
    for number in range(2, count + 1):
        trial = skip | {number}
        if shares([(seed, trial)], folder)[0] > SHARE:
            skip = trial
    return skip


def describe(seed, skip):
    """Return a graph in words, a node a line, the last first."""
    tree = stage.with_nodes(bpy.data.materials.new("Words"))
    grower = plant(tree, seed, skip)
    lines = []
    for each in (tree, *(n.node_tree for n in tree.nodes if getattr(n, "node_tree", None))):
        unread = [node for node in each.nodes if not any(o.is_linked for o in node.outputs)]
        read = set()
        while unread:
            node = unread.pop(0)
            if node in read:
                continue
            read.add(node)
            fed = {}
            for socket in node.inputs:
                if socket.is_linked:
                    link = socket.links[0]
                    source = link.from_socket
                    name = grower.names.get(source)
                    if name is None:
                        name = f"{link.from_node.name}.{source.identifier}"
                        unread.append(link.from_node)
                    fed[socket.identifier] = name + " (muted)" * link.is_muted
                elif hasattr(socket, "default_value") and socket.enabled:
                    value = socket.default_value
                    fed[socket.identifier] = value if np.isscalar(value) else tuple(value)
            choices = {name: getattr(node, name) for name in own_choices(node)}
            lines.append(f"  {node.name}{' (muted)' * node.mute}: {choices} {fed}")
    return "\n".join(lines)


def own_choices(node):
    """Return the names of the choices that a kind of node has for itself."""
    common = bpy.types.ShaderNode.bl_rna.properties
    return [
        prop.identifier
        for prop in node.bl_rna.properties
        if prop.identifier not in common
        and not prop.is_readonly
        and (prop.type == "ENUM" or (prop.type == "BOOLEAN" and not prop.is_array))
    ]


def main(first=0, count=300):
    """Render `count` graphs from seed `first` on; print those that differ, cut down."""
    with tempfile.TemporaryDirectory() as name:
        folder, wrong = Path(name), []
        for start in range(first, first + count, 64):
            seeds = range(start, min(start + 64, first + count))
            found = shares([(seed, frozenset()) for seed in seeds], folder)
            wrong += [seed for seed, share in zip(seeds, found, strict=True) if share > SHARE]
        for seed in wrong:
            skip = minimise(seed, folder)
            sys.stdout.write(f"graph {seed} differs:\n{describe(seed, skip)}\n")
        sys.stdout.write(f"{len(wrong)} of {count} graphs differ: {wrong}\n")
        sys.stdout.flush()
    return len(wrong)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
