"""shader nodes -> Surface.  The weights of Mix and Add Shader flow down to the closures.

From the output on, each shader has its turn when all that use it have had theirs: one that is
used twice is added once, with the sum of its weights, and a long chain needs no deep recursion.
"""

from collections.abc import Mapping

from ..arrays import dot
from ..scene import Link, Material, Node
from .filtering import filtered
from .graph import Graph, Library, NodeFunction, output_of, title
from .inputs import NORMAL
from .nodes import NODES
from .normals import bump, bump_undisplaced
from .rules import Rules
from .shaders import SHADER_INPUTS, SHADERS
from .sharing import shared
from .surface import Lobe, Surface
from .values import FLOAT, Value, average, clamp, constant, step

WHITE = constant((1.0, 1.0, 1.0))


def compile_surface(
    owner: str, material: Material | None, rules: Rules, library: Library | None = None
) -> Surface:
    """Return what a material does with light; None is Blender's default surface."""
    root = None if material is None else output_of(material)
    surface = Surface(Graph(owner, NODES, library, root), rules)
    surface.graph.far = rules.occlusion_distance
    if material is None:
        surface.add("diffuse", constant((0.8, 0.8, 0.8)))
    else:
        surface.graph.material_index = material.index
        surface.graph.bump_width = material.bump_width
        surface.softening = material.bump_softening
        if material.surface is not None:
            _follow(surface, material.surface)
        if material.bumps:
            surface.bent = _displaced(surface.graph, output_of(material), material)
    if surface.transparency is not None:
        share = average(surface.transparency)
        surface.lobes.append(Lobe("transparent", surface.transparency, (), share))
    surface.show_normal("normal")
    surface.show_normal("matte_normal", is_matte=True)
    surface.show_normal("bearing")
    if surface.emission is not None:
        surface.show("albedo", clamp(surface.emission))
    if material is not None:
        _write_aovs(surface, material)
    return shared(filtered(surface) if surface.graph.library.store.has_levels else surface)


def _write_aovs(surface: Surface, material: Material) -> None:
    """Keep what the material writes into the passes of the user that are wanted."""
    for name, node in material.aovs.items():
        for key, made in (
            (f"aov_color:{name}", surface.graph.colour),
            (f"aov_value:{name}", surface.graph.number),
        ):
            if key in surface.rules.shown:
                socket = "Color" if key.startswith("aov_color") else "Value"
                surface.facts[key] = made(node, socket)
                surface.facts[f"aov_alpha:{name}"] = constant(1.0)


def _displaced(graph: Graph, output: Node, material: Material) -> Value | None:
    """Return the shading normal of a surface that is displaced along its normal."""
    way = graph.whole(output, "Displacement")
    height = step(dot, way, NORMAL, kind=FLOAT)
    if way.is_constant:
        return None
    if material.moves:
        return bump_undisplaced(height, NORMAL, graph.bump_width, material.bump_at_rest)
    return bump(height, constant(1.0), constant(1.0), NORMAL, graph.bump_width)


def compile_shader(
    owner: str,
    node: Node | None,
    rules: Rules,
    library: Library | None = None,
    table: Mapping[str, NodeFunction] = NODES,
) -> Surface:
    """Return what the shader of a world or a light emits; `table` says what its nodes mean."""
    surface = Surface(Graph(owner, table, library, node), rules)
    if node is not None:
        _follow(surface, node)
    return surface


def _follow(surface: Surface, root: Node) -> None:
    """Hand weights down from the root: each shader when all that use it have had their turn."""
    surface.weights[id(root)] = WHITE
    for node in reversed(_closures_first(root)):
        weight = surface.weights.get(id(node))
        if weight is None:
            continue
        shader = SHADERS.get(node.kind)
        if shader is None:
            surface.graph.note(f"{title(node)} is not honoured: it is rendered black")
        else:
            shader(surface, node, weight)


def _closures_first(root: Node) -> list[Node]:
    """Return the shader nodes below the root, each after all that it uses."""
    order: list[Node] = []
    seen: set[int] = set()
    stack = [(root, False)]
    while stack:
        node, is_ready = stack.pop()
        if is_ready:
            order.append(node)
        elif id(node) not in seen:
            seen.add(id(node))
            stack.append((node, True))
            for socket in SHADER_INPUTS.get(node.kind, ()):
                link = node.inputs.get(socket)
                if isinstance(link, Link):
                    stack.append((link.node, False))
    return order
