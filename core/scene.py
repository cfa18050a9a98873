"""descriptions -> Scene.  What is rendered, as plain frozen data, checked once at this door.

Geometry is float64 until the plan has moved it to a local origin.  Lengths are metres (of the
scene's own unit), angles radians, light in W, W/m2, W/sr or W/(sr m2) as each field says,
colours in the file's scene-linear space.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from .layer import Layer
from .optics import Aperture, Eye, Panorama

# Kinds of rays, a bit each.  A ray is of the kind of what scattered it last; a transmitted one is
# diffuse or glossy besides, but only its transmission counts for what sees what (Cycles).
CAMERA, DIFFUSE, GLOSSY, TRANSMISSION, SHADOW = 1, 2, 4, 8, 16

FARTHEST = 1e18  # [m]; squares of lengths overflow in float32 beyond

EVERY_SET = (
    1 << 64
) - 1  # of light linking: a mask with a bit for each of the 64 sets there can be

Colour = tuple[float, float, float]
Socket = Union[float, Colour, str, bool, "Link", None]


class SceneError(ValueError):
    """Input that cannot be rendered; the message names the culprit."""


class Cancelled(Exception):  # noqa: N818  (not an error: the user asked for it)
    """The user stopped the render before there was anything to keep."""


@dataclass(frozen=True)
class Note:
    """One thing in the scene that the picture does not honour, by the name of its owner."""

    owner: str  # "Material 'Wood'", "Light 'Sun'", "Render settings"
    what: str  # "Noise Texture 'Grain' feeding Base Color is replaced by the socket's own value"


@dataclass(frozen=True, eq=False)
class Node:
    """A shading node: Blender's type without 'ShaderNode', its sockets by identifier.

    An input is a constant, a `Link`, or absent; properties are the node's own choices
    (`distribution`, `operation`, ...).  Nodes are shared, so a surface is a DAG.
    """

    kind: str  # "BsdfPrincipled", "Emission", "MixShader", ...
    name: str = ""
    inputs: Mapping[str, Socket] = field(default_factory=dict)
    properties: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Link:
    """The output of another node; `default` is what the input's own value would have been."""

    node: Node
    output: str
    default: Socket = None


@dataclass(frozen=True, eq=False)
class Material:
    """A named surface shader; `surface=None` is a surface that neither scatters nor emits.

    Without `transparent_shadow` light passes no transparent part of it.  emission_sampling: NONE,
    AUTO, FRONT, BACK or FRONT_BACK, the sides that are sampled where it glows.  displacement: the
    way by which the surface is displaced; displacement_method: BUMP bends its normals only,
    DISPLACEMENT moves the vertices of meshes, BOTH does both.  bump_width [pixels]: how far beside
    the hit heights are looked at if no node says; bump_softening: MICROFACET, CUBIC or NONE, how
    matte closures with bent normals fade towards the terminator (`terminator.SOFTENINGS`);
    bump_at_rest: whether BOTH bends the normals that flat faces had before they were displaced.
    aovs: by name, what the surface writes into passes of the user's own.
    """

    name: str
    surface: Node | None = None
    transparent_shadow: bool = True
    emission_sampling: str = "AUTO"
    index: int = 0  # as the user numbers it
    displacement: Link | None = None
    displacement_method: str = "BUMP"
    bump_width: float = 0.1
    bump_softening: str = "MICROFACET"
    bump_at_rest: bool = True
    aovs: Mapping[str, Node] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for what, choices in (
            ("displacement_method", ("BUMP", "DISPLACEMENT", "BOTH")),
            ("bump_softening", ("MICROFACET", "CUBIC", "NONE")),
        ):
            found = getattr(self, what)
            if found not in choices:
                what = what.replace("_", " ")
                raise SceneError(f"Material '{self.name}': unknown {what} {found!r}")

    @property
    def moves(self) -> bool:
        """Whether it moves vertices."""
        return self.displacement is not None and self.displacement_method != "BUMP"

    @property
    def bumps(self) -> bool:
        """Whether its displacement bends normals."""
        return self.displacement is not None and self.displacement_method != "DISPLACEMENT"


UNIT_SPACE = (np.zeros(3), np.ones(3))

