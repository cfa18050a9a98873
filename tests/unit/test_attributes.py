"""What meshes carry is found at hits, for instances, mirrored ones, and meshes that lack it."""

import numpy as np
import pytest

from penumbra.core.geometry.attributes import (
    ALPHA,
    FACTOR,
    FRAME,
    OPACITY,
    VECTOR,
    compile_attributes,
)
from penumbra.core.geometry.mesh import compile_triangles
from penumbra.core.geometry.uv_tangents import uv_tangents
from penumbra.core.scene import (
    ACTIVE_UV,
    Attribute,
    Instance,
    Link,
    Material,
    Mesh,
    Node,
    SceneError,
)
from penumbra.core.shading.attributes import attributes_wanted

F32 = np.float32
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], F32)
FACES = np.array([(0, 1, 2), (0, 2, 3)], np.int32)


def square(**attributes):
    return Mesh("Square", SQUARE, FACES, attributes=attributes)


def instance(mesh, scale=1.0, **more):
    matrix = np.eye(3, 4)
    matrix[0, 0] = scale
    return Instance("Thing", mesh, matrix, **more)


def at_first_corners(instances, asked):
    """Return an attribute near the second corner of each triangle, whatever its object."""
    triangles, _ = compile_triangles(tuple(instances), {id(None): 0}, np.zeros(3), 1e9, 9, bool)
    table = compile_attributes(instances, [asked], triangles)[asked]
    count = triangles.count
    u, v = np.full(count, 0.75, F32), np.full(count, 0.125, F32)
    place = np.array([0.125, 0.75, 0.125])
    corners = triangles.vertices[triangles.corners].transpose(2, 1, 0)
    where = (corners * place[:, None]).sum(axis=1)
    found = table.at(np.arange(count, dtype=np.int32), triangles.ids[:, 2].copy(), u, v)
    return found, where


@pytest.mark.parametrize("scales", [(1,), (1, 1), (1, -2, 1), (-1, 1)])
def test_an_attribute_of_vertices_varies_over_the_triangles_as_the_positions_do(scales):
    mesh = square(place=Attribute("POINT", SQUARE))
    instances = [instance(mesh, scale) for scale in scales]
    found, where = at_first_corners(instances, ("place", VECTOR))
    where[0] /= np.repeat(scales, 2)
    np.testing.assert_allclose(found, where, atol=1e-6)


def test_a_mesh_without_the_attribute_gets_zeros_and_the_others_keep_theirs():
    mesh = square(place=Attribute("POINT", SQUARE + 1))
    found, where = at_first_corners(
        [instance(square()), instance(mesh), instance(square())], ("place", VECTOR)
    )
    np.testing.assert_allclose(found[:, 2:4], where[:, 2:4] + 1, atol=1e-6)
    assert not found[:, [0, 1, 4, 5]].any()


def test_instances_of_a_mesh_share_their_rows():
    mesh = square(place=Attribute("POINT", SQUARE))
    instances = tuple(instance(mesh) for _ in range(50))
    triangles, _ = compile_triangles(instances, {id(None): 0}, np.zeros(3), 1e9, 9, bool)
    table = compile_attributes(instances, [("place", VECTOR)], triangles)["place", VECTOR]
    assert len(table.rows) == 3


def test_faces_corners_alpha_and_factor_are_told_apart():
    colours = np.array([(0.1, 0.2, 0.6, 0.5), (0.7, 0.8, 0.9, 0.25)], F32)
    face = square(c=Attribute("FACE", colours))
    np.testing.assert_allclose(at_first_corners([instance(face)], ("c", ALPHA))[0], [[0.5, 0.25]])
    found, _ = at_first_corners([instance(face)], ("c", FACTOR))
    np.testing.assert_allclose(found, [[0.3, 0.8]], atol=1e-6)
    bare = [instance(square())]
    assert (at_first_corners(bare, ("c", ALPHA))[0] == 1).all()
    assert (at_first_corners(bare, ("c", OPACITY))[0] == 0).all()
    corners = square(c=Attribute("CORNER", np.arange(6, dtype=F32).reshape(2, 3, 1)))
    found, _ = at_first_corners([instance(corners)], ("c", FACTOR))
    np.testing.assert_allclose(found, [[1, 4]], atol=1e-6)


def test_triangles_that_are_left_out_take_their_attributes_along():
    positions = np.concatenate([[[np.nan] * 3], SQUARE])
    faces = np.concatenate([[[0, 1, 2]], FACES + 1])
    values = np.arange(3, dtype=F32)[:, None]
    mesh = Mesh(
        "Broken", positions, faces.astype(np.int32), attributes={"n": Attribute("FACE", values)}
    )
    np.testing.assert_allclose(at_first_corners([instance(mesh)], ("n", VECTOR))[0][0], [1, 2])


def test_an_attribute_of_the_wrong_size_is_named():
    with pytest.raises(SceneError, match="'place' of the domain POINT"):
        square(place=Attribute("POINT", SQUARE[:2]))


def test_tangents_follow_u_and_tell_which_side_v_is_on():
    normals = np.tile(F32([0, 0, 1]), (2, 3, 1))
    uv = np.stack([SQUARE[:, 1], SQUARE[:, 0]], axis=1)[FACES]  # u along y, v along x
    tangents, sign = uv_tangents(square(), normals, uv)
    np.testing.assert_allclose(tangents, np.tile(F32([0, 1, 0]), (2, 3, 1)), atol=1e-6)
    assert (sign == -1).all()
    frame, _ = at_first_corners([instance(square(m=Attribute("CORNER", uv)))], ("m", FRAME))
    np.testing.assert_allclose(frame[:, 0], [0, 0, 1, 0, 1, 0, -1], atol=1e-6)


def test_materials_ask_for_what_their_nodes_read_and_no_more():
    def glow(kind, output="Color", **properties):
        node = Node(kind, inputs=properties.pop("inputs", {}), properties=properties)
        return Material("M", Node("Emission", inputs={"Color": Link(node, output)}))

    assert attributes_wanted(glow("TexImage")) == {ACTIVE_UV}
    linked = {"Vector": Link(Node("UVMap", properties={"uv_map": "A"}), "UV")}
    assert attributes_wanted(glow("TexImage", inputs=linked)) == {"A"}
    assert attributes_wanted(glow("TexCoord", "UV")) == {ACTIVE_UV}
    assert attributes_wanted(glow("TexCoord", "Generated")) == frozenset()
    assert attributes_wanted(glow("NormalMap", space="WORLD", uv_map="A")) == frozenset()
    assert attributes_wanted(glow("Attribute", attribute_name="")) == frozenset()
