"""Readers on real files: figures of the data's PROVENANCE.md, and voxels and nodes by other libraries."""

import re

import meshio
import nibabel
import numpy as np
import pydicom
import pytest
import trimesh

from glisson.core import BadInput
from glisson.io.images import read_label_maps, read_labels, read_volume, write_labels, write_volume
from glisson.io.label_groups import group_labels, on_grid_of, require_same_grid
from glisson.io.surfaces import read_surface
from glisson.io.tetrahedra import read_tetrahedra
from glisson.io.totalsegmentator import class_names

pytestmark = pytest.mark.real
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def totalsegmentator(shared_data):
    return shared_data / "open" / "totalsegmentator-example"


def test_ircad_scan(ircad):
    volume = read_volume(ircad / "PATIENT_DICOM")
    assert volume.grid.shape == (512, 512, 119)
    assert np.allclose(volume.grid.spacing_mm, [0.743, 0.743, 1.6], atol=1e-6)
    assert np.allclose(volume.grid.origin_mm, 0.0)
    assert (int(volume.voxels.min()), int(volume.voxels.max())) == (-1024, 1023)
    # By hand, pydicom alone: each file's pixels lie where its ImagePositionPatient says.
    for number in (0, 7, 64, 118):
        dataset = pydicom.dcmread(ircad / "PATIENT_DICOM" / f"image_{number}")
        k = round(float(dataset.ImagePositionPatient[2]) / 1.6)
        place = volume.grid.points_from_indices([[0, 0, k]])[0]
        assert np.allclose(place, [float(x) for x in dataset.ImagePositionPatient], atol=1e-4)
        hounsfield = dataset.pixel_array * float(dataset.RescaleSlope) + float(dataset.RescaleIntercept)
        assert np.array_equal(volume.voxels[:, :, k], hounsfield.T)


def test_ircad_masks(ircad):
    maps = read_label_maps(ircad / "MASKS_DICOM")
    volume = read_volume(ircad / "PATIENT_DICOM")
    by_name = {labels.names[1]: labels for labels in maps}
    # Volumes and mean densities of PROVENANCE.md.
    stated = {"liver": 1861, "tumour1": 85.6, "tumour2": 78.6, "portal": 47.5, "hepatic": 110, "artery": 107}
    for name, millilitres in stated.items():
        require_same_grid(volume, by_name[name], name)
        assert by_name[name].volume_ml(name) == pytest.approx(millilitres, rel=0.005)
    assert volume.voxels[by_name["liver"].mask("liver")].mean() == pytest.approx(99, abs=0.6)
    assert volume.voxels[by_name["portal"].mask("portal")].mean() == pytest.approx(167, abs=0.6)
    assert set(by_name) == {*stated, "bone", "skin"}
    groups = group_labels(maps)
    # The liver mask includes the tumours.
    assert np.array_equal(groups["organ"].voxels == 1, by_name["liver"].voxels == 1)
    assert dict(groups["tumours"].names) == {1: "tumour1", 2: "tumour2"}
    assert groups["structures"].volume_ml("portal") == pytest.approx(47.5, rel=0.005)


def test_ircad_archive_is_to_be_unpacked(shared_data):
    with pytest.raises(BadInput, match="is an archive; unpack it first and give the folder"):
        read_volume(shared_data / "research-only" / "ircadb01-case17" / "PATIENT_DICOM.tar.xz")
    with pytest.raises(BadInput, match="holds no DICOM images"):
        read_volume(shared_data / "research-only")