# Names of attributes that no user gave: the UV map and the colours that the file renders with, what
# the shape of a mesh says (see `geometry.neighbours`), and what custom properties of objects and of
# the scene begin with
ACTIVE_UV, ACTIVE_COLOUR = ":uv", ":colour"
POINTINESS, ISLAND = ":pointiness", ":island"
# Attributes with a meaning: the way from a displaced vertex to where it was, and the normals that
# corners had there; whether faces are flat though the mesh has normals of its corners
REST, REST_NORMAL, SHARP = ":rest", ":rest normal", "sharp_face"
PROPERTIES = {"OBJECT": ":object:", "INSTANCER": ":instancer:", "VIEW_LAYER": ":view layer:"}


@dataclass(frozen=True, eq=False)
class Attribute:
    """Numbers that a mesh carries, C = 1 to 4 of them, by domain.

    values float32: POINT (V, C), FACE (F, C) or CORNER (F, 3, C).
    """

    domain: str
    values: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Deformation:
    """A mesh at K equal steps of the shutter's time: positions (K, V, 3) and normals as in `Mesh`.

    normals (K, V, 3) or (K, F, 3, 3); None where the mesh has none, or they do not change.
    """

    positions: NDArray[np.floating]
    normals: NDArray[np.float32] | None = None


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in object space; shared by the instances that show it.

    positions (V, 3) float32 or float64 [m]; triangles (F, 3) int32; normals: None where all
    faces are flat, (V, 3) per vertex or (F, 3, 3) per corner, float32, unit; slots: None where
    all triangles use material slot 0, else (F,) int32; texture_space: the middle and the half
    size (3,) of the box that generated coordinates fill; attributes: by name; deformation: while
    the shutter is open, None is none.
    """

    name: str
    positions: NDArray[np.floating]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32] | None = None
    slots: NDArray[np.int32] | None = None
    texture_space: tuple[NDArray[np.float64], NDArray[np.float64]] = UNIT_SPACE
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    deformation: Deformation | None = None

    def __post_init__(self) -> None:
        vertices, faces = len(self.positions), len(self.triangles)
        _shape(self, "positions", (vertices, 3))
        _shape(self, "triangles", (faces, 3))
        if self.normals is not None and self.normals.shape != (vertices, 3):
            _shape(self, "normals", (faces, 3, 3))
        if self.slots is not None:
            _shape(self, "slots", (faces,))
        for name, attribute in self.attributes.items():
            expected = {"POINT": (vertices,), "FACE": (faces,), "CORNER": (faces, 3)}
            if attribute.values.shape[:-1] != expected[attribute.domain]:
                raise SceneError(
                    f"Mesh '{self.name}': attribute '{name}' of the domain {attribute.domain} "
                    f"has shape {attribute.values.shape}"
                )
        if self.deformation is not None:
            _deformation(self, self.deformation)
        if faces:
            low, high = int(self.triangles.min()), int(self.triangles.max())
            if low < 0 or high >= vertices:
                bad = high if high >= vertices else low
                corner = int(np.flatnonzero(self.triangles.ravel() == bad)[0])
                raise SceneError(
                    f"Mesh '{self.name}': corner {corner} points to vertex {bad} of {vertices}"
                )


@dataclass(frozen=True)
class RayKinds:
    """Which rays see a thing, by what scattered them last; shadow rays meet what casts shadows."""

    camera: bool = True
    diffuse: bool = True
    glossy: bool = True
    transmission: bool = True
    shadow: bool = True

    @property
    def mask(self) -> int:
        """The bits CAMERA ... SHADOW of the kinds that see it."""
        mask = CAMERA * bool(self.camera) | DIFFUSE * bool(self.diffuse)
        mask |= GLOSSY * bool(self.glossy) | TRANSMISSION * bool(self.transmission)
        return mask | SHADOW * bool(self.shadow)


@dataclass(frozen=True)
class Particle:
    """What a particle is that shows an object; times in frames, the rest in the world [m]."""

    index: int = 0
    age: float = 0.0
    lifetime: float = 0.0
    size: float = 0.0
    location: Colour = (0.0, 0.0, 0.0)
    velocity: Colour = (0.0, 0.0, 0.0)
    angular_velocity: Colour = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Label:
    """What shaders can tell an instance by: colours and numbers that the user gave it.

    random: 0 to 1; generated and uv: where its instancer made it, in the instancer's terms;
    particle: None if no particle shows it.
    """

    colour: Colour = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    index: int = 0
    random: float = 0.0
    generated: Colour = (0.0, 0.0, 0.0)
    uv: tuple[float, float] = (0.0, 0.0)
    particle: Particle | None = None


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh in the world: its name, its affine to_world (3, 4) float64, its slots' materials.

    Linking: objects belong to one of up to 64 sets of receivers and to one of blockers, 0 unless
    something links them.  What glows lights the sets of `receivers`, a mask, and only the sets
    of `blockers` cast shadows of its light.  attributes: numbers (1 to 4) that the object has as a
    whole, by name.

    Where smooth: below the cosine `terminator_geometry` shadow rays start from the surface that
    the normals imply; `terminator_shading`, 0 to 2, darkens what light grazes.

    motion (K, 3, 4): its affine at K equal steps of the shutter's time, None if it rests.
    """

    name: str
    mesh: Mesh
    to_world: NDArray[np.float64]
    materials: tuple[Material | None, ...] = ()
    seen_by: RayKinds = RayKinds()
    is_holdout: bool = False
    is_shadow_catcher: bool = False
    receiver_set: int = 0
    blocker_set: int = 0
    receivers: int = EVERY_SET
    blockers: int = EVERY_SET
    label: Label = Label()
    terminator_geometry: float = 0.1
    terminator_shading: float = 0.0
    attributes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    light_group: str = ""
    asset: str = ""
    motion: NDArray[np.float64] | None = None

    @property
    def moves(self) -> bool:
        """Whether any of it moves while the shutter is open."""
        return self.motion is not None or self.mesh.deformation is not None

    def __post_init__(self) -> None:
        owner = f"Object '{self.name}'"
        _affine(owner, self.to_world)
        _motion(owner, self.motion)
        _links(owner, self.receivers, self.blockers)
        for number in (self.receiver_set, self.blocker_set):
            if not 0 <= number < 64:
                raise SceneError(f"{owner}: there is no light linking set {number}, only 0 to 63")


