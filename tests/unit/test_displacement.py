"""core.shading.displacement -> vertices where materials send them, with Blender's normals."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Instance, Link, Material, Mesh, Node, Settings, compile_plan
from penumbra.core.scene import REST, SHARP, Attribute, Deformation, SceneError
from penumbra.core.shading import Library, displace
from penumbra.core.shading.displacement import smooth_normals
from tests.support import scenes as s

# A pyramid without a base; its sides are steep, so that no two normals are alike
PYRAMID = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 2]], np.float32)
SIDES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], np.int32)
UP = np.tile(np.float32([0, 0, 1]), (5, 1))


def constant(*way):
    return Link(s.node("CombineXYZ", X=way[0], Y=way[1], Z=way[2]), "Vector")


def raised(height=0.5, midlevel=0.0, scale=1.0, space="OBJECT"):
    inputs = {"Height": height, "Midlevel": midlevel, "Scale": scale}
    return Link(Node("Displacement", "", inputs, {"space": space}), "Displacement")


def material(way, method="DISPLACEMENT", name="Moving"):
    return Material(name, s.diffuse().surface, displacement=way, displacement_method=method)


def instance(mesh, *materials, linear=None, shift=(0, 0, 0), name="Thing"):
    return Instance(name, mesh, s.affine(linear, shift), materials)


def pyramid(normals=UP, **more):
    return Mesh("Pyramid", PYRAMID, SIDES, normals, **more)


def moved(*instances):
    return displace(instances, np.zeros(3), Library(), [])


def of_faces(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def test_nothing_is_touched_where_no_material_displaces():
    instances = (instance(pyramid(), material(raised(), "BUMP")),)
    assert displace(instances, np.zeros(3), Library(), []) is instances


def test_vertices_move_along_their_normals_by_height_less_midlevel_times_scale():
    (found,) = moved(instance(pyramid(), material(raised(0.75, 0.25, 2.0))))
    np.testing.assert_allclose(found.mesh.positions, PYRAMID + [0, 0, 1], atol=1e-6)


def test_in_object_space_heights_grow_with_the_object_and_in_world_space_they_do_not():
    for space, expected in (("OBJECT", 0.5), ("WORLD", 0.25)):
        way = raised(0.5, space=space)
        (found,) = moved(instance(pyramid(), material(way), linear=2.0, shift=(7, 8, 9)))
        np.testing.assert_allclose(found.mesh.positions, PYRAMID + [0, 0, expected], atol=1e-5)


def test_vectors_of_the_world_and_of_the_object():
    for space, expected in (("WORLD", (0, 0, 0.5)), ("OBJECT", (0, 0, 1.0))):
        node = Node("VectorDisplacement", "", {"Vector": (0, 0, 1.5), "Midlevel": 0.0,
                                               "Scale": 2.0 / 3.0}, {"space": space})  # fmt: skip
        way = Link(node, "Vector")
        (found,) = moved(instance(pyramid(), material(way), linear=2.0))
        np.testing.assert_allclose(found.mesh.positions, PYRAMID + expected, atol=1e-6)


def test_vectors_along_a_uv_map():
    # u along x, v along y
    uv = {":uv": Attribute("POINT", np.ascontiguousarray(PYRAMID[:, :2]))}
    node = Node("VectorDisplacement", "", {"Vector": (0.1, 0.2, 0.4), "Midlevel": 0.0,
                                           "Scale": 1.0}, {"space": "TANGENT"})  # fmt: skip
    mesh = pyramid(attributes=uv)
    (found,) = moved(instance(mesh, material(Link(node, "Vector"))))
    np.testing.assert_allclose(found.mesh.positions, PYRAMID + [0.1, 0.4, 0.2], atol=1e-6)


def test_flat_meshes_move_along_smooth_normals_and_stay_flat():
    mesh = pyramid(None)
    (found,) = moved(instance(mesh, material(raised(0.5))))
    expected = PYRAMID + 0.5 * smooth_normals(mesh)
    np.testing.assert_allclose(found.mesh.positions, expected, atol=1e-6)
    assert found.mesh.normals is None
    np.testing.assert_allclose(smooth_normals(mesh)[4], [0, 0, 1], atol=1e-6)


@pytest.mark.parametrize("method", ["DISPLACEMENT", "BOTH", "BUMP"])
def test_an_unknown_node_moves_nothing_and_is_noted(method):
    notes = []
    thing = instance(pyramid(), material(Link(Node("Strange", "Odd"), "Way"), method))
    (found,) = displace((thing,), np.zeros(3), Library(), notes)
    np.testing.assert_array_equal(found.mesh.positions, PYRAMID)
    assert len(notes) == (method != "BUMP")
    plan = compile_plan(s.scene(s.camera((0, 0, 5)), thing), Settings())
    assert any("Strange 'Odd'" in note.what for note in plan.notes)


def test_normals_of_vertices_are_the_plain_mean_of_the_faces_around():
    way = Link(s.node("NewGeometry"), "Position")  # twice as large
    (found,) = moved(instance(pyramid(), material(way)))
    np.testing.assert_allclose(found.mesh.positions, 2 * PYRAMID, atol=1e-6)
    faces = of_faces(found.mesh)
    expected = faces[0] + faces[3]
    expected /= np.linalg.norm(expected)
    np.testing.assert_allclose(found.mesh.normals[0], expected, atol=1e-6)


def test_normals_are_made_in_the_space_of_the_object():
    (found,) = moved(instance(pyramid(), material(constant(0, 0, 1)), linear=[1.0, 1.0, 4.0]))
    expected = of_faces(found.mesh)[0] + of_faces(found.mesh)[3]
    np.testing.assert_allclose(
        found.mesh.normals[0], expected / np.linalg.norm(expected), atol=1e-6
    )


def test_a_mirrored_object_keeps_its_outside():
    (found,) = moved(instance(pyramid(), material(constant(0, 0, 1)), linear=[-1.0, 1.0, 1.0]))
    faces = of_faces(found.mesh)
    assert (found.mesh.normals[SIDES[:, 0]] * faces).sum(1).min() > 0


def test_where_bump_follows_vertices_keep_their_normals():
    (found,) = moved(instance(pyramid(), material(raised(), "BOTH")))
    np.testing.assert_array_equal(found.mesh.normals, UP)


def test_corners_turn_as_their_vertices_do_and_sharp_faces_stay_flat():
    corners = of_faces(pyramid())[:, None].repeat(3, axis=1)
    sharp = {SHARP: Attribute("FACE", np.float32([[0], [1], [0], [0]]))}
    mesh = pyramid(corners.astype(np.float32), attributes=sharp)
    place = Link(s.node("NewGeometry"), "Position")
    inputs = {"Vector": place, "Vector_001": (0.0, 0.0, 1.0)}
    way = Link(Node("VectorMath", "", inputs, {"operation": "MULTIPLY"}), "Vector")
    (found,) = moved(instance(mesh, material(way)))
    after = found.mesh
    np.testing.assert_allclose(after.positions, PYRAMID * [1, 1, 2], atol=1e-6)
    np.testing.assert_allclose(after.normals[1], of_faces(after)[[1] * 3], atol=1e-6)

    def mean(of):
        total = of_faces(of)[0] + of_faces(of)[3]
        return total / np.linalg.norm(total)

    expected = corners[0, 0] + mean(after) - mean(mesh)
    expected /= np.linalg.norm(expected)
    np.testing.assert_allclose(after.normals[0, 0], expected, atol=1e-6)


def test_only_faces_of_the_material_move_and_each_vertex_once():
    slots = np.array([0, 1, 1, 1], np.int32)
    mesh = pyramid(slots=slots)
    (found,) = moved(instance(mesh, s.diffuse(), material(raised())))
    np.testing.assert_allclose(found.mesh.positions, PYRAMID + [0, 0, 0.5], atol=1e-6)
    (found,) = moved(instance(mesh, material(raised()), s.diffuse()))
    up = np.array([1, 1, 0, 0, 1])[:, None] * [0, 0, 0.5]
    np.testing.assert_allclose(found.mesh.positions, PYRAMID + up, atol=1e-6)
    np.testing.assert_array_equal(found.mesh.normals[[2, 3]], UP[:2])


def test_the_way_back_is_an_attribute():
    (found,) = moved(instance(pyramid(), material(constant(1, 2, 3)), linear=2.0))
    back = found.mesh.attributes[REST].values
    np.testing.assert_allclose(found.mesh.positions + back, PYRAMID, atol=1e-6)


def test_instances_share_the_displaced_mesh_unless_their_materials_differ():
    mesh, one, other = pyramid(), material(raised(0.5)), material(raised(1.0))
    a, b, c, d = moved(
        instance(mesh, one), instance(mesh, one), instance(mesh, other), instance(mesh, s.diffuse())
    )
    assert a.mesh is b.mesh and c.mesh is not a.mesh and d.mesh is mesh
    assert c.mesh.positions[4, 2] > a.mesh.positions[4, 2] > 2


def test_ways_that_are_not_finite_are_not_gone():
    way = constant(np.inf, 0, 0)
    (found,) = moved(instance(pyramid(), material(way)))
    np.testing.assert_array_equal(found.mesh.positions, PYRAMID)


def test_an_unknown_method_is_refused_by_name():
    with pytest.raises(SceneError, match="Material 'Moving'.*'UP'"):
        material(raised(), "UP")


def test_rays_meet_the_displaced_mesh_and_generated_coordinates_are_those_before():
    square = Mesh(
        "Square",
        np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
        np.int32([[0, 1, 2], [0, 2, 3]]),
        texture_space=(np.zeros(3), np.ones(3)),
    )
    generated = Link(Node("TexCoord"), "Generated")
    shown = Node("Emission", "", {"Color": generated, "Strength": 1.0})
    # A square before the camera, moved sideways by half of its size
    glow = Material("Glow", shown, displacement=constant(1.0, 0, 0),
                    displacement_method="DISPLACEMENT")  # fmt: skip
    view = s.orthographic((0.5, 0.25, 5), (0.5, 0.25, 0), size=1, scale=0.01)
    picture = s.pixels(view, instance(square, glow), samples=4)
    np.testing.assert_allclose(picture[0, 0, :2], [0.25, 0.625], atol=0.01)


def test_what_deforms_is_displaced_all_the_time():
    # A pyramid that grows: its sides get steeper, and so do its normals after each step.
    ends = np.stack([PYRAMID, PYRAMID * [1, 1, 2]])
    way = constant(0.25, 0, 0)
    before = pyramid(deformation=Deformation(ends, np.stack([UP, UP])))
    (found,) = moved(instance(before, material(way)))
    np.testing.assert_allclose(found.mesh.deformation.positions, ends + [0.25, 0, 0], atol=1e-6)
    for end, normals in zip(ends, found.mesh.deformation.normals, strict=True):
        still = Mesh("Still", end.astype(np.float32), SIDES, UP)
        (there,) = moved(instance(still, material(way)))
        np.testing.assert_allclose(normals, there.mesh.normals, atol=1e-6)
    assert not np.allclose(*found.mesh.deformation.normals)


def test_what_moves_keeps_its_generated_coordinates_from_before_it_was_displaced():
    square = Mesh(
        "Square",
        np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
        np.int32([[0, 1, 2], [0, 2, 3]]),
        texture_space=(np.zeros(3), np.ones(3)),
    )
    shown = Node("Emission", "", {"Color": Link(Node("TexCoord"), "Generated"), "Strength": 1.0})
    glow = Material(
        "Glow", shown, displacement=constant(1.0, 0, 0), displacement_method="DISPLACEMENT"
    )
    # It is in the frame where the camera never sees it, and rests elsewhere all the time.
    view = s.orthographic((0.5, 0.25, 5), (0.5, 0.25, 0), size=1, scale=0.01)
    gone = instance(square, glow, shift=(5, 6, 0))
    here = replace(gone, motion=np.array([s.affine(), s.affine()]))
    picture = s.pixels(view, here, samples=4)
    np.testing.assert_allclose(picture[0, 0, :2], [0.25, 0.625], atol=0.01)


@pytest.mark.parametrize("is_old", (False, True), ids=("as now", "as before Blender 5"))
def test_bump_of_a_displaced_facet_begins_where_it_was_or_at_the_normal_that_it_has(is_old):
    # A square that becomes a slope; it shows its normal
    slope = 0.8
    place = Link(Node("SeparateXYZ", "", {"Vector": Link(Node("NewGeometry"), "Position")}), "X")
    ramp = Node("Math", "", {"Value": place, "Value_001": slope}, {"operation": "MULTIPLY"})
    half = {"Vector_001": (0.5, 0.5, 0.5), "Vector_002": (0.5, 0.5, 0.5)}
    inputs = {"Vector": Link(Node("NewGeometry"), "Normal"), **half}
    normal = Link(Node("VectorMath", "", inputs, {"operation": "MULTIPLY_ADD"}), "Vector")
    square = Mesh(
        "Square",
        np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
        np.int32([[0, 1, 2], [0, 2, 3]]),
    )
    shown = Material(
        "Shown",
        Node("Emission", "", {"Color": normal, "Strength": 1.0}),
        displacement=raised(Link(ramp, "Value")),
        displacement_method="BOTH",
        bump_at_rest=not is_old,
    )
    view = s.orthographic((0.3, 0.25, 5), (0.3, 0.25, 0), size=1, scale=0.01)
    found = s.pixels(view, instance(square, shown), samples=4)[0, 0, :3] * 2 - 1

    facet = np.array((-slope, 0, 1)) / np.hypot(slope, 1)
    expected = facet
    if is_old:
        # Cycles 4.2: pixels on the facet as it is, of the mean width that they had where it was
        x, y, z = facet
        first = np.array((z - y, x - z, y - x))
        first /= np.linalg.norm(first)
        sides = first, np.cross(facet, first)
        rest = [side * (1, 1, 0) for side in sides]
        wide = np.mean([np.linalg.norm(way) for way in rest])
        rises = [slope * side[0] * wide for side in sides]
        across = np.cross(rest[1], facet), np.cross(facet, rest[0])
        expected = facet * (rest[0] @ across[0]) - sum(map(np.multiply, across, rises))
        expected /= np.linalg.norm(expected)
    np.testing.assert_allclose(found, expected, atol=1e-3)