def test_jpeg_2000_series_lies_on_its_segmentation(totalsegmentator):
    volume = read_volume(totalsegmentator / "example_ct_dicom")
    assert volume.grid.shape == (512, 512, 20)
    files = sorted((totalsegmentator / "example_ct_dicom").iterdir())
    for path in (files[0], files[13]):
        dataset = pydicom.dcmread(path)
        index = volume.grid.indices_from_points([[float(x) for x in dataset.ImagePositionPatient]])[0]
        assert np.allclose(index, np.rint(index), atol=1e-6)
        assert np.allclose(index[:2], 0.0, atol=1e-6)
        assert np.array_equal(volume.voxels[:, :, round(index[2])], dataset.pixel_array.T.astype(int) - 1024)
    labels = read_labels(totalsegmentator / "example_seg_dicom.nii.gz")
    with pytest.raises(BadInput, match="another grid"):
        require_same_grid(volume, labels, "the label map")
    turned = on_grid_of(volume, labels, "the label map")
    # The affines alone say which DICOM voxel a label voxel is; nibabel's is independent of ours.
    image = nibabel.load(totalsegmentator / "example_seg_dicom.nii.gz")
    stored = np.asarray(image.dataobj)
    picked = np.argwhere(stored)[::997]
    points = picked @ image.affine[:3, :3].T + image.affine[:3, 3]
    ours = np.rint(volume.grid.indices_from_points(points * [-1, -1, 1])).astype(int)
    assert np.array_equal(turned.voxels[tuple(ours.T)], stored[tuple(picked.T)])


@pytest.mark.parametrize("name", ["example_ct.nii.gz", "example_ct_sm.nii.gz"])
def test_nifti_scan(totalsegmentator, tmp_path, name):
    image = nibabel.load(totalsegmentator / name)
    volume = read_volume(totalsegmentator / name)
    assert np.allclose(LPS_FROM_RAS @ image.affine, volume.grid.lps_from_index, atol=1e-6)
    assert np.array_equal(volume.voxels, np.asarray(image.dataobj))
    assert volume.voxels.dtype == image.get_data_dtype()
    for suffix in (".nii.gz", ".nrrd"):
        write_volume(tmp_path / f"a{suffix}", volume)
        back = read_volume(tmp_path / f"a{suffix}")
        assert np.array_equal(back.voxels, volume.voxels)
        assert back.grid.matches(volume.grid, 1e-4)


def test_labels_of_totalsegmentator(totalsegmentator, tmp_path):
    path = totalsegmentator / "example_seg_fast_force_split.nii.gz"
    volume = read_volume(totalsegmentator / "example_ct.nii.gz")
    by_number = read_labels(path, "totalsegmentator")
    require_same_grid(volume, by_number, "the label map")
    assert by_number.number("liver") == 5
    assert by_number.volume_ml("liver") == pytest.approx(1126, abs=0.5)
    densities = volume.voxels[by_number.mask("liver")]
    assert (densities.mean(), densities.std()) == (pytest.approx(44, abs=0.5), pytest.approx(16, abs=0.5))
    # TotalSegmentator writes its names into the file; they must be those of our table.
    text = bytes(nibabel.load(path).header.extensions[0].content).decode()
    stated = {int(key): name for key, name in re.findall(r'Label Key="(\d+)".*?CDATA\[(.*?)\]', text)}
    assert stated == class_names()
    by_file = read_labels(path)
    assert by_file.number("liver") == 5
    assert by_number.names.items() <= by_file.names.items()
    groups = group_labels([by_number])
    assert set(groups) == {"organ", "structures"}
    assert {"ivc", "portal", "gallbladder"} <= set(groups["structures"].names.values())
    write_labels(tmp_path / "l.nii.gz", groups["structures"])
    assert dict(read_labels(tmp_path / "l.nii.gz").names) == dict(groups["structures"].names)


@pytest.mark.parametrize(
    ("name", "vertices", "triangles", "millilitres"),
    [
        ("Liver/liver.vtk", 10012, 20000, 2316.2),
        ("Liver/portal_vein.vtk", 4994, 9980, None),
        ("Liver/hepatic_veins.vtk", 7302, 14600, None),
        ("Liver/liver_tumours.vtk", 2028, 4052, None),
        ("liver.ply", 2002, 4000, None),
        ("overlay/liver_sub.ply", 1252, 2500, None),
    ],
)
def test_liver_surfaces(shared_data, name, vertices, triangles, millilitres):
    surface = read_surface(shared_data / "open" / "sksurgeryvtk-liver-models" / name)
    assert (len(surface.vertices), len(surface.triangles)) == (vertices, triangles)
    assert surface.is_closed
    other = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    assert other.is_watertight
    assert surface.volume_mm3 == pytest.approx(other.volume, rel=1e-9)
    if millilitres:
        assert surface.volume_mm3 / 1000.0 == pytest.approx(millilitres, rel=1e-4)


