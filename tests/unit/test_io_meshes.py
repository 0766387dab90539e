import io

import meshio
import numpy as np
import pytest
import trimesh

from glisson.core import BadInput, TetMesh, TriangleSurface
from glisson.core.mesh import TET_EDGES
from glisson.io.surfaces import read_surface, write_surface
from glisson.io.tetrahedra import read_tetrahedra, write_tetrahedra

# A cube of 20 mm in six tetrahedra around a diagonal (Kuhn).
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float) * 20.0 + [5.0, -3.0, 1.0]
KUHN = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


def cube(quadratic=False, regions=None) -> TetMesh:
    volumes = np.linalg.det(CORNERS[KUHN[:, 1:]] - CORNERS[KUHN[:, :1]])
    tetrahedra = np.where(volumes[:, None] > 0, KUHN, KUHN[:, [0, 2, 1, 3]])
    mesh = TetMesh(CORNERS, tetrahedra, np.arange(6) % 3 if regions is None else regions)
    return mesh.as_quadratic() if quadratic else mesh


def quadratic_error(mesh: TetMesh) -> float:
    """How far T10 shape functions in the order of `TET_EDGES` are from a quadratic field, at random points."""

    def field(points):
        x, y, z = points.T
        return 1.0 + x - 2 * y + 3 * x * y - z * z + 0.5 * y * z - x * x

    weights = np.random.default_rng(1).dirichlet(np.ones(4), 30)
    shapes = np.hstack([weights * (2 * weights - 1), 4 * weights[:, TET_EDGES[:, 0]] * weights[:, TET_EDGES[:, 1]]])
    nodal = field(mesh.nodes)
    worst = 0.0
    for element in mesh.tetrahedra:
        points = weights @ mesh.nodes[element[:4]]
        worst = max(worst, float(np.abs(shapes @ nodal[element] - field(points)).max()))
    return worst / float(np.abs(nodal).max())


@pytest.mark.parametrize("quadratic", [False, True])
def test_round_trip_is_exact(tmp_path, quadratic):
    mesh = cube(quadratic)
    displacement = np.random.default_rng(2).normal(size=mesh.nodes.shape)
    write_tetrahedra(tmp_path / "m.vtu", mesh, {"displacement": displacement}, {"strain": np.arange(6.0)})
    back = read_tetrahedra(tmp_path / "m.vtu")
    assert np.array_equal(back.nodes, mesh.nodes)
    assert np.array_equal(back.tetrahedra, mesh.tetrahedra)
    assert np.array_equal(back.region_numbers, mesh.region_numbers)
    other = meshio.read(tmp_path / "m.vtu")
    assert np.array_equal(other.points, mesh.nodes)
    assert np.array_equal(other.cells_dict["tetra10" if quadratic else "tetra"], mesh.tetrahedra)
    assert np.array_equal(other.point_data["displacement"], displacement)
    assert np.array_equal(other.cell_data["region"][0], mesh.region_numbers)
    assert np.array_equal(other.cell_data["strain"][0], np.arange(6.0))


@pytest.mark.parametrize(
    "suffix", ["vtu", "vtu-ascii", "vtu-raw", "vtu-lzma", "vtk", "vtk-binary", "msh", "msh-binary"]
)
@pytest.mark.parametrize("quadratic", [False, True])
def test_files_of_another_writer(tmp_path, suffix, quadratic):
    mesh = cube(quadratic)
    kind = "tetra10" if quadratic else "tetra"
    cells = [("triangle", np.array([[0, 1, 3]])), (kind, mesh.tetrahedra)]
    tags = {"gmsh:physical": [np.array([9]), mesh.region_numbers], "gmsh:geometrical": [np.array([1]), np.ones(6, int)]}
    other = meshio.Mesh(mesh.nodes, cells, cell_data=tags if suffix.startswith("msh") else {})
    path = tmp_path / f"m.{suffix.split('-')[0]}"
    writers = {
        "vtu": lambda: meshio.vtu.write(path, other),
        "vtu-ascii": lambda: meshio.vtu.write(path, other, binary=False),
        "vtu-raw": lambda: meshio.vtu.write(path, other, compression=None),
        "vtu-lzma": lambda: meshio.vtu.write(path, other, compression="lzma"),
        "vtk": lambda: meshio.vtk.write(path, other, fmt_version="4.2", binary=False),
        "vtk-binary": lambda: meshio.vtk.write(path, other, fmt_version="5.1", binary=True),
        "msh": lambda: meshio.gmsh.write(path, other, "2.2", binary=False),
        "msh-binary": lambda: meshio.gmsh.write(path, other, "2.2", binary=True),
    }
    writers[suffix]()
    back = read_tetrahedra(path)
    assert np.allclose(back.nodes, mesh.nodes, rtol=1e-10)
    assert np.array_equal(back.tetrahedra, mesh.tetrahedra)
    if suffix.startswith("msh"):
        assert np.array_equal(back.region_numbers, mesh.region_numbers)
    if quadratic:
        assert quadratic_error(back) < 1e-10


