"""bpy node tree -> Notes.  What is broken in a tree: groups and links that lead nowhere.

Blender, and Cycles with it, passes over all of that without a word: what is not there is 0, a link
that does not count leaves the input its own value.
"""

from collections.abc import Iterator

import bpy

from ...core.scene import Note

# How kinds of nodes begin that are Blender's own; others are of add-ons
_KNOWN = ("ShaderNode", "FunctionNode", "GeometryNode", "Node")


def broken_notes(tree: bpy.types.NodeTree, owner: str) -> Iterator[Note]:
    """Yield what is broken in a tree, and in the groups that it uses, each group once."""
    for each in _trees(tree):
        where = "" if each is tree else f"in group '{each.name}', "
        for link in _invalid(each):
            names = f"'{link.from_node.name}' to '{link.to_node.name}'"
            yield Note(owner, f"{where}the link from {names} closes a circle or fits no socket")
        for node in each.nodes:
            if not any(output.is_linked for output in node.outputs):
                continue
            if isinstance(node, _GROUPS):
                group = node.node_tree
                if group is None:
                    yield Note(owner, f"{where}node '{node.name}' has lost its group")
                elif not any(inner.bl_idname == "NodeGroupOutput" for inner in group.nodes):
                    yield Note(owner, f"{where}group '{group.name}' is empty: its outputs are 0")
            elif not node.bl_idname.startswith(_KNOWN) or node.bl_idname == "NodeUndefined":
                kind = f"'{node.name}' is a {node.bl_idname}, which is not known"
                yield Note(owner, f"{where}node {kind}")


def is_endless(tree: bpy.types.NodeTree) -> bool:
    """Tell whether a group that a tree uses may have a circle of links."""
    return any(each is not tree and any(_invalid(each)) for each in _trees(tree))


_GROUPS = bpy.types.ShaderNodeGroup | bpy.types.ShaderNodeCustomGroup


def _invalid(tree: bpy.types.NodeTree) -> Iterator[bpy.types.NodeLink]:
    return (link for link in tree.links if not link.is_valid and not link.is_muted)


def _trees(tree: bpy.types.NodeTree) -> Iterator[bpy.types.NodeTree]:
    """Yield a tree and the groups that it uses, each once."""
    waiting, seen = [tree], {tree.as_pointer()}
    while waiting:
        each = waiting.pop()
        yield each
        for node in each.nodes:
            group = getattr(node, "node_tree", None)
            if group is not None and group.as_pointer() not in seen:
                seen.add(group.as_pointer())
                waiting.append(group)