def test_small_and_arbitrary_surfaces(shared_data):
    fiducial = shared_data / "open" / "sksurgeryvtk-liver-models" / "Fiducial.stl"
    with pytest.raises(BadInput, match=r"only 3\.03 mm large"):
        read_surface(fiducial)
    other = trimesh.load(fiducial)
    surface = read_surface(fiducial, "mm")
    assert len(surface.triangles) == 580
    assert np.allclose(np.ptp(surface.vertices, axis=0), other.extents)
    sofa = shared_data / "open" / "sofa-liver"
    for name, vertices in (("liver.obj", 181), ("liver-smooth.obj", 2194)):
        surface = read_surface(sofa / name)
        assert len(surface.vertices) == vertices
        assert surface.is_closed
    # This one has its normals inside; orientation is kept as it is.
    inverted = read_surface(sofa / "liver.vtk")
    assert inverted.is_closed
    assert inverted.volume_mm3 < 0.0


def test_mestdagh_liver_in_metres(shared_data):
    path = shared_data / "open" / "mestdagh-liver-sequences" / "mesh-default" / "liver.msh"
    with pytest.raises(BadInput, match="looks like metres; pass unit='m'"):
        read_tetrahedra(path)
    mesh = read_tetrahedra(path, "m")
    assert mesh.tetrahedra.shape == (10703, 4)
    assert mesh.nodes.shape == (3046, 3)
    assert mesh.volume_mm3 / 1000.0 == pytest.approx(1437, abs=0.5)
    assert mesh.surface().is_closed
    other = meshio.gmsh.read(path)
    assert np.allclose(mesh.nodes, other.points * 1000.0, rtol=1e-12)
    assert np.array_equal(mesh.tetrahedra, other.cells_dict["tetra"])


def test_sofa_livers(shared_data):
    mesh = read_tetrahedra(shared_data / "open" / "sofa-liver" / "liver.msh")
    assert (len(mesh.nodes), len(mesh.tetrahedra)) == (181, 596)
    assert mesh.surface().is_closed
    # The surface of this mesh is kept beside it, as OBJ, by its makers.
    surface = read_surface(shared_data / "open" / "sofa-liver" / "liver.obj")
    assert mesh.volume_mm3 == pytest.approx(surface.volume_mm3, rel=1e-3)
    second = read_tetrahedra(shared_data / "open" / "sofa-liver" / "liver2.msh", "cm")
    assert (len(second.nodes), len(second.tetrahedra)) == (507, 1493)
    fine = read_tetrahedra(shared_data / "open" / "sofa-mor-liverfine" / "liverFine.vtu")
    assert (len(fine.nodes), len(fine.tetrahedra)) == (4293, 22019)
    other = meshio.vtu.read(shared_data / "open" / "sofa-mor-liverfine" / "liverFine.vtu")
    assert np.allclose(fine.nodes, other.points, rtol=1e-6)
    assert np.array_equal(fine.tetrahedra, other.cells_dict["tetra"])


def test_suwelack_t10(shared_data):
    folder = shared_data / "research-only" / "suwelack-liver"
    linear, quadratic = read_tetrahedra(folder / "LiverXSTet4.vtk"), read_tetrahedra(folder / "LiverXSTet10.vtk")
    assert (len(linear.nodes), len(linear.tetrahedra)) == (106, 297)
    assert (len(quadratic.nodes), len(quadratic.tetrahedra)) == (608, 297)
    assert quadratic.volume_mm3 == pytest.approx(linear.volume_mm3, rel=1e-6)
    # Sides are curved, yet every mid-side node is nearest to the middle of the edge that the order says.
    sides = quadratic.nodes[quadratic.tetrahedra[:, 4:]]
    apart = np.linalg.norm(sides[:, :, None] - _middles(quadratic)[:, None], axis=3)
    assert (apart.argmin(axis=2) == np.arange(6)).all()
    other = meshio.vtk.read(folder / "LiverXSTet10.vtk")
    assert np.array_equal(quadratic.nodes[quadratic.tetrahedra], other.points[other.cells_dict["tetra10"]])


def _middles(mesh):
    pairs = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]
    return mesh.nodes[mesh.tetrahedra[:, pairs]].mean(axis=2)
