import gzip
import zlib

import nibabel
import nrrd
import numpy as np
import pytest

from glisson.core import BadInput, Grid, Volume
from glisson.io.images import read_labels, read_volume, write_volume

VOXELS = np.random.default_rng(0).integers(-1000, 1000, (6, 5, 4)).astype(np.int16)


def nifti(path, voxels=VOXELS, affine=None, **fields):
    """A NIfTI file with header fields overwritten after nibabel made them right."""
    image = nibabel.Nifti1Image(voxels, np.eye(4) if affine is None else affine)
    image.header.set_xyzt_units("mm")
    image.set_sform(image.affine, 1)
    image.set_qform(image.affine, 1, strip_shears=True)
    image.to_filename(path)
    packed = path.suffix == ".gz"
    content = bytearray(gzip.decompress(path.read_bytes()) if packed else path.read_bytes())
    header = np.frombuffer(content, nibabel.nifti1.header_dtype, count=1)
    for field, value in fields.items():
        header[field] = value
    path.write_bytes(gzip.compress(bytes(content)) if packed else bytes(content))
    return path


def refused(path, complaint, read=read_volume):
    with pytest.raises(BadInput) as caught:
        read(path)
    sentence = str(caught.value)
    assert complaint in sentence
    assert str(path) in sentence
    assert "\n" not in sentence


def sheared():
    affine = np.eye(4)
    affine[0, 1] = 0.2
    return affine


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"pixdim": [1, 0, 1, 1, 0, 0, 0, 0]}, "spacing [0.0, 1.0, 1.0] is not positive"),
        ({"pixdim": [1, 1, -2, 1, 0, 0, 0, 0]}, "spacing [1.0, -2.0, 1.0] is not positive"),
        ({"pixdim": [1, 1, np.nan, 1, 0, 0, 0, 0]}, "is not positive"),
        ({"pixdim": [1, 1, np.inf, 1, 0, 0, 0, 0]}, "is not positive"),
        ({"pixdim": [1, 1, 1, 3, 0, 0, 0, 0]}, "two voxel spacings, 1 × 1 × 3 (pixdim) and 1 × 1 × 1 (orientation)"),
        ({"sform_code": 0, "qform_code": 0}, "so left and right are unknown"),
        ({"srow_x": [np.nan, 0, 0, 0]}, "not finite"),
        ({"srow_x": [0, 0, 0, 0]}, "two voxel spacings"),
        ({"dim": [3, 6, 5, 0, 1, 1, 1, 1]}, "impossible size 6 × 5 × 0"),
        ({"dim": [3, 6, -5, 4, 1, 1, 1, 1]}, "impossible size 6 × -5 × 4"),
        ({"dim": [2, 6, 20, 1, 1, 1, 1, 1]}, "2 dimensions (6 × 20)"),
        ({"dim": [4, 6, 5, 2, 2, 1, 1, 1]}, "4 dimensions (6 × 5 × 2 × 2); Glisson reads one 3-D image, so split it"),
        ({"dim": [3, 6, 5, 40, 1, 1, 1, 1]}, "shorter than its header says"),
        ({"dim": [3, 2000, 2000, 2000, 1, 1, 1, 1]}, "asks for 2000 × 2000 × 2000 voxels (16.0 GB); Glisson reads"),
        ({"datatype": 128, "bitpix": 24}, "not plain numbers"),
        ({"datatype": 1792, "bitpix": 128}, "not plain numbers"),
        ({"datatype": 77}, "cannot be read as a NIfTI image"),
        ({"magic": b"ni1"}, "pairs of .hdr and .img are not read"),
        ({"sizeof_hdr": 99}, "it is not a NIfTI file"),
        ({"xyzt_units": 7}, "NIfTI"),
        ({"vox_offset": 1e9}, "cannot be read as a NIfTI image"),
        ({"vox_offset": np.nan}, "cannot be read as a NIfTI image"),
        ({"scl_slope": 1.0, "scl_inter": np.inf}, "NIfTI"),
    ],
)
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_headers_that_lie(tmp_path, fields, complaint, suffix):
    path = nifti(tmp_path / f"a{suffix}", **fields)
    if suffix == ".nii.gz" and "shorter" in complaint:
        complaint = "NIfTI image"  # packed so small, it is only found out on unpacking
    refused(path, complaint)


def test_sheared_axes_are_refused(tmp_path):
    path = nifti(tmp_path / "a.nii", affine=sheared(), pixdim=[1, 1, np.sqrt(1.04), 1, 0, 0, 0, 0])
    refused(path, "not perpendicular (sheared or tilted scan); resample it first")
    header = {"space": "LPS", "space directions": sheared()[:3, :3].T, "space origin": np.zeros(3)}
    nrrd.write(str(tmp_path / "a.nrrd"), VOXELS, header)
    refused(tmp_path / "a.nrrd", "not perpendicular")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("suffix", [".nii.gz", ".nrrd"])
def test_voxels_that_are_no_numbers(tmp_path, bad, suffix):
    voxels = VOXELS.astype(np.float32)
    good = tmp_path / f"a{suffix}"
    write_volume(good, Volume(voxels, Grid(voxels.shape, [1, 1, 1], [0, 0, 0])))
    voxels = voxels.copy()
    voxels[2, 2, 2] = bad
    if suffix == ".nrrd":
        header = {"space": "LPS", "space directions": np.eye(3), "space origin": np.zeros(3)}
        nrrd.write(str(good), voxels, header)
    else:
        nibabel.Nifti1Image(voxels, np.eye(4)).to_filename(good)
    refused(good, "voxels that are not finite numbers")


def test_a_small_file_that_unpacks_to_gigabytes(tmp_path, memory_below):
    """2.2 MB of zeros unpack to 2.2 GB or more: refused by the header, within no memory to speak of."""
    header = nibabel.Nifti1Header()
    header.set_data_dtype(np.int16)
    header.set_data_shape((1300, 1300, 1300))
    header.set_sform(np.eye(4), 1)
    header["vox_offset"], header["magic"] = 352, b"n+1"
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    # The compressed stream of a run of zeros repeats, so a part of it is enough to look like the whole.
    content = packer.compress(header.binaryblock + b"\0" * 4 + b"\0" * (1 << 24)) + packer.flush()
    path = tmp_path / "bomb.nii.gz"
    path.write_bytes(content + b"\0" * (2_200_000 - len(content)))
    with memory_below(5e6):
        refused(path, "asks for 1300 × 1300 × 1300 voxels (4.4 GB); Glisson reads up to 537 million voxels and 2.1 GB")


@pytest.mark.parametrize("suffix", [".nii.gz", ".nrrd"])
def test_what_follows_the_announced_voxels_is_never_unpacked(tmp_path, memory_below, suffix):
    path = tmp_path / f"a{suffix}"
    write_volume(path, Volume(VOXELS, Grid(VOXELS.shape, [1, 1, 1], [0, 0, 0])))
    content = path.read_bytes()
    start = content.index(b"\n\n") + 2 if suffix == ".nrrd" else 0
    plain = gzip.decompress(content[start:]) + b"\0" * (1 << 26)
    path.write_bytes(content[:start] + gzip.compress(plain, 1))
    with memory_below(1e7):
        assert np.array_equal(read_volume(path).voxels, VOXELS)


def text_header(**changes):
    fields = {
        "type": "short",
        "dimension": "3",
        "space": "left-posterior-superior",
        "sizes": "6 5 4",
        "space directions": "(1,0,0) (0,1,0) (0,0,1)",
        "endian": "little",
        "encoding": "raw",
        "space origin": "(0,0,0)",
    } | changes
    return "NRRD0004\n" + "".join(f"{key}: {value}\n" for key, value in fields.items() if value is not None) + "\n"


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"sizes": "2000 2000 2000"}, "asks for 2000 × 2000 × 2000 voxels (16.0 GB)"),
        ({"sizes": "6 5 40"}, "240 bytes of voxels where its header says 2400"),
        ({"sizes": "6 5 0"}, "impossible size 6 × 5 × 0"),
        ({"dimension": "4", "sizes": "6 5 2 2"}, "4 dimensions"),
        ({"type": "block"}, "not plain numbers"),
        ({"type": "quaternion"}, "not plain numbers"),
        ({"space": None}, "space is missing), so left and right are unknown"),
        ({"space": "scanner-xyz"}, "so left and right are unknown"),
        ({"space origin": None}, "so left and right are unknown"),
        ({"space directions": "(0,0,0) (0,1,0) (0,0,1)"}, "is not positive"),
        ({"space directions": "(nan,0,0) (0,1,0) (0,0,1)"}, "not three finite vectors"),
        ({"space directions": "none (0,1,0) (0,0,1)"}, "not three finite vectors"),
        ({"space units": '"inch" "inch" "inch"'}, "Glisson reads mm, cm, m and um"),
        ({"encoding": "hex"}, "encoding 'hex' is not read"),
        ({"encoding": "gzip"}, "cannot be read as an NRRD image"),
        ({"endian": "middle"}, "byte order 'middle' is unknown"),
        ({"byte skip": "-1"}, "negative byte skip"),
        ({"byte skip": "999999"}, "0 bytes of voxels"),
        ({"data file": "/etc/passwd"}, "'/etc/passwd' must be one file in the same folder"),
        ({"data file": "../secret.raw"}, "must be one file in the same folder"),
        ({"data file": "LIST"}, "must be one file in the same folder"),
        ({"data file": "slice%03d.raw 1 9 1"}, "must be one file in the same folder"),
        ({"data file": "absent.raw"}, "absent.raw does not exist"),
        ({"label_names": "{"}, "cannot be read as an NRRD image"),
        ({"encoding": None}, "cannot be read as an NRRD image"),
    ],
)
def test_nrrd_headers_that_lie(tmp_path, changes, complaint):
    path = tmp_path / "a.nrrd"
    path.write_bytes(text_header(**changes).encode() + VOXELS.tobytes(order="F"))
    if "absent" in complaint:
        with pytest.raises(BadInput, match=r"absent\.raw does not exist"):
            read_volume(path)
    else:
        refused(path, complaint)


