"""rows -> scenes: metals, of Principled and of the nodes, and anisotropy."""

from ..nodes import glossy, node, principled
from .scene import LEAN, QUICK, Scene, ball_of

GOLD = (0.95, 0.64, 0.3)
TANGENT = node("Tangent", direction_type="RADIAL", axis="X")


def _metal(name: str, shows: str, tags: tuple[str, ...] = (), **inputs: object) -> Scene:
    shader = principled(**({"Base_Color": GOLD, "Metallic": 1.0} | inputs))
    return Scene(f"metal_{name}", shows, ball_of(shader), LEAN, tags)


def _glossy(name: str, shows: str, roughness: float, **more: object) -> Scene:
    return Scene(f"glossy_{name}", shows, ball_of(glossy(roughness, 0.85, 0.7, 0.5, **more)), LEAN)


ROWS = (
    _metal("mirror", "Metal of roughness 0: a tinted mirror.", QUICK, Roughness=0.0),
    Scene("metal_bounces", "Metal of roughness 0.3, with all bounces and its caustics.",
          ball_of(principled(Base_Color=GOLD, Metallic=1.0, Roughness=0.3))),
    Scene("mirror_bounces", "A mirror, with all bounces and its caustics.",
          ball_of(principled(Base_Color=GOLD, Metallic=1.0, Roughness=0.0))),
    _metal("roughness_01", "Metal of roughness 0.1.", Roughness=0.1),
    _metal("roughness_03", "Metal of roughness 0.3.", Roughness=0.3),
    _metal("roughness_05", "Metal of roughness 0.5.", Roughness=0.5),
    _metal("roughness_1", "Metal of roughness 1, with energy compensation.", Roughness=1.0),
    _metal("roughness_1_ggx", "Metal of roughness 1, without energy compensation.",
           Roughness=1.0, distribution="GGX"),
    _metal("tint", "A coloured edge by specular tint (F82).",
           Roughness=0.2, Specular_Tint=(0.1, 0.5, 1.0)),
    _metal("half", "Metallic 0.5: half metal, half dielectric.", Metallic=0.5, Roughness=0.3),
    _metal("anisotropic_05", "Anisotropy 0.5.", Roughness=0.4, Anisotropic=0.5),
    _metal("anisotropic_1", "Anisotropy 1.", Roughness=0.4, Anisotropic=1.0),
    _metal("anisotropic_turned", "Anisotropy 0.8, turned by a fifth of a circle.",
           Roughness=0.4, Anisotropic=0.8, Anisotropic_Rotation=0.2),
    _metal("anisotropic_tangent", "Anisotropy 0.8 about a tangent of another axis.",
           Roughness=0.4, Anisotropic=0.8, Tangent=TANGENT),
    _metal("film", "Metal under a thin film of 400 nm.", Roughness=0.2,
           Thin_Film_Thickness=400.0, Thin_Film_IOR=1.4),
    _glossy("sharp", "Glossy of roughness 0: a mirror.", 0.0),
    _glossy("ggx", "Glossy GGX.", 0.35),
    _glossy("beckmann", "Glossy Beckmann.", 0.35, distribution="BECKMANN"),
    _glossy("beckmann_rough", "Glossy Beckmann of roughness 1.", 1.0, distribution="BECKMANN"),
    _glossy("ashikhmin", "Glossy Ashikhmin-Shirley.", 0.35, distribution="ASHIKHMIN_SHIRLEY"),
    _glossy("multi", "Glossy multi-scatter GGX, rough.", 0.8, distribution="MULTI_GGX"),
    _glossy("ggx_anisotropic", "Glossy GGX, anisotropy 0.7.", 0.4, Anisotropy=0.7),
    _glossy("beckmann_anisotropic", "Glossy Beckmann, anisotropy 0.7.", 0.4,
            distribution="BECKMANN", Anisotropy=0.7),
    _glossy("ashikhmin_anisotropic", "Glossy Ashikhmin-Shirley, anisotropy 0.7.", 0.4,
            distribution="ASHIKHMIN_SHIRLEY", Anisotropy=0.7),
    _glossy("multi_anisotropic", "Glossy multi-scatter GGX, anisotropy -0.7.", 0.6,
            distribution="MULTI_GGX", Anisotropy=-0.7),
    Scene("metallic_f82", "Metallic node, F82.",
          ball_of(node("BsdfMetallic", fresnel_type="F82", Base_Color=GOLD, Roughness=0.25,
                       Edge_Tint=(0.2, 0.6, 1.0))), LEAN),
    Scene("metallic_conductor", "Metallic node, measured copper.",
          ball_of(node("BsdfMetallic", fresnel_type="PHYSICAL_CONDUCTOR", Roughness=0.3,
                       IOR=(0.27, 0.68, 1.32), Extinction=(3.61, 2.63, 2.29))), LEAN),
    Scene("metallic_conductor_film", "Metallic node, titanium under a film of 150 nm.",
          ball_of(node("BsdfMetallic", fresnel_type="PHYSICAL_CONDUCTOR", Roughness=0.2,
                       IOR=(2.76, 2.54, 2.27), Extinction=(3.83, 3.43, 3.04),
                       Thin_Film_Thickness=150.0, Thin_Film_IOR=2.4)), LEAN),
)  # fmt: skip
