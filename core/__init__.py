"""scene, settings -> picture.  The renderer itself; it knows nothing of Blender."""

from .compile import compile_plan
from .optics import Aperture, Eye, Panorama
from .plan import Plan
from .render import Picture, Progress, render
from .scene import (
    Camera,
    Cancelled,
    Instance,
    Lamp,
    Link,
    Material,
    Mesh,
    Node,
    Note,
    RayKinds,
    Scene,
    SceneError,
    StarField,
    Stars,
    World,
)
from .settings import OPTIONS, Option, Settings

__all__ = [
    "OPTIONS",
    "Aperture",
    "Camera",
    "Cancelled",
    "Eye",
    "Instance",
    "Lamp",
    "Link",
    "Material",
    "Mesh",
    "Node",
    "Note",
    "Option",
    "Panorama",
    "Picture",
    "Plan",
    "Progress",
    "RayKinds",
    "Scene",
    "SceneError",
    "Settings",
    "StarField",
    "Stars",
    "World",
    "compile_plan",
    "render",
]
