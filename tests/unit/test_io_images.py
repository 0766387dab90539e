import gzip

import nibabel
import nrrd
import numpy as np
import pytest

from glisson.core import Grid, LabelMap, Volume
from glisson.io.images import read_labels, read_volume, write_labels, write_volume

LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def oblique_grid(shape=(7, 6, 5)) -> Grid:
    rotation, _ = np.linalg.qr(np.random.default_rng(11).normal(size=(3, 3)))
    return Grid(shape, [0.7, 0.9, 2.5], [-110.25, 33.5, 812.125], rotation)


def scan(grid: Grid, dtype=np.int16) -> Volume:
    return Volume(np.random.default_rng(5).integers(-1000, 1000, grid.shape).astype(dtype), grid)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd"])
@pytest.mark.parametrize("modality", ["CT", "MR"])
def test_round_trip_of_a_scan(tmp_path, suffix, modality):
    grid = oblique_grid()
    volume = Volume(scan(grid).voxels, grid, modality)
    write_volume(tmp_path / f"ct{suffix}", volume)
    back = read_volume(tmp_path / f"ct{suffix}")
    assert np.array_equal(back.voxels, volume.voxels)
    assert back.voxels.dtype == volume.voxels.dtype
    # NIfTI holds single precision: 1e-7 of some 800 mm.
    assert back.grid.matches(grid, 1e-9 if suffix == ".nrrd" else 1e-3)
    assert back.modality == modality
    assert [entry.name for entry in tmp_path.iterdir()] == [f"ct{suffix}"]


@pytest.mark.parametrize("dtype", [np.int64, np.bool_, np.float16, np.int32, np.float64, np.uint16])
@pytest.mark.parametrize("suffix", [".nii.gz", ".nrrd"])
def test_every_number_type_keeps_its_values(tmp_path, dtype, suffix):
    voxels = np.random.default_rng(2).integers(0, 2 if dtype is np.bool_ else 500, (4, 5, 6)).astype(dtype)
    write_volume(tmp_path / f"a{suffix}", Volume(voxels, Grid((4, 5, 6), [1, 1, 1], [0, 0, 0])))
    assert np.array_equal(read_volume(tmp_path / f"a{suffix}").voxels, voxels)


def test_geometry_of_what_we_write_is_what_nibabel_reads(tmp_path):
    volume = scan(oblique_grid())
    write_volume(tmp_path / "ct.nii.gz", volume)
    image = nibabel.load(tmp_path / "ct.nii.gz")
    assert np.allclose(LPS_FROM_RAS @ image.affine, volume.grid.lps_from_index, atol=1e-4)
    assert np.allclose(image.header.get_qform(), image.header.get_sform(), atol=1e-4)
    assert image.header.get_xyzt_units()[0] == "mm"
    assert np.array_equal(np.asarray(image.dataobj), volume.voxels)


def test_geometry_of_what_we_write_is_what_pynrrd_reads(tmp_path):
    volume = scan(oblique_grid())
    write_volume(tmp_path / "ct.nrrd", volume)
    voxels, header = nrrd.read(str(tmp_path / "ct.nrrd"))
    assert np.array_equal(voxels, volume.voxels)
    assert header["space"] == "left-posterior-superior"
    assert np.array_equal(header["space directions"].T, volume.grid.lps_from_index[:3, :3])
    assert np.array_equal(header["space origin"], volume.grid.origin_mm)


def nifti(path, voxels, affine=None, sform=1, qform=1, unit="mm", slope=None, kind=nibabel.Nifti1Image):
    affine = np.diag([2.0, 3.0, 4.0, 1.0]) if affine is None else affine
    image = kind(voxels, affine)
    image.set_qform(affine, code=qform)
    image.set_sform(affine if sform else None, code=sform)
    image.header.set_xyzt_units(unit)
    if slope:
        image.header.set_slope_inter(*slope)
    image.to_filename(path)


def test_ras_on_disk_is_lps_inside(tmp_path):
    affine = np.array([[2.0, 0, 0, 10], [0, 3, 0, 20], [0, 0, 4, 30], [0, 0, 0, 1]])
    nifti(tmp_path / "a.nii", np.zeros((3, 4, 5), np.int16), affine)
    grid = read_volume(tmp_path / "a.nii").grid
    assert grid.points_from_indices([[0, 0, 0]])[0].tolist() == [-10.0, -20.0, 30.0]
    assert grid.points_from_indices([[1, 1, 1]])[0].tolist() == [-12.0, -23.0, 34.0]


def test_qform_where_there_is_no_sform(tmp_path):
    rotation = oblique_grid().direction
    rotation = rotation * np.sign(np.linalg.det(rotation))
    affine = np.eye(4)
    affine[:3, :3] = rotation * [1.5, 2.0, 3.0]
    affine[:3, 3] = [4.0, 5.0, 6.0]
    nifti(tmp_path / "a.nii.gz", np.zeros((3, 4, 5), np.int16), affine, sform=0)
    assert np.allclose(read_volume(tmp_path / "a.nii.gz").grid.lps_from_index, LPS_FROM_RAS @ affine, atol=1e-5)


@pytest.mark.parametrize(("unit", "scale"), [("mm", 1.0), ("meter", 1000.0), ("micron", 0.001), ("unknown", 1.0)])
def test_units_of_the_header_are_honoured(tmp_path, unit, scale):
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    affine[:3, 3] = [5.0, 6.0, 7.0]
    nifti(tmp_path / "a.nii", np.zeros((3, 4, 5), np.int16), affine, unit=unit)
    grid = read_volume(tmp_path / "a.nii").grid
    assert np.allclose(grid.spacing_mm, 2.0 * scale)
    assert np.allclose(grid.origin_mm, np.array([-5.0, -6.0, 7.0]) * scale)


