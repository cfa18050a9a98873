"""rows -> scenes: what lies on Principled's base: coat, sheen, film, emission; and its alpha."""

from ..nodes import node, principled
from .scene import LEAN, Scene, ball_of

FLAT = node("NewGeometry")["True Normal"]


def _layer(name: str, shows: str, **inputs: object) -> Scene:
    return Scene(name, shows, ball_of(principled(**inputs)), LEAN)


ROWS = (
    _layer("coat", "A smooth coat over a rough base.", Coat_Weight=1.0, Roughness=0.6),
    _layer("coat_half", "Coat weight 0.5 of roughness 0.", Coat_Weight=0.5, Coat_Roughness=0.0,
           Roughness=0.6),
    _layer("coat_rough", "A coat of roughness 0.5 over a polished metal.", Coat_Weight=1.0,
           Coat_Roughness=0.5, Metallic=1.0, Roughness=0.1),
    _layer("coat_tint", "A tinted coat: more colour at the rim.", Coat_Weight=1.0,
           Coat_Tint=(0.3, 0.6, 1.0), Base_Color=(0.8, 0.8, 0.8), Roughness=0.5),
    _layer("coat_ior", "A coat of index 2.2.", Coat_Weight=1.0, Coat_IOR=2.2, Roughness=0.5),
    Scene("coat_normal", "A facetted coat on a smooth base.",
          ball_of(principled(Coat_Weight=1.0, Coat_Normal=FLAT, Roughness=0.4), segments=12), LEAN),
    _layer("sheen", "Sheen of weight 1 on a dark base.", Sheen_Weight=1.0,
           Base_Color=(0.08, 0.05, 0.12), Roughness=0.8),
    _layer("sheen_sharp", "Sheen of roughness 0.1.", Sheen_Weight=1.0, Sheen_Roughness=0.1,
           Base_Color=(0.2, 0.05, 0.05)),
    _layer("sheen_rough_tint", "Sheen of roughness 1, tinted.", Sheen_Weight=0.8,
           Sheen_Roughness=1.0, Sheen_Tint=(0.2, 0.6, 1.0), Base_Color=(0.2, 0.2, 0.2)),
    _layer("emission", "Principled that glows.", Emission_Strength=1.5,
           Emission_Color=(1.0, 0.6, 0.3)),
    _layer("emission_coat", "Emission under a tinted coat.", Emission_Strength=1.0,
           Coat_Weight=1.0, Coat_Tint=(0.5, 0.7, 1.0)),
    _layer("alpha_0", "Alpha 0: nothing, not even a shadow.", Alpha=0.0),
    _layer("alpha_half", "Alpha 0.5, with half a shadow.", Alpha=0.5),
    _layer("alpha_glass", "Alpha 0.4 of coloured glass.", Alpha=0.4, Transmission_Weight=1.0,
           Roughness=0.0),
    _layer("film_dielectric", "A thin film of 350 nm on a dielectric.", Thin_Film_Thickness=350.0,
           Thin_Film_IOR=2.0, Roughness=0.15, Base_Color=(0.05, 0.05, 0.05)),
    _layer("film_transmission", "A soap bubble: a film on glass.", Thin_Film_Thickness=300.0,
           Thin_Film_IOR=1.6, Transmission_Weight=1.0, Roughness=0.1, IOR=1.2),
    Scene("coat_bounces", "A coat over a base, with all bounces.",
          ball_of(principled(Coat_Weight=1.0, Coat_Roughness=0.1, Coat_Tint=(0.9, 0.6, 0.4)))),
    Scene("alpha_bounces", "Alpha 0.5, with all bounces.", ball_of(principled(Alpha=0.5))),
    _layer("everything", "All layers at once.", Metallic=0.3, Roughness=0.4,
           Transmission_Weight=0.3, Coat_Weight=0.5, Coat_Tint=(0.9, 0.7, 0.5),
           Sheen_Weight=0.3, Anisotropic=0.3,
           Emission_Strength=0.1, Specular_Tint=(0.9, 1.0, 0.8), Alpha=0.9),
)  # fmt: skip
