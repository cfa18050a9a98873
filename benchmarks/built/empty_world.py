"""numbers -> nothing but an even world.  What a picture costs before there is anything in it."""

from ...examples._stage import camera
from .shapes import begin


def build():
    """Make an empty file with a camera."""
    begin(320, 240, world=(0.2, 0.4, 0.8))
    camera(at=(0, -5, 0), to=(0, 0, 0))
