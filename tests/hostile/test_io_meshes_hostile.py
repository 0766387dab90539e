import base64
import json
import zlib

import meshio
import numpy as np
import pytest
import trimesh

from glisson.core import BadInput, Deformation, Model, Status, TetMesh, TriangleSurface
from glisson.core.model import Material
from glisson.io import decoding
from glisson.io.deformation_files import read_deformation, write_deformation
from glisson.io.markups import read_curve, read_plane, read_points
from glisson.io.model_files import read_model, write_model
from glisson.io.observation_files import read_observations
from glisson.io.scenario_files import read_scenario
from glisson.io.surfaces import read_surface, write_surface
from glisson.io.tetrahedra import read_tetrahedra, write_tetrahedra

NODES = np.array([[0, 0, 0], [20, 0, 0], [0, 20, 0], [0, 0, 20], [20, 20, 20]], dtype=float)
MESH = TetMesh(NODES, [[0, 1, 2, 3], [1, 2, 3, 4]])
SPHERE = trimesh.creation.icosphere(subdivisions=1, radius=30.0)
SURFACE = TriangleSurface(SPHERE.vertices, SPHERE.faces)


def refused(path, complaint, read=read_tetrahedra, **keywords):
    with pytest.raises(BadInput) as caught:
        read(path, **keywords)
    sentence = str(caught.value)
    assert complaint in sentence
    assert sentence.startswith(str(path))
    assert "\n" not in sentence


def vtu(points="0 0 0 20 0 0 0 20 0 0 0 20", cells="0 1 2 3", offsets="4", types="10", counts=(4, 1), **root):
    attributes = {"type": "UnstructuredGrid", "version": "0.1", "byte_order": "LittleEndian"} | root
    head = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return f"""<VTKFile {head}><UnstructuredGrid>
<Piece NumberOfPoints="{counts[0]}" NumberOfCells="{counts[1]}">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{points}</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">{cells}</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">{offsets}</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">{types}</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>"""


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (vtu(points="0 0 0 20 0 0 0 20 0 0 0 nan"), "1 of its points are not finite"),
        (vtu(points="0 0 0 20 0 0 0 20 0 0 0 inf"), "1 of its points are not finite"),
        (vtu(points="0 0 0 20 0 0 0 20 0"), "where it announces 4 points"),
        (vtu(points="0 0 0 20 0 0 0 20 0 0 0 x"), "cannot be read as a tetrahedral mesh"),
        (vtu(points="0 0 0 20 0 0 0 20 0 20 20 0"), "1 of its tetrahedra are flat"),
        (vtu(cells="0 1 2 9"), "names point 9, but there are 4"),
        (vtu(cells="0 1 2 -1"), "a cell names point"),
        (vtu(cells="0 1 2"), "do not fit each other"),
        (vtu(offsets="5"), "do not fit each other"),
        (vtu(offsets="-4"), "do not fit each other"),
        (vtu(types="12"), "cells of the VTK types [12]; Glisson reads tetrahedra only"),
        (vtu(types="24"), "has not 10 points"),
        (vtu(types="5"), "it must hold tetrahedra"),
        (vtu(types=""), "do not fit each other"),
        (vtu(cells="", offsets="", types="", counts=(4, 0)), "it must hold tetrahedra"),
        (vtu(counts=(5, 1)), "where it announces 5 points"),
        (vtu(type="ImageData"), "type 'ImageData', neither"),
        (vtu()[:300], "cannot be read as a tetrahedral mesh"),
        (vtu().replace("connectivity", "links"), "its cells lack the arrays ['connectivity']"),
        (vtu().replace("ascii", "octal"), "its data format 'octal' is unknown"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]>" + vtu(), "declares a document type"),
        ("<VTKFile/>", "neither an unstructured grid nor poly data"),
        ("", "cannot be read as a tetrahedral mesh"),
        ("# vtk DataFile Version 3.0\n", "cannot be read as a tetrahedral mesh"),
    ],
)
def test_vtu_files_that_lie(tmp_path, content, complaint):
    (tmp_path / "m.vtu").write_text(content)
    refused(tmp_path / "m.vtu", complaint)


def packed_array(blocks, sizes, block_size):
    """A packed inline array whose header says what it likes."""
    header = np.array([len(blocks), block_size, sizes, *map(len, blocks)], "<u4").tobytes()
    return base64.b64encode(header).decode() + base64.b64encode(b"".join(blocks)).decode()


@pytest.mark.parametrize(
    ("array", "complaint"),
    [
        # 100 MB of zeros in 100 kB, announced as the 96 bytes of four points.
        (packed_array([zlib.compress(b"\0" * 100_000_000)], 96, 96), "longer or shorter than announced"),
        (packed_array([zlib.compress(b"\0" * 96)], 4_000_000_000, 96), "more than Glisson reads"),
        (packed_array([zlib.compress(b"\0" * 95)], 96, 96), "longer or shorter than announced"),
        (packed_array([b"garbage"], 96, 96), "cannot be read as a tetrahedral mesh"),
        (base64.b64encode(np.array([4_000_000_000, 96, 96], "<u4").tobytes()).decode(), "more than Glisson reads"),
        (base64.b64encode(np.array([9, 96, 96, 8], "<u4").tobytes()).decode(), "an array ends early"),
        ("", "an array ends early"),
        ("!!!!", "cannot be read as a tetrahedral mesh"),
    ],
)
def test_packed_arrays_that_lie(tmp_path, memory_below, array, complaint):
    text = vtu(compressor="vtkZLibDataCompressor").replace(
        'format="ascii">0 0 0 20 0 0 0 20 0 0 0 20<', f'format="binary">{array}<'
    )
    (tmp_path / "m.vtu").write_text(text)
    with memory_below(5e6):
        if "cannot" in complaint or "early" in complaint:
            with pytest.raises(BadInput):
                read_tetrahedra(tmp_path / "m.vtu")
        else:
            refused(tmp_path / "m.vtu", complaint)


def gmsh(version="2.2 0 8", nodes=None, elements=None, node_count=None, element_count=None):
    nodes = nodes or ["1 0 0 0", "2 20 0 0", "3 0 20 0", "7 0 0 20"]
    elements = elements or ["1 4 2 5 5 1 2 3 7"]
    first = ["$MeshFormat", version, "$EndMeshFormat", "$Nodes", str(node_count or len(nodes)), *nodes, "$EndNodes"]
    return "\n".join([*first, "$Elements", str(element_count or len(elements)), *elements, "$EndElements", ""])


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (gmsh("4.1 0 8"), "Gmsh version '4.1'; save it as version 2.2"),
        (gmsh("4.1 1 8"), "Gmsh version '4.1'"),
        (gmsh(node_count=5), "the section $Nodes announces 5 lines but has 4"),
        (gmsh(node_count=999_999_999_999), "announces 999999999999 lines"),
        (gmsh(element_count=2), "the section $Elements announces 2 lines but has 1"),
        (gmsh(nodes=["1 0 0 0", "2 20 0 0", "3 0 20 0", "3 0 0 20"]), "two nodes have the same number"),
        (gmsh(nodes=["1 0 0 0", "2 20 0 0", "3 0 20 0", "8 0 0 20"]), "names a node that is not there"),
        (gmsh(nodes=["1 0 0 0", "2 20 0 0", "3 0 20 0", "2000000000 0 0 20"]), "names a node that is not there"),
        (gmsh(nodes=["1 0 0", "2 20 0", "3 0 20", "7 0 0"]), "a number and three coordinates"),
        (gmsh(nodes=["1 0 0 0", "2 20 0 0", "3 0 20 0", "7 0 0 nan"]), "1 of its points are not finite"),
        (gmsh(elements=["1 4 2 5 5 1 2 3"]), "a tetrahedron has not 4 nodes"),
        (gmsh(elements=["1 4 -9 5 5 1 2 3 7"]), "a tetrahedron has not 4 nodes"),
        (gmsh(elements=["1 5 2 5 5 1 2 3 7 1 2 3 7"]), "it holds hexahedra; Glisson reads tetrahedra only"),
        (gmsh(elements=["1 2 2 5 5 1 2 3"]), "it must hold tetrahedra"),
        (gmsh(elements=["1 4"]), "an element line is cut short"),
        (gmsh(elements=["1 4 2 5 5 1 2 3 7", "2 11 2 5 5 1 2 3 7 1 2 3 7 1 2"]), "all with 4 or all with 10 nodes"),
        (gmsh().replace("$EndElements", ""), "it lacks the section $Elements"),
        ("$NOD\n4\n1 0 0 0\n$ENDNOD\n", "the section $NOD announces 4 lines but has 1"),
        ("$NOD\n0\n$ENDNOD\n$ELM\n0\n$ENDELM\n", "its node lines"),
        ("solid\n", "Gmsh version 'unknown'"),
        ("", "Gmsh version 'unknown'"),
    ],
)
def test_gmsh_files_that_lie(tmp_path, content, complaint):
    (tmp_path / "m.msh").write_text(content)
    refused(tmp_path / "m.msh", complaint)


def legacy(body, form="ASCII"):
    return f"# vtk DataFile Version 3.0\nany\n{form}\n{body}"


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("solid\n", "no legacy VTK file"),
        (legacy("", "HEX"), "its third line must say ASCII or BINARY, not 'HEX'"),
        (legacy("DATASET STRUCTURED_POINTS\n"), "Glisson reads POLYDATA and UNSTRUCTURED_GRID"),
        (legacy("DATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0\n"), "it ends early: 9 numbers are announced"),
        (legacy("DATASET POLYDATA\nPOINTS 999999999999 float\n0 0 0\n"), "more than it can hold"),
        (legacy("DATASET POLYDATA\nPOINTS -1 float\n0 0 0\n"), "more than it can hold"),
        (legacy("DATASET POLYDATA\nPOINTS 3 bit\n0 0 0\n"), "type 'bit' are unknown"),
        (legacy("DATASET POLYDATA\nPOINTS 1 float\n0 0 0\n"), "it lacks its POINTS or its POLYGONS"),
        (legacy("DATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0 0 9 0\nPOLYGONS 1 4\n3 0 1 9\n"), "point 9"),
        (legacy("DATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0 0 9 0\nPOLYGONS 2 4\n9 0 1 2\n"), "do not add up"),
        (legacy("DATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0 0 9 0\nPOLYGONS 0 0\n"), "it has no triangles"),
        (legacy("DATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0 0 9 0\nTRIANGLE_STRIPS 1 4\n3 0 1 2\n"), "strips"),
        (legacy("DATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0 0 9 0\nWHAT 1\n"), "section 'WHAT' is unknown"),
        (legacy("DATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0 18 0 0\nPOLYGONS 1 4\n3 0 1 2\n"), "no area"),
    ],
)
def test_legacy_files_that_lie(tmp_path, content, complaint):
    (tmp_path / "s.vtk").write_text(content)
    refused(tmp_path / "s.vtk", complaint, read_surface)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".vtk", ".vtp"])
@pytest.mark.parametrize("content", [b"", b"\0" * 84, b"nothing to see\n" * 20, b"\xff" * 500])
def test_surfaces_that_are_none(tmp_path, suffix, content):
    (tmp_path / f"s{suffix}").write_bytes(content)
    refused(tmp_path / f"s{suffix}", "", read_surface)


def test_surfaces_with_bad_numbers(tmp_path):
    (tmp_path / "s.obj").write_text("v 0 0 0\nv 10 0 nan\nv 0 10 0\nf 1 2 3\n")
    refused(tmp_path / "s.obj", "not finite", read_surface)
    (tmp_path / "t.obj").write_text("v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 9\n")
    refused(tmp_path / "t.obj", "", read_surface)
    (tmp_path / "u.obj").write_text("v 0 0 0\nv 10 0 0\n")
    refused(tmp_path / "u.obj", "no triangles", read_surface)
    (tmp_path / "w.stl").write_bytes(b"\0" * 80 + np.uint32(4_000_000_000).tobytes() + b"\0" * 50)
    refused(tmp_path / "w.stl", "cannot be read as a surface", read_surface)
    write_surface(tmp_path / "x.ply", SURFACE)
    content = (tmp_path / "x.ply").read_bytes().replace(b"element vertex 42", b"element vertex 999999999999")
    (tmp_path / "x.ply").write_bytes(content)
    refused(tmp_path / "x.ply", "cannot be read as a surface", read_surface)


def test_suffixes_and_absence(tmp_path):
    refused(tmp_path / "m.vtu", "does not exist")
    refused(tmp_path / "s.stl", "does not exist", read_surface)
    (tmp_path / "m.inp").write_text("")
    refused(tmp_path / "m.inp", "tetrahedra are read from .vtu, .vtk and .msh")
    refused(tmp_path / "m.inp", "surfaces are read from", read_surface)
    (tmp_path / "folder.vtu").mkdir()
    refused(tmp_path / "folder.vtu", "cannot be read as a tetrahedral mesh")


