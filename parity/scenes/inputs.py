"""rows -> scenes: what a shader may ask: light path, geometry, angles, arithmetic."""

from typing import Any

from ..nodes import Node, clear, diffuse, glossy, glow, math, mix, node
from .scene import LEAN, Scene, ball_of

PATH, GEOMETRY = node("LightPath"), node("NewGeometry")
RED, BLUE = diffuse(0.8, 0.1, 0.1), diffuse(0.1, 0.2, 0.8)


def _by(name: str, shows: str, factor: Any, a: Node = RED, b: Node = BLUE, **more: Any) -> Scene:
    return Scene(name, shows, ball_of(mix(factor, a, b), **more))


def _colour(name: str, shows: str, value: Any, **more: Any) -> Scene:
    """Return a scene of a ball that glows by a value and is matte as well."""
    shader = node("AddShader", Shader=node("Emission", Color=value, Strength=0.7),
                  Shader_001=diffuse(0.3, 0.3, 0.3))  # fmt: skip
    return Scene(name, shows, ball_of(shader, **more))


def _path(output: str, shows: str, a: Node = RED, b: Node = BLUE) -> Scene:
    return _by(f"path_{output.lower().replace(' ', '_')}", shows, PATH[output], a, b)


def _bowl(s: Any, shader: Node) -> None:
    bowl = s.standard(shader, at=(0, 0, 1.1))
    keep = [face for face in bowl.data.polygons if face.center.z < 0.25]
    points = [tuple(vertex.co) for vertex in bowl.data.vertices]
    faces = [tuple(face.vertices) for face in keep]
    bowl.hide_render = True
    s.mesh("Bowl", points, faces, shader, (0, 0, 1.1), (-35, 0, 0), smooth=True)


ROWS = (
    _path("Is Camera Ray", "Red to the camera's eye only.", BLUE, RED),
    _path("Is Shadow Ray", "It throws no shadow.", RED, clear()),
    _path("Is Diffuse Ray", "Its bounce light has another colour.", RED, glow(0.8, 0.1, 1.0, 0.2)),
    Scene("path_is_glossy_ray", "In a mirror it is blue.",
          lambda s: (s.room(floor_of=glossy(0.2)), s.key(),
                     s.ball(mix(PATH["Is Glossy Ray"], RED, BLUE))), LEAN),
    Scene("path_is_transmission_ray", "Through glass it is blue.",
          lambda s: (s.room(), s.key(), s.ball(mix(PATH["Is Transmission Ray"], RED, BLUE)),
                     s.box(node("BsdfGlass", Roughness=0.0), (0.4, -1.6, 0.8), (1, 0.2, 1.6))),
          LEAN),
    Scene("path_is_singular_ray", "In a sharp mirror it glows.",
          lambda s: (s.room(floor_of=glossy(0.0)), s.key(),
                     s.ball(mix(PATH["Is Singular Ray"], RED, glow(0.6, 0.2, 0.5, 1.0)))), LEAN),
    _by("path_ray_length", "Colour by the length of the ray that finds it.",
        math("MULTIPLY", PATH["Ray Length"], 0.12)),
    _by("path_ray_depth", "The more bounces, the bluer.",
        math("GREATER_THAN", PATH["Ray Depth"], 0.5)),
    Scene("path_diffuse_depth", "Another colour after two matte bounces, on all surfaces.",
          lambda s: (s.room(floor_of=mix(math("GREATER_THAN", PATH["Diffuse Depth"], 1.5),
                                         diffuse(), glow(0.5, 0.2, 1.0, 0.3))),
                     s.key(), s.ball(diffuse()))),
    Scene("path_transparent_depth", "The second layer of a transparent ball is red.",
          ball_of(mix(math("GREATER_THAN", PATH["Transparent Depth"], 0.5), clear(0.9, 0.9, 0.9),
                      RED))),
    _by("fresnel", "Mixed by Fresnel of index 1.5.", node("Fresnel", IOR=1.5), b=glossy(0.2)),
    Scene("fresnel_flat", "Fresnel of a facetted normal.",
          ball_of(mix(node("Fresnel", IOR=2.0, Normal=GEOMETRY["True Normal"]), RED, BLUE),
                  segments=12)),
    _by("layer_weight_facing", "Mixed by Layer Weight, facing.",
        node("LayerWeight", Blend=0.4)["Facing"]),
    _by("layer_weight_fresnel", "Mixed by Layer Weight, Fresnel.",
        node("LayerWeight", Blend=0.3)["Fresnel"]),
    Scene("backfacing", "Red outside, blue inside: an open bowl.",
          lambda s: _bowl(s, mix(GEOMETRY["Backfacing"], RED, BLUE))),
    _colour("geometry_normal", "Coloured by its normal.", GEOMETRY["Normal"]),
    _colour("geometry_true_normal", "Coloured by the normal of its facets.",
            GEOMETRY["True Normal"], segments=12),
    _colour("geometry_position", "Coloured by its place in the world.", GEOMETRY["Position"]),
    _colour("geometry_incoming", "Coloured by where it is seen from.", GEOMETRY["Incoming"]),
    _colour("math_chain", "Arithmetic of constants and of the ray's length.",
            math("MULTIPLY", math("SINE", math("MULTIPLY", PATH["Ray Length"], 3.0)), 0.5)),
    _colour("mix_colours", "Two colours mixed by the angle.",
            node("MixRGB", blend_type="MIX", Color1=(0.9, 0.5, 0.1), Color2=(0.1, 0.3, 0.9),
                 Fac=node("LayerWeight", Blend=0.5)["Facing"])),
    _colour("constant_colours", "RGB, Value and Mix of constants, multiplied.",
            node("MixRGB", blend_type="MULTIPLY", Fac=0.7, Color1=(0.9, 0.5, 0.1),
                 Color2=(0.3, 0.8, 0.5))),
    Scene("roughness_by_angle", "Roughness that grows towards the rim.",
          ball_of(glossy(node("LayerWeight", Blend=0.5)["Facing"])), LEAN),
)  # fmt: skip
