#include "layfigure/doll/build.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "body_tree.h"
#include "calibration.h"
#include "contact_shape.h"
#include "joint_limits.h"
#include "mass_properties.h"
#include "mirror.h"
#include "overrides.h"
#include "section.h"
#include "surface.h"

namespace layfigure::doll {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Shortest distance of two bodies' coms that counts, as a share of the section's size: a joint cannot be stiffer than
/// a stub of that length.
constexpr double kLeastSpanShare = 0.1;

/// A com nearer to the joint than this share of the body's size gives no direction but that of rounding.
constexpr double kLeastLever = 1e-3;

/// The cut is this share of the body's size beyond the joint: vertices at the joint, as a limb's first ring often is,
/// are then on its one side, whatever their last digits in single precision.
constexpr double kInset = 1e-4;

/// A cut is scraps of the limb below, or takes in the trunk above, these multiples of the body's volume over its
/// length.
constexpr double kLeastAreaShare = 0.25;
constexpr double kMostAreaShare = 2.5;

std::vector<Isometry3d> rest_poses(const std::vector<character::Bone>& bones) {
  std::vector<Isometry3d> poses;
  for (const auto& bone : bones) poses.push_back(bone.parent < 0 ? bone.rest : poses[bone.parent] * bone.rest);
  return poses;
}

void add_bones(const BodyTree& tree, const std::vector<Isometry3d>& X_WA, Doll& doll) {
  doll.bone_of_body = tree.bone_of_body;
  doll.bone_roles = tree.roles;
  doll.body_of_bone.assign(doll.rig.bones.size(), -1);
  for (std::size_t b = 0; b < tree.bone_of_body.size(); ++b) {
    doll.body_of_bone[tree.bone_of_body[b]] = static_cast<int>(b);
  }
  for (std::size_t bone = 0; bone < doll.rig.bones.size(); ++bone) {
    const int body = tree.carrier_of_bone[bone];
    const Isometry3d X_BA = body < 0 ? X_WA[bone] : X_WA[tree.bone_of_body[body]].inverse() * X_WA[bone];
    doll.carriers.push_back({body, X_BA});
    doll.body_reasons.push_back({Origin::kDefault, std::string(reason_text(tree.roles[bone].reason))});
  }
}

void add_body(const BodyTree& tree, int b, const std::vector<Isometry3d>& X_WA, const MassProperties& solid,
              double density, Doll& doll) {
  const character::Bone& bone = doll.rig.bones[tree.bone_of_body[b]];
  const int parent = tree.parent_of_body[b];
  const Isometry3d& X_WB = X_WA[tree.bone_of_body[b]];
  const Isometry3d X_PB = parent < 0 ? X_WB : X_WA[tree.bone_of_body[parent]].inverse() * X_WB;
  const Matrix3d R_BW = bone.bind.linear().transpose();
  dynamics::BodyDefinition body;
  body.name = bone.name;
  body.parent = parent;
  body.anchor = X_PB.translation();
  body.rotation = body.rest_rotation = Quaterniond(X_PB.linear()).normalized();
  body.mass = density * solid.volume;
  body.com = R_BW * (solid.com - bone.bind.translation());
  body.inertia = density * R_BW * solid.inertia * R_BW.transpose();
  body.inertia = 0.5 * (body.inertia + body.inertia.transpose()).eval();
  doll.definition.bodies.push_back(body);
}

using Part = std::vector<Eigen::Vector3i>;

/// The skin of each body. By the owners that made the body tree: each has some.
std::vector<Part> skin_parts(const Surface& surface, const std::vector<int>& owner_bones, const BodyTree& tree) {
  std::vector<Part> parts(tree.bone_of_body.size());
  for (std::size_t t = 0; t < owner_bones.size(); ++t) {
    const int body = owner_bones[t] < 0 ? -1 : tree.carrier_of_bone[owner_bones[t]];
    if (body >= 0) parts[body].push_back(surface.triangles[t]);
  }
  return parts;
}

/// What the skin of each body encloses, in the world.
std::vector<MassProperties> make_solids(const Surface& surface, const std::vector<Part>& parts, const BodyTree& tree,
                                        Doll& doll) {
  std::vector<MassProperties> solids;
  for (std::size_t b = 0; b < parts.size(); ++b) {
    const character::Bone& bone = doll.rig.bones[tree.bone_of_body[b]];
    solids.push_back(mass_properties(parts[b], surface.vertices, bone.bind.linear()));
    if (solids.back().estimated) {
      doll.warnings.push_back("bone '" + bone.name +
                              "': its skin encloses hardly anything; mass and inertia are those of " +
                              "the capsule in its bounding box");
    }
  }
  return solids;
}

std::vector<double> volumes_of(const std::vector<MassProperties>& solids) {
  std::vector<double> volumes;
  for (const MassProperties& solid : solids) volumes.push_back(solid.volume);
  return volumes;
}

/// From the joint to the com: the direction that the section is across. If they coincide, along the bone.
Vector3d limb_direction(const Isometry3d& bind, const MassProperties& solid) {
  const Vector3d along = solid.com - bind.translation();
  return along.norm() > kLeastLever * std::cbrt(solid.volume) ? along.normalized() : Vector3d(bind.linear().col(1));
}

/// The area of the circle whose cylinder, as long as the joint is far from the com twice over, has the body's volume.
double expected_area(double volume, double half_length) {
  return volume / std::max(2.0 * half_length, std::cbrt(volume));
}

/// The cut through the joint, a root's through its com: of the skin that the body weighs upon or, where that leaves
/// only scraps (a ball joint whose ball is the parent's, webs between fingers), of the parent's too, unless it cuts the
/// trunk.
std::optional<PlaneFigure> measured_section(const Surface& surface, Cut cut, int parent, double expected_area) {
  const std::optional<PlaneFigure> own = cut_surface(surface, cut);
  if (own && own->area > kLeastAreaShare * expected_area) return own;
  if (parent < 0) return std::nullopt;
  cut.other = parent;
  const std::optional<PlaneFigure> both = cut_surface(surface, cut);
  const bool plausible =
      both && both->area > kLeastAreaShare * expected_area && both->area < kMostAreaShare * expected_area;
  return plausible ? both : std::nullopt;
}

Section make_section(const Surface& surface, const BodyTree& tree, int b, const std::vector<MassProperties>& solids,
                     const Isometry3d& bind) {
  const int parent = tree.parent_of_body[b];
  const Vector3d& com = solids[b].com;
  const Vector3d joint = bind.translation();
  const Vector3d normal = limb_direction(bind, solids[b]);
  const Vector3d beyond_joint = joint + kInset * std::cbrt(solids[b].volume) * normal;
  const Cut cut{parent < 0 ? com : beyond_joint, cut_axes(normal, bind.linear()), b};
  const Isometry3d X_BC = bind.inverse() * Eigen::Translation3d(cut.point) * Isometry3d(cut.axes);
  const double expected = expected_area(solids[b].volume, (com - joint).norm());
  const auto figure = measured_section(surface, cut, parent, expected);
  Section section = figure ? principal_section(*figure, X_BC) : round_section(expected, X_BC.linear());
  if (parent >= 0) section.span = std::max((com - solids[parent].com).norm(), kLeastSpanShare * section.outermost.x());
  return section;
}

/// Corners of a body's skin, in its frame.
std::vector<Vector3d> corners(const Surface& surface, const Part& part, const Isometry3d& bind) {
  std::vector<int> indices;
  for (const Eigen::Vector3i& triangle : part) indices.insert(indices.end(), triangle.begin(), triangle.end());
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  std::vector<Vector3d> points;
  for (const int index : indices) points.emplace_back(bind.inverse() * surface.vertices[index]);
  return points;
}

void add_shapes(const Surface& surface, const std::vector<Part>& parts, const BodyTree& tree, Doll& doll) {
  for (std::size_t b = 0; b < parts.size(); ++b) {
    const Matter& matter = doll.matter[b];
    if (matter.shape == ShapeKind::kNone) continue;
    const dynamics::BodyDefinition& body = doll.definition.bodies[b];
    const std::vector<Vector3d> points = corners(surface, parts[b], doll.rig.bones[tree.bone_of_body[b]].bind);
    const bool is_capsule = matter.shape == ShapeKind::kCapsule;
    collision::ShapeDefinition shape = is_capsule ? make_capsule(points, body) : make_hull(points);
    shape.name = body.name;
    shape.body = static_cast<int>(b);
    shape.friction = matter.friction;
    doll.shapes.push_back(std::move(shape));
  }
  doll.never_touch = overlapping_at_rest(doll.definition, doll.shapes);
}

std::vector<BoneName> names_of(const std::vector<character::Bone>& bones) {
  std::vector<std::string> names;
  for (const character::Bone& bone : bones) names.push_back(bone.name);
  return read_bone_names(names);
}

BodyTree chosen_body_tree(const Doll& doll, const std::vector<BoneName>& names, const Surface& surface,
                          const std::vector<int>& owner_bones, const std::vector<JointOverride>& overrides) {
  try {
    return make_body_tree(doll.rig.bones, names, surface, owner_bones, merge_choices(overrides));
  } catch (const UnmetChoice& error) {
    refuse_merge(overrides[error.bone()], doll.settings, error.what());
  }
}

/// The limits that the file states for the joint of body `b`, beside the body that its parent bone rides on.
std::optional<character::BoneLimits> stated_limits_of(const Doll& doll, int b) {
  const character::Bone& bone = doll.rig.bones[doll.bone_of_body[b]];
  const int parent = doll.definition.bodies[b].parent;
  if (!bone.limits || parent < 0) return std::nullopt;
  character::BoneLimits limits = *bone.limits;
  const Quaterniond R_BP(doll.carriers[bone.parent].pose.linear());  // of the parent bone in the parent body
  limits.reference = (R_BP * limits.reference).normalized();
  return limits;
}

void add_limits(const std::vector<BoneName>& names, const std::vector<MassProperties>& solids, Doll& doll) {
  BodyLayout layout;
  for (std::size_t b = 0; b < solids.size(); ++b) {
    const character::Bone& bone = doll.rig.bones[doll.bone_of_body[b]];
    const dynamics::BodyDefinition& body = doll.definition.bodies[b];
    layout.push_back({bone.name, names[doll.bone_of_body[b]], body.parent, bone.bind.translation(), solids[b].com,
                      Quaterniond(bone.bind.linear()).normalized(), body.rest_rotation,
                      stated_limits_of(doll, static_cast<int>(b))});
  }
  const Mirror mirror = find_mirror(layout, doll.warnings);
  doll.mirror_of_body = mirror.mirror_of_body;
  doll.mirror_normal = mirror.normal;
  doll.mirror_offset = mirror.offset;
  const std::vector<dynamics::JointLimits> limits = make_joint_limits(layout, mirror, doll.warnings);
  const std::vector<Reason> why = limit_reasons(layout, mirror);
  for (std::size_t b = 0; b < limits.size(); ++b) {
    doll.definition.bodies[b].limits = limits[b];
    if (layout[b].parent < 0) continue;
    Reasons& reasons = doll.reasons[b];
    reasons.twist = reasons.swing_y = reasons.swing_z = why[b];
  }
}

std::vector<JointChoice> joint_choices(const dynamics::ModelDefinition& definition) {
  std::vector<JointChoice> choices;
  for (const dynamics::BodyDefinition& body : definition.bodies) choices.push_back({body.joint, body.limits});
  return choices;
}

}  // namespace