def test_swapping_gmshs_last_two_nodes_matters():
    mesh = cube(quadratic=True)
    swapped = TetMesh(mesh.nodes, mesh.tetrahedra[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]])
    assert quadratic_error(mesh) < 1e-12
    assert quadratic_error(swapped) > 1e-3


def gmsh1(nodes, elements):
    rows = [f"{n} {' '.join(map(repr, map(float, p)))}" for n, p in nodes]
    lines = [
        f"{number} {kind} {region} 1 {len(points)} {' '.join(map(str, points))}"
        for number, (kind, region, points) in enumerate(elements, 1)
    ]
    return "\n".join(["$NOD", str(len(rows)), *rows, "$ENDNOD", "$ELM", str(len(lines)), *lines, "$ENDELM", ""])


@pytest.mark.parametrize("quadratic", [False, True])
def test_gmsh_1_with_gaps_in_its_numbers(tmp_path, quadratic):
    mesh = cube(quadratic)
    numbers = np.random.default_rng(3).permutation(np.arange(1, 500))[: len(mesh.nodes)]
    order = np.random.default_rng(4).permutation(len(mesh.nodes))
    gmsh_from_vtk = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8] if quadratic else [0, 1, 2, 3]
    elements = [(15, 1, numbers[:1]), (2, 8, numbers[:3])]
    elements += [
        (11 if quadratic else 4, int(region), numbers[tetrahedron[gmsh_from_vtk]])
        for tetrahedron, region in zip(mesh.tetrahedra, mesh.region_numbers, strict=True)
    ]
    (tmp_path / "m.msh").write_text(gmsh1([(numbers[n], mesh.nodes[n]) for n in order], elements))
    back = read_tetrahedra(tmp_path / "m.msh")
    assert np.array_equal(back.nodes[back.tetrahedra], mesh.nodes[mesh.tetrahedra])
    assert np.array_equal(back.region_numbers, mesh.region_numbers)


def test_appended_raw_data(tmp_path):
    # As ParaView writes by default: lengths as UInt64, arrays behind an underscore, big-endian here.
    mesh = cube()
    arrays = {
        "points": mesh.nodes.astype(">f4"),
        "connectivity": mesh.tetrahedra.astype(">i4"),
        "offsets": np.arange(4, 25, 4).astype(">i8"),
        "types": np.full(6, 10, "u1"),
    }
    offsets, blob = {}, b""
    for name, values in arrays.items():
        offsets[name] = len(blob)
        blob += np.array(values.nbytes, ">u8").tobytes() + values.tobytes()
    xml = f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="BigEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="6"><PointData/><CellData/>
