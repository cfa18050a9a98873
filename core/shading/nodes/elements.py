"""node -> Value.  What strands, points and volumes tell of themselves, as surfaces answer.

Surfaces are none of these: they are 0, as in Cycles.  What volumes have, meshes may carry as
attributes of the same names.
"""

import numpy as np

from ...geometry.attributes import FACTOR, VECTOR
from ...scene import Node
from .. import values
from ..attributes import VOLUME_INFO, read_attribute
from ..graph import Graph, NodeFunction
from ..values import COLOUR, FLOAT, Value, constant

# Outputs that are vectors; the others are numbers
VECTORS = ("Tangent Normal", "Position")


def _nothing(graph: Graph, node: Node, output: str) -> Value:
    return constant(np.zeros(1), values.VECTOR if output in VECTORS else FLOAT)


def _volume_info(graph: Graph, node: Node, output: str) -> Value | None:
    name = VOLUME_INFO.get(output)
    if name is None:
        return None
    return (
        read_attribute(name, VECTOR, COLOUR) if output == "Color" else read_attribute(name, FACTOR)
    )


ELEMENTS: dict[str, NodeFunction] = {
    "HairInfo": _nothing,
    "PointInfo": _nothing,
    "VolumeInfo": _volume_info,
}
