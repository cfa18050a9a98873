"""names -> rows of nodes that trace rays at random.  What `test_traced` shows, a picture each."""

# Name -> (kind, output, properties and, by capital letters, inputs); world: of its settings
ROWS = {
    "occlusion": ("AmbientOcclusion", "AO", {"Distance": 1.0}),
    "occlusion colour": ("AmbientOcclusion", "Color", {"Color": (0.7, 0.4, 0.2, 1.0)}),
    "occlusion near": ("AmbientOcclusion", "AO", {"Distance": 0.3, "samples": 3}),
    "occlusion far": ("AmbientOcclusion", "AO", {"Distance": 0.0}),
    "occlusion of the world": ("AmbientOcclusion", "AO", {"Distance": 0.0, "world": 0.4}),
    "occlusion none": ("AmbientOcclusion", "AO", {"Distance": -1.0}),
    "occlusion inside": ("AmbientOcclusion", "AO", {"Distance": 0.7, "inside": True}),
    "occlusion own": (
        "AmbientOcclusion", "AO", {"Distance": 2.0, "inside": True, "only_local": True}
    ),
    "occlusion bent": ("AmbientOcclusion", "AO", {"Normal": (0.3, -0.4, 0.8)}),
    "bevel": ("Bevel", "Normal", {"Radius": 0.2}),
    "bevel wide": ("Bevel", "Normal", {"Radius": 0.5, "samples": 16}),
    "bevel none": ("Bevel", "Normal", {"Radius": 0.0}),
    "bevel bent": ("Bevel", "Normal", {"Radius": 0.2, "Normal": (0.3, -0.4, 0.8)}),
}  # fmt: skip
