"""scattering -> ray kind.  Bits that say how a ray was made, for visibility and bounce limits."""

CAMERA, DIFFUSE, GLOSSY, TRANSMISSION = 1, 2, 4, 8
EVERY_KIND = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION
