"""Takes as glTF and BVH, read back by readers that share nothing with the writers."""

from pathlib import Path

import numpy as np
import pytest
from client_support import synthetic, usd_files
from client_support.bvh_reader import read_bvh
from client_support.cli import Cli, assert_one_line_error
from client_support.gltf_reader import GltfFile
from pxr import Gf, Usd, UsdSkel

from layfigure import rotation
from layfigure.errors import LayfigureError
from layfigure.export.bvh import write_bvh, zxy_angles
from layfigure.export.clip import read_clip
from layfigure.export.gltf import strongest_first, write_gltf
from layfigure.protocol import Floats
from layfigure.take import Take
from layfigure.usd.reader import BoundMesh, SkinnedStage
from layfigure.usd.writer import write_take

SKIN_TOLERANCE = 2e-6  # [m] float vertices, quaternions and matrices over a metre and a half
BVH_TOLERANCE = 2e-6  # [m] seven digits after the point, of angles in degrees too
RANDOM = np.random.default_rng(11)


@pytest.fixture
def usd(take: Take, tmp_path: Path) -> Path:
    write_take(take, tmp_path / "take.usda", 24.0)
    return tmp_path / "take.usda"


def by_usd(stage: SkinnedStage, frame: float) -> dict[str, Floats]:
    return {mesh.name: mesh.points for mesh in stage.posed(frame)}


def assert_glb_skins_as_usd(usd: Path, glb: Path) -> None:
    stage = SkinnedStage(usd, up_axis="Y")
    file = GltfFile(glb)
    times = file.times()
    np.testing.assert_allclose(times, np.arange(len(times)) / stage.fps, atol=1e-6)
    assert len(times) == stage.last_frame - stage.first_frame + 1
    for frame in range(len(times)):
        expected = by_usd(stage, stage.first_frame + frame)
        skinned = file.skinned(frame)
        assert skinned.keys() == expected.keys()
        for name, points in expected.items():
            np.testing.assert_allclose(skinned[name], points, atol=SKIN_TOLERANCE)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_gltf_of_a_take_skins_as_usd(usd: Path, tmp_path: Path, suffix: str) -> None:
    write_gltf(read_clip(usd), tmp_path / f"take{suffix}")
    assert_glb_skins_as_usd(usd, tmp_path / f"take{suffix}")


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("meters_per_unit", [0.01, 1.0])
def test_gltf_of_other_units_axes_and_joint_orders_skins_as_usd(
    tmp_path: Path, up_axis: str, meters_per_unit: float
) -> None:
    file = usd_files.write_figure(tmp_path / "f.usda", up_axis, meters_per_unit, animated=True)
    write_gltf(read_clip(file), tmp_path / "f.glb")
    assert_glb_skins_as_usd(file, tmp_path / "f.glb")
    low, high = (points(GltfFile(tmp_path / "f.glb").skinned(0)["skin"]) for points in (np.min, np.max))
    assert (low, high) == (pytest.approx(-0.1, abs=1e-6), pytest.approx(1.5, abs=1e-6))


def test_gltf_keeps_original_names_hierarchy_and_colour(usd: Path, tmp_path: Path) -> None:
    write_gltf(read_clip(usd), tmp_path / "take.glb")
    gltf = GltfFile(tmp_path / "take.glb").gltf
    joints = gltf.skins[0].joints
    assert [gltf.nodes[joint].name for joint in joints] == synthetic.NAMES
    assert [gltf.nodes[joint].children for joint in joints] == [[1], [2, 3], [], []]
    color = gltf.materials[0].pbrMetallicRoughness.baseColorFactor
    np.testing.assert_allclose(color, [0.8, 0.5, 0.3, 1.0], atol=1e-6)


def test_gltf_several_skeletons_have_skins_of_their_own(tmp_path: Path) -> None:
    file = usd_files.write_figure(tmp_path / "f.usda", skeletons=3)
    write_gltf(read_clip(file), tmp_path / "f.glb")
    assert len(GltfFile(tmp_path / "f.glb").gltf.skins) == 3
    assert len(GltfFile(tmp_path / "f.glb").gltf.scenes[0].nodes) == 6


def bound(indices: list[list[int]], weights: list[list[float]]) -> BoundMesh:
    count = len(indices)
    return BoundMesh(
        "m", "/s", np.zeros((count, 3)), np.zeros((0, 3), np.int32), np.zeros((0, 3)), np.array(indices),
        np.array(weights), False,
    )  # fmt: skip


