"""multilayer EXR files -> arrays.  Whatever way this Blender arranges its layers in them."""

import numpy as np
import OpenImageIO


def read_layers(path):
    """Return {(view layer, pass): (H, W, C)}, the top row first."""
    file, channels, part = OpenImageIO.ImageInput.open(str(path)), {}, 0
    while file.seek_subimage(part, 0):
        spec = file.spec()
        pixels = file.read_image(part, 0, 0, spec.nchannels, "float")
        for place, name in enumerate(spec.channelnames):
            layer, pass_, letter = name.split(".")
            channels.setdefault((layer, pass_), {})[letter] = pixels[..., place]
        part += 1
    order = "RGBrgbXYZWUVAa".index
    return {
        key: np.stack([found[letter] for letter in sorted(found, key=order)], axis=-1)
        for key, found in channels.items()
    }
