"""purpose, bounce -> dimension.  The name of every pair of random numbers that a path uses.

A dimension is the number of a pair: pairs are stratified in themselves and independent of each
other (see `patterns`).  Only those that a plan draws are ever computed.
"""

PIXEL, LENS, TIME = 0, 1, 2  # of the camera ray
LIGHT, LIGHT_CHOICE, SCATTER, CHOICE, ROULETTE, WORLD = 3, 4, 5, 6, 7, 8  # of each bounce

_PURPOSES = 9  # room for each bounce's purposes
_LAMPS = 64  # lamps that may have a pair of their own
LAST_ITEM = _LAMPS - 1
OCCLUSION_ITEM = 1  # of WORLD: what ambient occlusion draws

# Bounces beyond this draw independent numbers: what stratification is worth there is less than
# what its tables cost.
STRATIFIED_BOUNCES = 4


def dimension(purpose: int, bounce: int, item: int = 0) -> int:
    """Return the dimension of `purpose` at `bounce` (0 at the camera's hit), for lamp `item`."""
    return purpose + _PURPOSES * (item % _LAMPS + _LAMPS * bounce)


def is_stratified(dimension: int) -> bool:
    """Tell whether this dimension comes from the pattern's tables."""
    return dimension < _PURPOSES * _LAMPS * STRATIFIED_BOUNCES
