"""numbers -> glass.blend: a ball, a slab, a prism and a nest of glass on a striped table.

Look at the ball, which shows the room upside down; at the slab, which shifts the stripes but does
not bend them; at the prism, whose far sides are perfect mirrors (total internal reflection); and
at the nest, a bubble of air with a red core inside glass. Each throws its caustic on the table.
"""

from _stage import box, camera, cone, glass, glow, lamp, matte, mesh, orb, put, save, start

start(720, 450, world=(0.05, 0.065, 0.09), max_bounces=20, transmission_bounces=16)
clear, dense, green = (
    glass("Glass", 1.5),
    glass("Dense glass", 1.7, (0.95, 0.97, 1)),
    glass("Green glass", 1.5, (0.72, 0.93, 0.8)),
)
stripes = [
    matte("Chalk", (0.74, 0.71, 0.66)),
    matte("Slate", (0.07, 0.11, 0.17)),
    matte("Ochre", (0.72, 0.33, 0.06)),
]

# The table: stripes that run away from the viewer, one material slot each; a wall behind it.
count, width = 60, 0.24
edges = [width * (k - count / 2) for k in range(count + 1)]
points = [(x, y, 0) for x in edges for y in (-5, 3)]
table = put("Table", mesh(points, [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(count)]))
for material in stripes:
    table.data.materials.append(material)
order = (0, 1, 0, 0, 2, 0, 1, 0)
table.data.polygons.foreach_set("material_index", [order[k % 8] for k in range(count)])
wall = mesh([(-8, 3, 0), (8, 3, 0), (8, 3, 6), (-8, 3, 6)], [(0, 3, 2, 1)])
put("Wall", wall, matte("Wall", (0.10, 0.16, 0.20)))
sky = glow("Sky", (0.7, 0.85, 1.0), 5.0)
for x in (-2.0, -1.3):
    put("Window", box(0.55, 0.02, 1.3), sky, at=(x, 2.9, 1.5))

orb("Ball", 0.55, clear, at=(-1.15, 0.1, 0.551))
put("Slab", box(0.9, 0.24, 1.15), green, at=(0.12, 0.75, 0.576), turn=(0, 0, 20))
put("Prism", cone(0.34, 0.34, 0.8, 3), dense, at=(0.3, -0.55, 0.001), turn=(0, 0, 40))
orb("Nest", 0.46, clear, at=(1.35, 0.2, 0.461))
# The bubble is air in glass: its faces look inwards, so that what lies outside of it is the glass.
bubble = orb("Bubble", 0.31, clear, at=(1.35, 0.2, 0.461))
bubble.data.flip_normals()
orb("Core", 0.1, matte("Core", (0.75, 0.06, 0.05)), at=(1.35, 0.2, 0.461))

lamp("Lamp", "AREA", 330, (1.6, 2.2, 3.3), (0, 0, 0.3), (1, 0.87, 0.7), shape="SQUARE", size=1.0)
camera(at=(0.1, -4.8, 2.0), to=(0.08, 0.1, 0.47), lens=50)
save(__file__)
