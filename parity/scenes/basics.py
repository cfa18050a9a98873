"""rows -> scenes: Principled's base, from matte to polished, and Diffuse."""

from ..nodes import diffuse, node, principled
from .scene import LEAN, QUICK, Scene, ball_of


def _base(name: str, shows: str, **inputs: object) -> Scene:
    return Scene(f"principled_{name}", shows, ball_of(principled(**inputs)), LEAN)


ROWS = (
    Scene("diffuse", "A matte ball, floor and wall: bounces of colour.", ball_of(diffuse()),
          tags=QUICK),
    Scene("diffuse_rough", "Diffuse of roughness 1 (Oren-Nayar).",
          ball_of(diffuse(0.8, 0.7, 0.5, roughness=1.0))),
    Scene("diffuse_half_rough", "Diffuse of roughness 0.4, saturated.",
          ball_of(diffuse(0.9, 0.3, 0.1, roughness=0.4))),
    Scene("principled_default", "Principled as it is when new: roughness 0.5, index 1.5.",
          ball_of(principled())),
    _base("polished", "Roughness 0: a sharp dielectric reflection over the base.", Roughness=0.0),
    _base("roughness_01", "Roughness 0.1: a small highlight.", Roughness=0.1),
    _base("roughness_03", "Roughness 0.3.", Roughness=0.3),
    _base("roughness_1", "Roughness 1.", Roughness=1.0),
    _base("ggx", "GGX without energy compensation, roughness 0.7.", Roughness=0.7,
          distribution="GGX"),
    _base("ior_1", "Index 1: no reflection at all.", IOR=1.0, Roughness=0.1),
    _base("ior_105", "Index 1.05: reflection at the rim only.", IOR=1.05, Roughness=0.1),
    _base("ior_25", "Index 2.5, as diamond.", IOR=2.5, Roughness=0.2),
    _base("ior_below_1", "Index 0.75: total reflection at the rim.", IOR=0.75, Roughness=0.2),
    _base("specular_level_0", "Specular level 0 takes the reflection away.",
          Specular_IOR_Level=0.0, Roughness=0.2),
    _base("specular_level_1", "Specular level 1 doubles the reflection.",
          Specular_IOR_Level=1.0, Roughness=0.2),
    _base("specular_tint", "A tinted dielectric reflection.",
          Specular_Tint=(0.2, 0.5, 1.0), IOR=2.0, Roughness=0.2),
    _base("diffuse_roughness", "Diffuse roughness 1 under the reflection.",
          Diffuse_Roughness=1.0, Roughness=0.4),
    _base("white", "Base colour 1: nothing is lost.", Base_Color=(1, 1, 1), Roughness=0.6),
    _base("black", "Base colour 0: the reflection alone.", Base_Color=(0, 0, 0), Roughness=0.35),
    _base("subsurface", "Subsurface weight 1 with a radius of nothing: its albedo.",
          Subsurface_Weight=1.0, Subsurface_Scale=0.0),
    _base("subsurface_half", "Subsurface weight 0.5 with a small radius.",
          Subsurface_Weight=0.5, Subsurface_Scale=0.02),
    Scene("principled_floor", "A polished floor under a matte ball: reflections of the scene.",
          lambda s: (s.room(floor_of=principled(Roughness=0.15)), s.key(), s.ball(diffuse())),
          LEAN),
    Scene("two_materials", "Balls of three materials that light each other.",
          lambda s: (s.room(), s.key(), s.ball(diffuse(0.8, 0.1, 0.1), (-1, 0, 0.7), 0.7),
                     s.ball(principled(Metallic=1.0, Roughness=0.25), (0.7, 0.2, 0.9), 0.9),
                     s.ball(node("BsdfTranslucent"), (0.1, -1.3, 0.4), 0.4))),
)  # fmt: skip