@dataclass(frozen=True, eq=False)
class Lamp:
    """A light source with a shape; it looks along its own -z.

    `strength` (R, G, B) is, by kind:

    POINT, SPOT  radiant intensity [W/sr] of the unblocked source;
    SUN          irradiance [W/m2] on a surface that faces it;
    AREA         radiance [W/(sr m2)], emitted on one side.
    """

    name: str
    kind: str  # "POINT" | "SPOT" | "SUN" | "AREA"
    to_world: NDArray[np.float64]  # (3, 4); its scale stretches SPOT cones and AREA sizes
    strength: Colour
    radius: float = 0.0  # POINT, SPOT [m]
    soft_falloff: bool = True  # POINT, SPOT: a disk that faces the point lit, not a sphere
    spot_angle: float = np.pi / 4  # SPOT: full cone angle [rad]
    spot_blend: float = 0.15  # SPOT: 0 hard edge ... 1 soft
    angle: float = 0.0  # SUN: full angle of its disk [rad]
    size: tuple[float, float] = (1.0, 1.0)  # AREA [m], along its x and y
    ellipse: bool = False  # AREA: an ellipse with these diameters
    spread: float = np.pi  # AREA: full angle of the emission cone [rad]
    max_bounces: int = 1024  # paths with more bounces do not see it
    seen_by: RayKinds = RayKinds(camera=False)
    casts_shadow: bool = True
    sampled: bool = True  # rays that run into it see it, too (multiple importance sampling)
    receivers: int = EVERY_SET  # mask of the light linking sets that it lights
    blockers: int = EVERY_SET  # mask of those that cast its shadows
    lights_catchers: bool = True  # its light counts where shadow catchers are alone
    surface: Node | None = None  # a shader whose emission multiplies the strength
    label: Label = Label()
    is_object: bool = True  # for its shader; else its own space is the world (Cycles before 4.5)
    light_group: str = ""
    motion: NDArray[np.float64] | None = None  # (K, 3, 4), its affine at equal steps of time

    def __post_init__(self) -> None:
        owner = f"Light '{self.name}'"
        _motion(owner, self.motion)
        _links(owner, self.receivers, self.blockers)
        if self.kind not in ("POINT", "SPOT", "SUN", "AREA"):
            raise SceneError(f"{owner}: unknown kind {self.kind!r}")
        _affine(owner, self.to_world)
        _numbers(owner, self, strength=3, size=2, radius=1, spot_angle=1, spot_blend=1)
        _numbers(owner, self, angle=1, spread=1)