def test_strongest_first_orders_normalises_and_adds_repeated_joints() -> None:
    joints, weights = strongest_first(bound([[3, 1, 3], [2, 0, 1]], [[0.2, 0.3, 0.3], [0.0, 2.0, 0.0]]))
    assert joints.tolist() == [[3, 1, 0, 0], [0, 0, 0, 0]]
    np.testing.assert_allclose(weights, [[0.625, 0.375, 0, 0], [1, 0, 0, 0]])


def test_strongest_first_more_than_four_go_to_a_second_set() -> None:
    joints, weights = strongest_first(bound([[0, 1, 2, 3, 4, 5]], [[0.05, 0.3, 0.1, 0.2, 0.25, 0.1]]))
    assert joints.tolist() == [[1, 4, 3, 2, 5, 0, 0, 0]]
    np.testing.assert_allclose(weights, [[0.3, 0.25, 0.2, 0.1, 0.1, 0.05, 0, 0]])


def assert_bvh_joints_are_where_usd_has_them(usd: Path, bvh_path: Path) -> None:
    bvh = read_bvh(bvh_path)
    stage = SkinnedStage(usd, up_axis="Y")
    (skeleton,) = stage.skeletons()
    assert bvh.frame_time == pytest.approx(1.0 / stage.fps)
    assert len(bvh.motion) == stage.last_frame - stage.first_frame + 1
    names = skeleton.original_names()
    for frame in range(len(bvh.motion)):
        expected = skeleton.world(np.array([stage.first_frame + frame]))[0]
        for joint, world in zip(bvh.joints, bvh.frames_of(frame), strict=True):
            if not joint.is_end:
                position = expected[names.index(joint.name), :3, 3]
                np.testing.assert_allclose(world[:3, 3], position, atol=BVH_TOLERANCE)


def test_bvh_of_a_take_has_its_joints_where_usd_has_them(usd: Path, tmp_path: Path) -> None:
    write_bvh(read_clip(usd), tmp_path / "take.bvh")
    assert_bvh_joints_are_where_usd_has_them(usd, tmp_path / "take.bvh")


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("meters_per_unit", [0.01, 1.0])
def test_bvh_of_other_units_and_axes_has_its_joints_where_usd_has_them(
    tmp_path: Path, up_axis: str, meters_per_unit: float
) -> None:
    file = usd_files.write_figure(tmp_path / "f.usda", up_axis, meters_per_unit)
    write_bvh(read_clip(file), tmp_path / "f.bvh")
    assert_bvh_joints_are_where_usd_has_them(file, tmp_path / "f.bvh")


def test_bvh_rotations_turn_the_rest_pose_into_the_take(usd: Path, tmp_path: Path) -> None:
    """Also of the last joints, whose rotations move no other joint: B_j R_j = W_j."""
    write_bvh(read_clip(usd), tmp_path / "take.bvh")
    bvh = read_bvh(tmp_path / "take.bvh")
    stage = SkinnedStage(usd, up_axis="Y")
    (skeleton,) = stage.skeletons()
    rest, posed = skeleton.rest(0.0), skeleton.world(np.array([17.0]))[0]
    names = skeleton.original_names()
    for joint, world in zip(bvh.joints, bvh.frames_of(17), strict=True):
        if not joint.is_end:
            index = names.index(joint.name)
            np.testing.assert_allclose(world[:3, :3] @ rest[index, :3, :3], posed[index, :3, :3], atol=1e-6)


def test_bvh_channels_are_in_the_usual_order_and_angles_do_not_jump(usd: Path, tmp_path: Path) -> None:
    write_bvh(read_clip(usd), tmp_path / "take.bvh")
    bvh = read_bvh(tmp_path / "take.bvh")
    rotations = ["Zrotation", "Xrotation", "Yrotation"]
    assert bvh.joints[0].channels == ["Xposition", "Yposition", "Zposition", *rotations]
    assert all(joint.channels == ([] if joint.is_end else rotations) for joint in bvh.joints[1:])
    assert np.abs(np.diff(bvh.motion[:, 3:], axis=0)).max() < 180.0