Doll build_doll(character::Rig rig, const DollSettings& settings) {
  validate(settings);
  Doll doll;
  doll.rig = std::move(rig);
  doll.settings = settings;
  doll.definition.root = dynamics::RootKind::kFree;
  const std::vector<JointOverride> overrides = resolve_overrides(settings, doll.rig.bones);
  Surface surface = make_surface(doll.rig);
  const std::vector<int> owner_bones = triangle_owners(surface);
  const std::vector<BoneName> names = names_of(doll.rig.bones);
  const BodyTree tree = chosen_body_tree(doll, names, surface, owner_bones, overrides);
  rename_owners(surface, tree.carrier_of_bone);

  const std::vector<Isometry3d> X_WA = rest_poses(doll.rig.bones);
  add_bones(tree, X_WA, doll);
  const std::vector<Part> parts = skin_parts(surface, owner_bones, tree);
  const std::vector<MassProperties> solids = make_solids(surface, parts, tree, doll);
  choose_densities(overrides, volumes_of(solids), doll);
  for (int b = 0; b < static_cast<int>(solids.size()); ++b) {
    add_body(tree, b, X_WA, solids[b], doll.matter[b].density, doll);
    const Isometry3d& bind = doll.rig.bones[tree.bone_of_body[b]].bind;
    doll.sections.push_back(make_section(surface, tree, b, solids, bind));
    if (doll.sections.back().estimated) {
      doll.warnings.push_back("bone '" + doll.definition.bodies[b].name +
                              "': no section found at its joint; estimated from its volume and length");
    }
  }
  add_limits(names, solids, doll);
  calibrate(doll, settings);
  doll.chosen_joints = joint_choices(doll.definition);
  apply_overrides(overrides, doll);
  report_raised(doll);
  add_shapes(surface, parts, tree, doll);
  return doll;
}

}  // namespace layfigure::doll