@dataclass(frozen=True, eq=False)
class Stars:
    """Points that shine and are smaller than any pixel: vertices of a mesh without its faces.

    intensity (V, 3) [W/sr] of each vertex; to_world and motion as of `Instance`.
    """

    name: str
    mesh: Mesh
    to_world: NDArray[np.float64]
    intensity: NDArray[np.float32]
    light_group: str = ""
    motion: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        owner = f"Object '{self.name}'"
        _affine(owner, self.to_world)
        _motion(owner, self.motion)
        expected = (len(self.mesh.positions), 3)
        if self.intensity.shape != expected:
            shape = self.intensity.shape
            raise SceneError(f"{owner}: its stars' light has shape {shape}, expected {expected}")
        for what, array in (("place", self.mesh.positions), ("light", self.intensity)):
            bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
            if bad.size:
                raise SceneError(f"{owner}: the {what} of star {bad[0]} is not a finite number")


@dataclass(frozen=True)
class StarField:
    """Stars all around, infinitely far away, placed and coloured by chance.

    irradiance [W/m2] is that of a star of magnitude 0; `slope`: there are 10^slope times as many
    stars with each magnitude more, of those from the brightest to the faintest.  temperature [K];
    spread, 0 to 1, of 1 / temperature about its middle.  rgb_of_xyz: rows of the matrix to the
    scene's colours, from XYZ.
    """

    count: int
    irradiance: float
    seed: int = 0
    brightest: float = -1.5
    faintest: float = 6.5
    slope: float = 0.5
    temperature: float = 6500.0
    spread: float = 0.5
    rgb_of_xyz: tuple[Colour, Colour, Colour] = (
        (3.2404542, -1.5371385, -0.4985314),
        (-0.9692660, 1.8760108, 0.0415560),
        (0.0556434, -0.2040259, 1.0572252),
    )

    def __post_init__(self) -> None:
        names = "irradiance", "brightest", "faintest", "slope", "temperature", "spread"
        _numbers("World: its stars", self, **dict.fromkeys(names, 1))
        if self.count < 0 or self.temperature <= 0 or self.slope < 0 or self.irradiance < 0:
            raise SceneError(
                "World: its stars need a count, irradiance and slope of 0 or more, and a "
                "temperature above 0"
            )


@dataclass(frozen=True, eq=False)
class World:
    """What rays meet that leave the scene: a shader (Background), or black."""

    name: str = "World"
    surface: Node | None = None
    seen_by: RayKinds = RayKinds()
    sampled: bool = True  # rays are also sent towards where it is bright
    max_bounces: int = 1024  # paths with more bounces send none there
    casts_shadow: bool = True  # of those rays
    occlusion_distance: float = np.inf  # how far Ambient Occlusion looks by default [m]
    light_group: str = ""
    stars: StarField | None = None


@dataclass(frozen=True, eq=False)
class Camera:
    """Where pixels look.  Camera space looks along -z with y up; to_world is orthonormal.

    `window` (left, right, bottom, top) is the full frame on the plane at distance 1 for PERSP
    [1], at any distance for ORTHO [m], and a part of the panorama's unit square for PANO.
    `border` (x0, y0, x1, y1) is the part of the `width` x `height` raster that is rendered, in
    pixels from its lower left corner.  An aperture of None is a pinhole.

    motion: the camera at two or more equal steps of the shutter's time, () if it rests; all but
    its place, window and the size and focus of its aperture is as if it rested.
    """

    to_world: NDArray[np.float64]
    window: tuple[float, float, float, float]
    width: int
    height: int
    projection: str = "PERSP"  # "PERSP" | "ORTHO" | "PANO"
    clip_start: float = 0.1
    clip_end: float = 1e30
    border: tuple[int, int, int, int] | None = None
    aperture: Aperture | None = None
    panorama: Panorama | None = None  # of PANO
    eye: Eye | None = None  # not of ORTHO
    motion: tuple["Camera", ...] = ()

    def __post_init__(self) -> None:
        _affine("Camera", self.to_world)
        if len(self.motion) == 1:
            raise SceneError("Camera: it moves, but its motion has one step only")
        _numbers("Camera", self, window=4, clip_start=1)
        if self.projection not in ("PERSP", "ORTHO", "PANO"):
            raise SceneError(f"Camera: projection {self.projection!r} is not PERSP, ORTHO or PANO")
        if (self.projection == "PANO") != (self.panorama is not None):
            raise SceneError(f"Camera: {self.projection} and panorama {self.panorama} do not match")
        if self.projection == "ORTHO" and self.eye is not None:
            raise SceneError("Camera: an orthographic camera has no eye to look apart with")
        for part in (self.aperture, self.panorama, self.eye):
            for fault in () if part is None else part.faults():
                raise SceneError(f"Camera: {fault}")
        if self.width < 1 or self.height < 1:
            raise SceneError(f"Camera: a picture of {self.width} x {self.height} pixels is empty")
        x0, y0, x1, y1 = self.rectangle()
        if not (0 <= x0 < x1 <= self.width and 0 <= y0 < y1 <= self.height):
            raise SceneError(f"Camera: border {self.border} is empty or outside of the picture")

    def rectangle(self) -> tuple[int, int, int, int]:
        """Return the pixels that are rendered as (x0, y0, x1, y1)."""
        return self.border or (0, 0, self.width, self.height)