def test_zxy_angles_give_the_rotation_back_also_in_gimbal_lock() -> None:
    angles = RANDOM.uniform(-np.pi, np.pi, (500, 3))
    angles[:20, 1] = np.where(np.arange(20) % 2, np.pi / 2, -np.pi / 2)

    def compose(values: Floats) -> Floats:
        z, x, y = (
            [synthetic.quaternion(axis, angle) for angle in values[:, k]]
            for k, axis in enumerate([(0, 0, 1), (1, 0, 0), (0, 1, 0)])
        )
        quaternions = [synthetic.multiply(synthetic.multiply(a, b), c) for a, b, c in zip(z, x, y, strict=True)]
        return np.array([synthetic.matrix(q, np.zeros(3))[:3, :3] for q in quaternions])

    matrices = compose(angles)
    np.testing.assert_allclose(compose(zxy_angles(matrices)), matrices, atol=1e-7)


def test_from_matrix_gives_the_quaternion_back_also_of_half_turns() -> None:
    quaternions = RANDOM.normal(size=(300, 4))
    quaternions[:4] = np.eye(4)
    quaternions[4:100, 0] = 0.0
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    matrices = np.array([synthetic.matrix(q, np.zeros(3))[:3, :3] for q in quaternions])
    back = rotation.from_matrix(matrices)
    np.testing.assert_allclose(np.abs(np.sum(back * quaternions, axis=1)), 1.0, atol=1e-14)


def motion(stage: Usd.Stage) -> UsdSkel.Animation:
    return UsdSkel.Animation(stage.GetPrimAtPath("/World/figure0/rig/motion"))


def test_convert_scaled_joint_is_refused(tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "f.usda"))
    motion(stage).GetScalesAttr().Set([Gf.Vec3h(2, 1, 1), Gf.Vec3h(1, 1, 1), Gf.Vec3h(1, 1, 1)])
    stage.GetRootLayer().Save()
    with pytest.raises(LayfigureError, match="joint 'root/upper/lower' is scaled in frame 1"):
        read_clip(tmp_path / "f.usda")


def test_bvh_bone_that_stretches_is_refused_and_gltf_holds_it(tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "f.usda"))
    for frame, length in ((1, 50.0), (13, 60.0)):
        motion(stage).GetTranslationsAttr().Set([Gf.Vec3f(0, length, 0), Gf.Vec3f(0), Gf.Vec3f(0, 50, 0)], frame)
    stage.GetRootLayer().Save()
    with pytest.raises(LayfigureError, match="bone 'lower' changes its length"):
        write_bvh(read_clip(tmp_path / "f.usda"), tmp_path / "f.bvh")
    assert not (tmp_path / "f.bvh").exists()
    write_gltf(read_clip(tmp_path / "f.usda"), tmp_path / "f.glb")
    assert_glb_skins_as_usd(tmp_path / "f.usda", tmp_path / "f.glb")


def test_bvh_several_skeletons_are_refused(tmp_path: Path) -> None:
    clip = read_clip(usd_files.write_figure(tmp_path / "f.usda", skeletons=2))
    with pytest.raises(LayfigureError, match="BVH holds one skeleton, the file has 2: convert it to glTF"):
        write_bvh(clip, tmp_path / "f.bvh")


def test_convert_same_take_gives_equal_bytes(usd: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_gltf(read_clip(usd), tmp_path / f"{name}.glb")
        write_bvh(read_clip(usd), tmp_path / f"{name}.bvh")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    assert (tmp_path / "a.bvh").read_bytes() == (tmp_path / "b.bvh").read_bytes()


def test_cli_convert_writes_and_refuses_in_one_line(cli: Cli, usd: Path, tmp_path: Path) -> None:
    result = cli("convert", usd.name, "take.glb")
    assert (result.returncode, result.stdout, result.stderr) == (0, "take.glb: 25 frames at 24 fps, 4 joints\n", "")
    usd_files.write_prop(tmp_path / "prop.usda")
    assert_one_line_error(cli("convert", "prop.usda", "p.glb"), 1, "'prop.usda' holds no skeleton")
    assert_one_line_error(cli("convert", "none.usda", "p.glb"), 1, "none.usda")
    assert_one_line_error(cli("convert", usd.name, "p.fbx"), 2, "p.fbx")
    assert_one_line_error(cli("convert", usd.name, "none/p.glb"), 2, "none")


def test_convert_blend_shapes_are_left_out_with_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    read_clip(usd_files.write_figure(tmp_path / "f.usda", blend_shape=True))
    assert caplog.messages == ["the blend shapes of mesh 'skin' are left out"]