@pytest.mark.parametrize(("slope", "dtype"), [((1, -1024), np.int16), ((2, 10), np.int16), ((0.5, 0.25), np.float32)])
def test_scaling_is_applied(tmp_path, slope, dtype):
    stored = np.random.default_rng(1).integers(0, 4000, (4, 4, 4)).astype(np.uint16)
    image = nibabel.Nifti1Image(stored, np.eye(4))
    image.header.set_xyzt_units("mm")
    image.to_filename(tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    content[112:120] = np.array(slope, dtype="<f4").tobytes()  # scl_slope and scl_inter of NIfTI-1
    (tmp_path / "a.nii").write_bytes(content)
    volume = read_volume(tmp_path / "a.nii")
    assert np.allclose(volume.voxels, stored.astype(np.int64) * slope[0] + slope[1], rtol=1e-6)
    assert volume.voxels.dtype == dtype


def test_big_endian_and_nifti_2(tmp_path):
    voxels = np.arange(60, dtype=np.int16).reshape(3, 4, 5)
    header = nibabel.Nifti1Header(endianness=">")
    header.set_data_dtype(np.int16)
    nibabel.Nifti1Image(voxels, np.eye(4), header).to_filename(tmp_path / "big.nii")
    assert (tmp_path / "big.nii").read_bytes()[:4] == b"\x00\x00\x01\x5c"
    nifti(tmp_path / "two.nii.gz", voxels, kind=nibabel.Nifti2Image)
    for name in ("big.nii", "two.nii.gz"):
        found = read_volume(tmp_path / name).voxels
        assert np.array_equal(found, voxels)
        assert found.dtype.isnative


def test_a_fourth_dimension_of_one_is_no_dimension(tmp_path):
    nifti(tmp_path / "a.nii", np.ones((3, 4, 5, 1), np.int16))
    assert read_volume(tmp_path / "a.nii").grid.shape == (3, 4, 5)


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2"])
@pytest.mark.parametrize("space", ["LPS", "right-anterior-superior", "left-anterior-superior"])
def test_nrrd_spaces_and_encodings(tmp_path, encoding, space):
    voxels = np.arange(60, dtype=np.int16).reshape(3, 4, 5)
    signs = {"LPS": [1, 1, 1], "right-anterior-superior": [-1, -1, 1], "left-anterior-superior": [1, -1, 1]}[space]
    directions = oblique_grid().direction * [1.0, 2.0, 3.0]
    header = {
        "space": space,
        "space directions": (directions * np.array(signs)[:, None]).T,
        "space origin": np.array([7.0, 8.0, 9.0]) * signs,
        "encoding": encoding,
    }
    nrrd.write(str(tmp_path / "a.nrrd"), voxels, header)
    volume = read_volume(tmp_path / "a.nrrd")
    assert np.array_equal(volume.voxels, voxels)
    assert np.allclose(volume.grid.lps_from_index[:3, :3], directions)
    assert np.allclose(volume.grid.origin_mm, [7.0, 8.0, 9.0])


def test_nrrd_with_its_data_beside_it(tmp_path):
    voxels = np.arange(60, dtype=np.int16).reshape(3, 4, 5)
    header = {"space": "LPS", "space directions": np.eye(3), "space origin": np.zeros(3), "encoding": "gzip"}
    nrrd.write(str(tmp_path / "a.nhdr"), voxels, header)
    assert len(list(tmp_path.iterdir())) == 2
    assert np.array_equal(read_volume(tmp_path / "a.nhdr").voxels, voxels)


@pytest.mark.parametrize("suffix", [".nii.gz", ".nii", ".nrrd"])
@pytest.mark.parametrize("dtype", [np.uint8, np.int64])
def test_round_trip_of_labels_with_their_names(tmp_path, suffix, dtype):
    voxels = np.random.default_rng(9).integers(0, 4, (6, 5, 4)).astype(dtype)
    names = {1: "liver", 2: "tumour1", 3: "Gefäß <3 & Ω", 7: "absent"}
    labels = LabelMap(voxels, oblique_grid((6, 5, 4)), names)
    write_labels(tmp_path / f"l{suffix}", labels)
    back = read_labels(tmp_path / f"l{suffix}")
    assert dict(back.names) == names
    assert np.array_equal(back.voxels, voxels)
    assert back.grid.matches(labels.grid, 1e-3)


def test_other_readers_tolerate_the_names_in_a_nifti_file(tmp_path):
    labels = LabelMap(np.ones((3, 3, 3), np.uint8), Grid((3, 3, 3), [1, 1, 1], [0, 0, 0]), {1: "liver"})
    write_labels(tmp_path / "l.nii.gz", labels)
    image = nibabel.load(tmp_path / "l.nii.gz")
    assert np.asarray(image.dataobj).sum() == 27
    (extension,) = image.header.extensions
    assert extension.get_code() == 30  # NIFTI_ECODE_CARET
    content = gzip.decompress((tmp_path / "l.nii.gz").read_bytes())
    # The voxels start where vox_offset says, a multiple of 16 behind the extension.
    offset = int(np.frombuffer(content[108:112], "<f4")[0])
    assert offset % 16 == 0
    assert set(content[offset : offset + 27]) == {1}