@dataclass(frozen=True, eq=False)
class Scene:
    """All that is rendered in one frame and view layer.

    shutter (n,): how much light it lets in at equal steps of its time, None if always all.
    spans_frames: the motion of the camera and of instances is no blur, but tells where they are in
    the frames before, at and after this one; lamps rest.
    """

    camera: Camera
    instances: tuple[Instance, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    world: World | None = None
    film_transparent: bool = False
    spare_passes: int = 0  # transparent surfaces that paths may pass more than shadow rays may
    frame: int = 0
    layer: Layer = Layer()
    notes: tuple[Note, ...] = ()
    shutter: NDArray[np.float64] | None = None
    spans_frames: bool = False
    stars: tuple[Stars, ...] = ()

    def __post_init__(self) -> None:
        if self.spans_frames and len(self.camera.motion) not in (0, 3):
            raise SceneError("Camera: its motion from frame to frame has not three steps")
        curve = self.shutter
        if curve is not None and not (len(curve) > 1 and (curve >= 0).all() and curve.any()):
            raise SceneError("Render settings: the shutter curve lets no light in")


def _shape(mesh: Mesh, name: str, expected: tuple[int, ...]) -> None:
    actual = getattr(mesh, name).shape
    if actual != expected:
        raise SceneError(f"Mesh '{mesh.name}': {name} has shape {actual}, expected {expected}")


def _deformation(mesh: Mesh, found: Deformation) -> None:
    owner = f"Mesh '{mesh.name}'"
    if len(found.positions) < 2 or found.positions.shape[1:] != mesh.positions.shape:
        raise SceneError(
            f"{owner}: its deformation has shape {found.positions.shape}, expected two or more "
            f"steps of {mesh.positions.shape}"
        )
    if not np.isfinite(found.positions).all():
        raise SceneError(f"{owner}: its deformation has a coordinate that is not a finite number")
    if found.normals is None:
        return
    usual = None if mesh.normals is None else mesh.normals.shape
    if found.normals.shape[1:] != usual or len(found.normals) != len(found.positions):
        raise SceneError(
            f"{owner}: the normals of its deformation have shape {found.normals.shape}, "
            f"those of the mesh {usual}"
        )


def _motion(owner: str, motion: NDArray[np.float64] | None) -> None:
    if motion is None:
        return
    if motion.ndim != 3 or len(motion) < 2:
        raise SceneError(f"{owner}: its motion has shape {motion.shape}, expected (K, 3, 4)")
    for matrix in motion:
        _affine(owner, matrix)


def _links(owner: str, *masks: int) -> None:
    if any(not 0 <= mask <= EVERY_SET for mask in masks):
        raise SceneError(f"{owner}: a mask of light linking sets does not fit into 64 bits")


def _numbers(owner: str, thing: Any, **counts: int) -> None:
    # Are fields finite numbers, and as many of them as `counts` says?
    for name, count in counts.items():
        found = np.ravel(getattr(thing, name)).tolist()
        if len(found) != count or not all(map(math.isfinite, found)):
            what = "a finite number" if count == 1 else f"{count} finite numbers"
            raise SceneError(f"{owner}: {name} is {getattr(thing, name)}, expected {what}")


def _affine(owner: str, matrix: NDArray[np.float64]) -> None:
    if matrix.shape != (3, 4):
        raise SceneError(f"{owner}: its matrix has shape {matrix.shape}, expected (3, 4)")
    if not (np.abs(matrix) <= FARTHEST).all():  # NaN neither
        raise SceneError(f"{owner}: its matrix has a number that is not finite, or beyond 1e18")
