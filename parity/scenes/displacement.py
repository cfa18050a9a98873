"""rows -> scenes: meshes whose vertices materials move."""

from typing import Any

from ..nodes import Node, diffuse, glossy, math, node
from .bumps import WAVES
from .scene import LEAN, QUICK, Scene

GENERATED = node("TexCoord")["Generated"]
GRAIN = node("TexNoise", Vector=GENERATED, Scale=6.0, Detail=1.0)
WAY = node("VectorMath", operation="SCALE", Vector=node("TexCoord")["Normal"], Scale=WAVES)
HILLS = node("Displacement", Height=WAVES, Scale=0.08, Midlevel=0.2)
FINE = node("Displacement", Height=GRAIN, Scale=0.3, Midlevel=0.5)
SHOWN = node("BsdfDiffuse", Color=GENERATED)


def _displaced(
    s: Any,
    shader: Node,
    by: Node,
    method: str = "DISPLACEMENT",
    scale: Any = None,
    segments: int = 96,
    **options: Any,
) -> Any:
    ball = s.standard(shader, segments=segments, **options)
    s.displace(ball, by)
    ball.data.materials[0].displacement_method = method
    if scale is not None:
        ball.scale = scale
    return ball


def _sharp(s: Any, by: Node, method: str) -> None:
    """Displace a ball whose northern half is flat and whose equator is sharp."""
    ball = _displaced(s, diffuse(), by, method, segments=48)
    mesh = ball.data
    z = [polygon.center.z for polygon in mesh.polygons]
    mesh.polygons.foreach_set("use_smooth", [height < 0.3 for height in z])
    sharp = mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
    ends = [[mesh.vertices[v].co.z for v in edge.vertices] for edge in mesh.edges]
    sharp.data.foreach_set("value", [max(abs(a) for a in pair) < 1e-4 for pair in ends])


def _mapped(s: Any, by: Node) -> None:
    """Displace a ball with a UV map, which looks along y."""
    mesh = _displaced(s, diffuse(), by).data
    uv = mesh.uv_layers.new(name="UV")
    places = [mesh.vertices[loop.vertex_index].co for loop in mesh.loops]
    numbers = [n for place in places for n in (place.x * 0.5 + place.z * 0.3, place.z * 0.5)]
    uv.data.foreach_set("uv", numbers)


def _twice(s: Any) -> None:
    """Show one displaced mesh twice."""
    ball = _displaced(s, diffuse(), FINE)
    ball.scale, ball.location = (0.6, 0.6, 0.6), (-0.8, 0, 1)
    other = ball.copy()
    other.scale, other.location = (0.5, 0.8, 0.5), (0.9, 0, 1)
    s.link(other)


def _half(s: Any) -> None:
    """Displace only those faces of a ball that have a material of their own."""
    ball = _displaced(s, diffuse(), HILLS)
    ball.data.materials.append(s.material(diffuse(0.2, 0.4, 0.7)))
    ball.data.polygons.foreach_set(
        "material_index", [int(polygon.center.x > 0) for polygon in ball.data.polygons]
    )


def _row(name: str, shows: str, build: Any, tags: tuple[str, ...] = ()) -> Scene:
    return Scene(f"displacement_{name}", shows, build, LEAN, tags)


ROWS = (
    _row("smooth", "A displaced, smooth ball.", lambda s: _displaced(s, diffuse(), HILLS), QUICK),
    _row("both", "A ball displaced, with bump.",
         lambda s: _displaced(s, diffuse(), HILLS, "BOTH", segments=32), QUICK),
    _row("both_glossy", "A glossy ball displaced, with bump.",
         lambda s: _displaced(s, glossy(0.3), FINE, "BOTH", segments=32)),
    _row("both_flat", "Facets displaced, with bump.",
         lambda s: _displaced(s, diffuse(), HILLS, "BOTH", segments=32, smooth=False)),
    _row("flat", "Displaced facets.",
         lambda s: _displaced(s, diffuse(), HILLS, smooth=False)),
    _row("generated", "A displaced ball that shows its generated coordinates.",
         lambda s: _displaced(s, SHOWN, FINE)),
    _row("scaled", "A ball displaced in its own, uneven space.",
         lambda s: _displaced(s, diffuse(), HILLS, scale=(0.6, 1.0, 1.2))),
    _row("scaled_both", "The same, with bump.",
         lambda s: _displaced(s, diffuse(), HILLS, "BOTH", (0.6, 1.0, 1.2), 32)),
    _row("mirrored", "A mirrored ball displaced.",
         lambda s: _displaced(s, diffuse(), HILLS, scale=(-1.0, 1.0, 1.0))),
    _row("world", "A ball displaced in the world's space.",
         lambda s: _displaced(s, diffuse(), node("Displacement", Height=WAVES, Scale=0.08,
                              Midlevel=0.0, space="WORLD"), scale=(0.6, 1.0, 1.2))),
    _row("vector", "A ball displaced by vectors of its own space.",
         lambda s: _displaced(s, diffuse(), node("VectorDisplacement", Vector=WAY, Midlevel=0.1,
                              Scale=0.1, space="OBJECT"), scale=(0.7, 1.0, 1.1))),
    _row("vector_world", "A ball displaced by vectors of the world.",
         lambda s: _displaced(s, diffuse(), node("VectorDisplacement", Vector=WAY, Midlevel=0.1,
                              Scale=0.1, space="WORLD"))),
    _row("vector_tangent", "A ball displaced by vectors along its surface.",
         lambda s: _mapped(s, node("VectorDisplacement", Midlevel=0.0, Scale=0.08,
                           Vector=node("CombineXYZ", X=WAVES, Y=math("MULTIPLY", WAVES, 0.7),
                                       Z=0.4), space="TANGENT"))),
    _row("sharp", "A ball with flat faces and a sharp edge, displaced.",
         lambda s: _sharp(s, HILLS, "DISPLACEMENT"), QUICK),
    _row("sharp_both", "The same, with bump.", lambda s: _sharp(s, HILLS, "BOTH")),
    _row("twice", "A displaced mesh that is shown twice.", _twice),
    _row("half", "A ball of which one half is displaced.", _half),
)  # fmt: skip
