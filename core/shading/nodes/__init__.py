"""node kind -> function.  What every node that makes numbers means; add one with a line here."""

from .attributes import CARRIED
from .colours import COLOURS
from .constants import CONSTANTS
from .coordinates import PLACES
from .elements import ELEMENTS
from .hit import HIT
from .ies import IES
from .image import IMAGES
from .lamp import LAMP
from .light import LIGHT
from .math import MATHS
from .mix import MIXES
from .normals import NORMALS
from .objects import OBJECTS
from .procedural import PROCEDURAL
from .ramps import RAMPS
from .spectra import SPECTRA
from .textures import TEXTURES
from .traced import TRACED
from .triangle import TRIANGLE
from .turns import TURNS
from .vectors import VECTORS

NODES = {
    **CARRIED,
    **COLOURS,
    **CONSTANTS,
    **ELEMENTS,
    **HIT,
    **IES,
    **IMAGES,
    **LIGHT,
    **MATHS,
    **MIXES,
    **NORMALS,
    **OBJECTS,
    **PLACES,
    **PROCEDURAL,
    **RAMPS,
    **SPECTRA,
    **TEXTURES,
    **TRACED,
    **TRIANGLE,
    **TURNS,
    **VECTORS,
}
LAMP_NODES = {**NODES, **LAMP}  # in the shaders of lamps

__all__ = ["LAMP_NODES", "NODES"]
