"""context -> Value.  What shaders read of the hit point itself, each once for a whole material."""

import numpy as np

from ..arrays import F32, dot
from ..bsdf.kinds import CAMERA
from .context import Context
from .values import VECTOR, Array, read


def _normal(context: Context) -> Array:
    return context.normal


def _position(context: Context) -> Array:
    return context.position


def _valid_normal(context: Context) -> Array:
    return context.valid_normal


def _cosine(context: Context) -> Array:
    return context.cosine


def _facing(context: Context) -> Array:
    return dot(context.normal, context.wo)


def _normal_cosine(context: Context) -> Array:
    return np.maximum(dot(context.normal, context.wo), F32(0))


def _back(context: Context) -> Array:
    return context.back.astype(F32)


def _blur(context: Context) -> Array:
    assert context.arrival.blur is not None
    return context.of(context.arrival.blur)


def _from_camera(context: Context) -> Array:
    return context.has_kind(CAMERA)


def _after_matte(context: Context) -> Array:
    return context.is_after_matte


POSITION = read(_position, kind=VECTOR)  # in the world; of the world itself, where rays go
NORMAL = read(_normal, kind=VECTOR)
VALID_NORMAL = read(_valid_normal, kind=VECTOR)
COSINE = read(_cosine)  # of the viewer's direction at the valid normal
FACING = read(_facing)  # the cosine at the shading normal, of either sign
NORMAL_COSINE = read(_normal_cosine)  # the same, at least 0
BACK = read(_back)  # 1 where the surface is seen from behind
BLUR = read(_blur)  # the least roughness alpha that filter glossy asks for
FROM_CAMERA = read(_from_camera)  # 1 where the ray comes from the camera
AFTER_MATTE = read(_after_matte)  # 1 where the ray comes from a matte surface

# Steps that depend on the viewer's direction
OF_VIEWER = _valid_normal, _cosine, _facing, _normal_cosine
