"""name -> scene in Blender.  One module per scene, whose `build` makes it in an empty file.

Nothing is stored: a scene is its script, and numbers drawn at random come from a fixed seed.
A name with a dash, `module-variant`, is one of several scenes of a module.
"""

import ast
import hashlib
from importlib import import_module
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
SHARED = (FOLDER / "shapes.py", FOLDER.parent.parent / "examples" / "_stage.py")


def build(name: str) -> None:
    """Make the scene of this name in an empty file."""
    module, _, variant = name.partition("-")
    import_module(f".{module}", __package__).build(*([variant.upper()] if variant else []))


def fingerprint(name: str) -> bytes:
    """Return a hash of the code that makes the scene; comments and docstrings do not count."""
    digest = hashlib.sha256()
    module, _, variant = name.partition("-")
    digest.update(variant.encode())
    for path in (FOLDER / f"{module}.py", *SHARED):
        tree = ast.parse(path.read_text("utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.FunctionDef) and ast.get_docstring(node):
                del node.body[0]
        digest.update(ast.dump(tree).encode())
    return digest.digest()
