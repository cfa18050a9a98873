"""name -> scene in Blender.  One module per scene, whose `build` makes it in an empty file.

Nothing is stored: a scene is its script, and numbers drawn at random come from a fixed seed.
Inputs of nodes are constant, except for the world's picture in `hdri_object`.
"""

import ast
import hashlib
from importlib import import_module
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
SHARED = (FOLDER / "shapes.py", FOLDER.parent.parent / "examples" / "_stage.py")


def build(name: str) -> None:
    """Make the scene of this name in an empty file."""
    import_module(f".{name}", __package__).build()


def fingerprint(name: str) -> bytes:
    """Return a hash of the code that makes the scene; comments and docstrings do not count."""
    digest = hashlib.sha256()
    for path in (FOLDER / f"{name}.py", *SHARED):
        tree = ast.parse(path.read_text("utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.FunctionDef) and ast.get_docstring(node):
                del node.body[0]
        digest.update(ast.dump(tree).encode())
    return digest.digest()
