"""view layer -> Layer.  What is asked of a picture besides Combined, as plain data."""

from dataclasses import dataclass

# Kinds of cryptomattes: what tells the parts of the picture apart
MATTES = ("CryptoObject", "CryptoMaterial", "CryptoAsset")
MOST_LEVELS = 16


@dataclass(frozen=True)
class Mist:
    """Where mist begins [m], how deep it is [m], and the power of its growth."""

    start: float = 5.0
    depth: float = 25.0
    power: float = 2.0


@dataclass(frozen=True)
class Layer:
    """The passes of a view layer, by the names in `film.passes`.

    aovs: values that shaders write, name -> whether it is a colour; light_groups: lights whose part
    of the picture is kept; mattes of `MATTES`, with so many `levels`: parts of a pixel told apart.
    Surfaces of less than alpha_threshold are looked through by passes that show one surface.
    occlusion_distance [m]: farther away nothing occludes.  is_denoised: if the settings say so.
    """

    passes: tuple[str, ...] = ()
    aovs: tuple[tuple[str, bool], ...] = ()
    light_groups: tuple[str, ...] = ()
    mattes: tuple[str, ...] = ()
    levels: int = 6
    alpha_threshold: float = 0.5
    mist: Mist = Mist()
    occlusion_distance: float = 10.0
    is_denoised: bool = True

    @property
    def pairs(self) -> int:
        """How many pictures a cryptomatte takes: each holds two levels."""
        return (min(MOST_LEVELS, self.levels) + 1) // 2