def test_huge_files_are_refused_by_their_size(tmp_path, monkeypatch):
    monkeypatch.setattr(decoding, "MAX_MESH_BYTES", 1000)
    for name, read in (
        ("m.vtu", read_tetrahedra),
        ("m.msh", read_tetrahedra),
        ("m.vtk", read_tetrahedra),
        ("s.stl", read_surface),
        ("s.toml", read_scenario),
        ("o.json", read_observations),
        ("p.mrk.json", read_points),
    ):
        (tmp_path / name).write_bytes(b" " * 2000)
        refused(tmp_path / name, "Glisson reads meshes and text up to", read)


def _binary_gmsh(path):
    mesh = meshio.Mesh(NODES, [("tetra", MESH.tetrahedra)])
    mesh.cell_data = {"gmsh:physical": [np.ones(2, int)], "gmsh:geometrical": [np.ones(2, int)]}
    meshio.gmsh.write(path, mesh, "2.2", binary=True)


def _ascii_vtk(path):
    meshio.vtk.write(path, meshio.Mesh(NODES, [("tetra", MESH.tetrahedra)]), fmt_version="4.2", binary=False)


def _obj(path):
    path.write_text(SPHERE.export(file_type="obj"))


def _markup(path):
    points = [{"label": "a", "position": [1, 2, 3]}, {"label": "b", "position": [4, 5, 6]}]
    path.write_text(json.dumps({"markups": [{"type": "Curve", "coordinateSystem": "RAS", "controlPoints": points}]}))


SAMPLES = {
    "m.vtu": (lambda path: write_tetrahedra(path, MESH), read_tetrahedra),
    "m.msh": (lambda path: path.write_text(gmsh()), read_tetrahedra),
    "binary.msh": (_binary_gmsh, read_tetrahedra),
    "m.vtk": (_ascii_vtk, read_tetrahedra),
    "s.stl": (lambda path: write_surface(path, SURFACE), read_surface),
    "s.ply": (lambda path: write_surface(path, SURFACE), read_surface),
    "s.vtp": (lambda path: write_surface(path, SURFACE), read_surface),
    "s.obj": (_obj, read_surface),
    "c.mrk.json": (_markup, read_curve),
}


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_truncations_and_flipped_bits(tmp_path, name):
    """Whatever happens to a file, either a mesh comes out or one sentence."""
    write, read = SAMPLES[name]
    path = tmp_path / name
    write(path)
    read(path)
    good = path.read_bytes()
    rng = np.random.default_rng(8)
    sentences = []
    for trial in range(120):
        content = bytearray(good)
        if trial % 3 == 0:
            content = content[: int(rng.integers(len(content)))]
        else:
            for place in rng.integers(0, len(content), int(rng.integers(1, 6))):
                content[place] = (
                    int(rng.integers(256)) if trial % 3 == 1 else content[place] ^ (1 << int(rng.integers(8)))
                )
        path.write_bytes(content)
        try:
            read(path)
        except BadInput as error:
            sentences.append(str(error))
    assert len(sentences) > 20
    assert not any("\n" in sentence for sentence in sentences)


@pytest.mark.parametrize("name", ["model", "deformation"])
@pytest.mark.parametrize("which", ["json", "vtu"])
def test_damaged_pairs(tmp_path, name, which):
    if name == "model":
        write_model(tmp_path, Model(MESH, {0: Material("neo-hookean", 7.0, 0.45)}, {0: "liver"}, {"back": [0]}))
        read = read_model
    else:
        write_deformation(tmp_path, Deformation(MESH, (), Status.SINGULAR, "Nothing holds it."))
        read = read_deformation
    path = tmp_path / f"{name}.{which}"
    good = path.read_bytes()
    rng = np.random.default_rng(9)
    for trial in range(60):
        content = bytearray(good)
        if trial % 2:
            content = content[: int(rng.integers(len(content)))]
        else:
            content[int(rng.integers(len(content)))] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        if which == "vtu":
            # Its hash is in the other file, so that nothing of it goes unnoticed.
            with pytest.raises(BadInput):
                read(tmp_path)
        else:
            try:
                read(tmp_path)
            except BadInput:
                continue


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"null", b'{"markups": 3}', b'{"markups": [3]}', b"\xff\xfe", b"[" * 100_000]
)
def test_json_that_is_something_else(tmp_path, content):
    for name, read in (("p.mrk.json", read_plane), ("o.json", read_observations)):
        (tmp_path / name).write_bytes(content)
        refused(tmp_path / name, "", read)