<Points>
<DataArray type="Float32" Name="Points" NumberOfComponents="3" format="appended" offset="{offsets["points"]}"/></Points>
<Cells><DataArray type="Int32" Name="connectivity" format="appended" offset="{offsets["connectivity"]}"/>
<DataArray type="Int64" Name="offsets" format="appended" offset="{offsets["offsets"]}"/>
<DataArray type="UInt8" Name="types" format="appended" offset="{offsets["types"]}"/></Cells>
</Piece></UnstructuredGrid><AppendedData encoding="raw">
   _"""
    (tmp_path / "m.vtu").write_bytes(xml.encode() + blob + b"\n</AppendedData></VTKFile>")
    back = read_tetrahedra(tmp_path / "m.vtu")
    assert np.allclose(back.nodes, mesh.nodes)
    assert np.array_equal(back.tetrahedra, mesh.tetrahedra)


def test_units(tmp_path):
    mesh = cube()
    small = TetMesh(mesh.nodes / 1000.0, mesh.tetrahedra)
    write_tetrahedra(tmp_path / "m.vtu", small)
    with pytest.raises(BadInput, match=r"only 0\.0346 mm large, which looks like metres; pass unit='m'"):
        read_tetrahedra(tmp_path / "m.vtu")
    assert np.allclose(read_tetrahedra(tmp_path / "m.vtu", "m").nodes, mesh.nodes, rtol=1e-12)
    assert read_tetrahedra(tmp_path / "m.vtu", "mm").volume_mm3 == pytest.approx(8e-6)
    write_tetrahedra(tmp_path / "n.vtu", TetMesh(mesh.nodes * 1000.0, mesh.tetrahedra))
    with pytest.raises(BadInput, match=r"34\.6 m large in mm, which no organ is"):
        read_tetrahedra(tmp_path / "n.vtu")
    with pytest.raises(BadInput, match="unknown unit 'inch'"):
        read_tetrahedra(tmp_path / "n.vtu", "inch")


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("which", [[0, 1, 2, 3, 4, 5], [2, 5]])
def test_elements_numbered_the_other_way_round_are_turned(tmp_path, quadratic, which):
    mesh = cube(quadratic)
    tetrahedra = mesh.tetrahedra.copy()
    # By hand: swap corners 0 and 1; edges 12-02 and 03-13 change places.
    mirror = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9] if quadratic else [1, 0, 2, 3]
    tetrahedra[which] = tetrahedra[which][:, mirror]
    kind = "tetra10" if quadratic else "tetra"
    meshio.vtu.write(tmp_path / "m.vtu", meshio.Mesh(mesh.nodes, [(kind, tetrahedra)]))
    back = read_tetrahedra(tmp_path / "m.vtu")
    assert back.volume_mm3 == pytest.approx(8000.0)
    assert back.surface().is_closed
    if quadratic:
        assert quadratic_error(back) < 1e-10


def test_a_mesh_that_folds_onto_itself_is_refused(tmp_path):
    mesh = cube()
    outer = mesh.surface()
    tetrahedra = np.hstack([np.full((12, 1), 8), outer.triangles[:, [0, 2, 1]]])
    nodes = np.vstack([outer.vertices, [[12.0, 5.0, 8.0]]])
    star = TetMesh(
        nodes, tetrahedra if np.linalg.det(nodes[tetrahedra[0, 1:]] - nodes[8]) > 0 else tetrahedra[:, [0, 2, 1, 3]]
    )
    pushed = nodes.copy()
    pushed[8] = [40.0, 5.0, 8.0]  # the middle node is pushed through a side
    meshio.vtu.write(tmp_path / "m.vtu", meshio.Mesh(pushed, [("tetra", star.tetrahedra)]))
    with pytest.raises(BadInput, match="2 of its 12 tetrahedra are inside out and the mesh folds onto itself"):
        read_tetrahedra(tmp_path / "m.vtu")


def test_nodes_without_elements_are_left_out(tmp_path):
    mesh = cube()
    nodes = np.vstack([[[1000.0, 0, 0]], mesh.nodes])
    meshio.vtu.write(tmp_path / "m.vtu", meshio.Mesh(nodes, [("tetra", mesh.tetrahedra + 1)]))
    back = read_tetrahedra(tmp_path / "m.vtu")
    assert np.array_equal(back.nodes, mesh.nodes)
    assert np.array_equal(back.tetrahedra, mesh.tetrahedra)


def test_arrays_of_the_wrong_length_are_not_written(tmp_path):
    with pytest.raises(BadInput, match="'u' must hold 8 numbers"):
        write_tetrahedra(tmp_path / "m.vtu", cube(), {"u": np.zeros(7)})
    with pytest.raises(BadInput, match=r"written as \.vtu"):
        write_tetrahedra(tmp_path / "m.msh", cube())
    assert not list(tmp_path.iterdir())


def sphere() -> TriangleSurface:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=31.7)
    return TriangleSurface(mesh.vertices + np.array([10.123456789, 20.0, -5.0]), mesh.faces)


@pytest.mark.parametrize(("suffix", "tolerance"), [(".stl", 4e-6), (".ply", 4e-6), (".vtp", 0.0)])
def test_round_trip_of_a_surface(tmp_path, suffix, tolerance):
    surface = sphere()
    write_surface(tmp_path / f"s{suffix}", surface)
    back = read_surface(tmp_path / f"s{suffix}")
    # STL keeps triangles, not vertex numbers, so corners are compared.
    difference = back.vertices[back.triangles] - surface.vertices[surface.triangles]
    assert np.abs(difference).max() <= tolerance
    assert len(back.vertices) == len(surface.vertices)
    assert back.is_closed
    other = trimesh.load(tmp_path / f"s{suffix}") if suffix != ".vtp" else None
    if other is not None:
        assert other.volume == pytest.approx(surface.volume_mm3, rel=1e-6)


@pytest.mark.parametrize("kind", ["obj", "ply", "ply-ascii", "stl", "stl-ascii"])
def test_surfaces_of_another_writer(tmp_path, kind):
    surface = sphere()
    mesh = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    suffix = kind.split("-")[0]
    options = {"ply-ascii": {"encoding": "ascii"}}.get(kind, {})
    data = mesh.export(file_type="stl_ascii" if kind == "stl-ascii" else suffix, **options)
    (tmp_path / f"s.{suffix}").write_bytes(data if isinstance(data, bytes) else data.encode())
    back = read_surface(tmp_path / f"s.{suffix}")
    assert np.abs(back.vertices[back.triangles] - surface.vertices[surface.triangles]).max() < 1e-5
    assert back.is_closed


def test_obj_with_texture_normals_and_quadrangles(tmp_path):
    (tmp_path / "s.obj").write_text(
        "mtllib /etc/passwd\nv 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nvt 0 0\nvn 0 0 1\nusemtl x\n"
        "f 1/1/1 2/1/1 3/1/1 4/1/1\n"
    )
    surface = read_surface(tmp_path / "s.obj")
    assert surface.triangle_areas_mm2.sum() == pytest.approx(100.0)
    assert len(surface.triangles) == 2


def test_legacy_polydata_of_both_kinds(tmp_path):
    surface = sphere()
    flat = np.hstack([np.full((len(surface.triangles), 1), 3), surface.triangles])
    text = io.StringIO()
    text.write(f"# vtk DataFile Version 3.0\nany\nASCII\nDATASET POLYDATA\nPOINTS {len(surface.vertices)} double\n")
    np.savetxt(text, surface.vertices, fmt="%.17g")
    text.write(f"METADATA\nINFORMATION 0\n\nPOLYGONS {len(flat)} {flat.size}\n")
    np.savetxt(text, flat, fmt="%d")
    text.write(f"POINT_DATA {len(surface.vertices)}\nSCALARS a double\nLOOKUP_TABLE default\n")
    (tmp_path / "a.vtk").write_text(text.getvalue())
    head = (
        f"# vtk DataFile Version 5.1\nany\nBINARY\nDATASET POLYDATA\nPOINTS {len(surface.vertices)} double\n".encode()
    )
    offsets = np.arange(0, 3 * len(flat) + 1, 3)
    body = surface.vertices.astype(">f8").tobytes() + f"\nPOLYGONS {len(offsets)} {3 * len(flat)}\n".encode()
    body += b"OFFSETS vtktypeint64\n" + offsets.astype(">i8").tobytes()
    body += b"\nCONNECTIVITY vtktypeint64\n" + surface.triangles.astype(">i8").tobytes() + b"\n"
    (tmp_path / "b.vtk").write_bytes(head + body)
    for name in ("a.vtk", "b.vtk"):
        back = read_surface(tmp_path / name)
        assert np.array_equal(back.vertices, surface.vertices)
        assert np.array_equal(back.triangles, surface.triangles)


def test_polygons_become_fans_and_collapsed_triangles_go(tmp_path):
    (tmp_path / "a.vtk").write_text(
        "# vtk DataFile Version 3.0\nany\nASCII\nDATASET POLYDATA\nPOINTS 5 float\n"
        "0 0 0 10 0 0\n14 7 0 10 10 0 0 10 0\nPOLYGONS 2 10\n5 0 1 2 3 4\n3 0 1 1\n"
    )
    surface = read_surface(tmp_path / "a.vtk")
    assert surface.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert surface.triangle_areas_mm2.sum() == pytest.approx(120.0)
