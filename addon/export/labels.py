"""bpy instances -> core.scene.Label.  What shaders can tell objects by (Object Info)."""

import bpy

from ...core.scene import Label, Particle

_MASK = 0xFFFFFFFF


def read_label(item: bpy.types.DepsgraphObjectInstance, frame: float = 0.0) -> Label:
    """Return the label of one item of the depsgraph at a frame.

    Objects that stand for themselves are random by their name, instances by Blender's number; what
    makes an instance gives it its colour.
    """
    object = item.object
    red, green, blue, alpha = (item.parent if item.is_instance else object).color
    if not item.is_instance:
        random = hashed(object.name)
        return Label((red, green, blue), alpha, object.pass_index, random / _MASK)
    x, y, z = (0.5 * (value - 1.0) for value in item.orco)
    u, v = item.uv
    random = (item.random_id & _MASK) / _MASK
    colour, shown = (red, green, blue), _particle(item, frame)
    return Label(colour, alpha, object.pass_index, random, (x, y, z), (u, v), shown)


def _particle(item: bpy.types.DepsgraphObjectInstance, frame: float) -> Particle | None:
    """Return the particle that an instance stands for; children of particles are none (Cycles)."""
    system = item.particle_system
    if system is None or not 0 <= item.persistent_id[0] < len(system.particles):
        return None
    index = item.persistent_id[0]
    particle = system.particles[index]
    return Particle(
        index,
        frame - particle.birth_time,
        particle.lifetime,
        particle.size,
        tuple(particle.location),
        tuple(particle.velocity),
        tuple(particle.angular_velocity),
    )


def hashed(name: str) -> int:
    """Return Blender's hash of a name, 32 bits.

    Source: Jenkins 2006, "lookup3.c", `final`, of the sum of the bytes in base 37.
    """
    number = 0
    for byte in name.encode():
        number = (number * 37 + byte) & _MASK
    b = c = 0xDEADBEEF + (2 << 2) + 13
    a = (b + number) & _MASK
    for turn in ((14, 11, 25), (16, 4, 14)):
        c = ((c ^ b) - _rotated(b, turn[0])) & _MASK
        a = ((a ^ c) - _rotated(c, turn[1])) & _MASK
        b = ((b ^ a) - _rotated(a, turn[2])) & _MASK
    return ((c ^ b) - _rotated(b, 24)) & _MASK


def _rotated(number: int, by: int) -> int:
    return (number << by | number >> 32 - by) & _MASK
