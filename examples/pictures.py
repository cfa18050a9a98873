"""example files -> pictures/*.png.  Render each example in Penumbra for README.

python examples/pictures.py [--samples N] [NAME ...]   needs the bpy module and Penumbra
"""

import argparse
import os
import sys
from pathlib import Path

import bpy

import penumbra

HERE = Path(__file__).resolve().parent
# Samples for a clean picture: caustics need more than the files store.
SAMPLES = {
    "cornell_box": 256,
    "lamps": 128,
    "mirrors": 128,
    "glass": 192,
    "still_life": 128,
    "far_away": 64,
}
WIDTH = 480


def main(argv: list[str]) -> int:
    """Render the named examples, or all; return the exit code."""
    parser = argparse.ArgumentParser(description="Render the pictures of the examples.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SAMPLES))
    parser.add_argument("--samples", type=int, help="instead of each picture's own count")
    options = parser.parse_args(argv)
    unknown = sorted(set(options.names) - set(SAMPLES))
    if unknown:
        parser.error(f"no example is called {', '.join(unknown)}")
    penumbra.register()
    (HERE / "pictures").mkdir(exist_ok=True)
    for name in options.names or SAMPLES:
        bpy.ops.wm.open_mainfile(filepath=str(HERE / f"{name}.blend"))
        scene = bpy.context.scene
        scene.render.engine = "PENUMBRA"
        scene.penumbra.samples = options.samples or SAMPLES[name]
        scene.render.resolution_percentage = round(100 * min(1, WIDTH / scene.render.resolution_x))
        image = scene.render.image_settings
        image.file_format, image.color_mode, image.compression = "PNG", "RGB", 100
        scene.render.use_stamp_filename = False  # where the file lies is nobody's business
        scene.render.dither_intensity = 0  # noise that would only make the file larger
        scene.render.filepath = str(HERE / "pictures" / f"{name}.png")
        bpy.ops.render.render(write_still=True)
    return 0


if __name__ == "__main__":
    code = main(sys.argv[1:])
    sys.stdout.flush()
    os._exit(code)  # the bpy module may hang or crash when Python ends