def test_labels_that_are_none(tmp_path):
    grid = Grid((6, 5, 4), [1, 1, 1], [0, 0, 0])
    write_volume(tmp_path / "half.nii.gz", Volume(np.full((6, 5, 4), 0.5, np.float32), grid))
    refused(tmp_path / "half.nii.gz", "it holds fractions, so it is no label map", read_labels)
    write_volume(tmp_path / "minus.nii.gz", Volume(np.full((6, 5, 4), -1, np.int16), grid))
    refused(tmp_path / "minus.nii.gz", "must not be negative, but it holds -1", read_labels)


@pytest.mark.parametrize(
    "table",
    [
        '<!DOCTYPE x [<!ENTITY a "aaaa">]><CaretExtension><LabelTable><Label Key="1">&a;</Label></LabelTable>',
        "<CaretExtension><LabelTable><Label Key='one'>liver</Label></LabelTable></CaretExtension>",
        "<CaretExtension><LabelTable><Label>liver</Label></LabelTable></CaretExtension>",
        "<CaretExtension><LabelTable><Label Key='1'>liver",
    ],
)
def test_tables_of_names_that_are_damaged(tmp_path, table):
    image = nibabel.Nifti1Image(np.ones((3, 3, 3), np.uint8), np.eye(4))
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(30, table.encode()))
    image.to_filename(tmp_path / "a.nii.gz")
    refused(tmp_path / "a.nii.gz", "its table of label names", read_labels)


@pytest.mark.parametrize("name", ["a.nii", "a.nii.gz", "a.nrrd", "a.nhdr"])
@pytest.mark.parametrize("content", [b"", b"\0", b"not an image at all\n" * 40, b"\x1f\x8b\x08\x00" + b"\xff" * 99])
def test_files_of_another_kind(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, str(tmp_path / name))


def test_paths_that_are_no_images(tmp_path):
    with pytest.raises(BadInput, match=r"ct\.nii does not exist"):
        read_volume(tmp_path / "ct.nii")
    for name, complaint in (
        ("ct.tar.xz", "is an archive; unpack it first"),
        ("ct.mha", "is not an image that Glisson"),
    ):
        (tmp_path / name).write_bytes(b"x")
        refused(tmp_path / name, complaint)
    grid = Grid((6, 5, 4), [1, 1, 1], [0, 0, 0])
    with pytest.raises(BadInput, match=r"written as \.nii, \.nii\.gz or \.nrrd"):
        write_volume(tmp_path / "ct.mha2", Volume(VOXELS, grid))


@pytest.mark.parametrize("name", ["a.nii", "a.nii.gz", "a.nrrd"])
def test_truncations_and_flipped_bits(tmp_path, name):
    """Whatever happens to a file, either an image comes out or one sentence."""
    path = tmp_path / name
    grid = Grid(VOXELS.shape, [1, 1, 1], [0, 0, 0])
    write_volume(path, Volume(VOXELS, grid))
    good = path.read_bytes()
    rng = np.random.default_rng(12)
    sentences = []
    for trial in range(150):
        content = bytearray(good)
        if trial % 3 == 0:
            content = content[: int(rng.integers(len(content)))]
        else:
            reach = 352 if name == "a.nii" else len(content)
            for place in rng.integers(0, min(reach, len(content)), int(rng.integers(1, 5))):
                content[place] = (
                    int(rng.integers(256)) if trial % 3 == 1 else content[place] ^ (1 << int(rng.integers(8)))
                )
        path.write_bytes(content)
        try:
            read_volume(path)
        except BadInput as error:
            sentences.append(str(error))
    assert len(sentences) > 40
    assert not any("\n" in sentence for sentence in sentences)
