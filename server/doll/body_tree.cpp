#include "body_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <string>

#include "mass_properties.h"
#include "merge_rules.h"

namespace layfigure::doll {
namespace {

using character::Bone;
using Triangles = std::vector<Eigen::Vector3i>;

constexpr int kLeastTriangles = 4;  // of a closed solid
// The last bone of an adult's little finger has 5e-4 of the area, 4e-5 of the volume and 1.3 % of the height; whatever
// is much smaller costs time and shows nothing.
constexpr double kLeastAreaShare = 1e-4;
constexpr double kLeastMassShare = 1e-5;
constexpr double kLeastLengthShare = 5e-3;

struct SkinSize {
  double area{0.0};    ///< [m^2]
  double volume{0.0};  ///< [m^3]: mass over density
  double length{0.0};  ///< from the joint to the farthest corner [m]
};

SkinSize measure(const Triangles& skin, const Surface& surface, const Bone& bone) {
  SkinSize size;
  if (skin.empty()) return size;
  for (const Eigen::Vector3i& triangle : skin) {
    size.area += triangle_area(surface, triangle);
    for (const int corner : triangle) {
      size.length = std::max(size.length, (surface.vertices[corner] - bone.bind.translation()).norm());
    }
  }
  size.volume = mass_properties(skin, surface.vertices, bone.bind.linear()).volume;
  return size;
}

bool is_small(const SkinSize& size, const SkinSize& whole) {
  return !(size.area > 0.0) || size.area < kLeastAreaShare * whole.area ||
         size.volume < kLeastMassShare * whole.volume || size.length < kLeastLengthShare * whole.length;
}

/// The largest extent of the whole skin.
double height(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const auto& triangle : surface.triangles) {
    for (const int corner : triangle) box.extend(surface.vertices[corner]);
  }
  return box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
}

/// Decides bone by bone whose body it belongs to.
class Decision {
 public:
  Decision(const std::vector<Bone>& bones, const std::vector<BoneName>& names, const Surface& surface,
           const std::vector<int>& owners, const std::vector<MergeChoice>& choices)
      : bones_(bones),
        surface_(surface),
        choices_(choices),
        skins_(bones.size()),
        hosts_(bones.size(), -1),
        roles_(bones.size()),
        areas_(bones.size(), 0.0) {
    for (std::size_t t = 0; t < owners.size(); ++t) {
      if (owners[t] >= 0) skins_[owners[t]].push_back(surface.triangles[t]);
    }
    merge_chosen_and_named(names);
    merge_small();
  }

  [[nodiscard]] bool is_body(int b) const { return roles_[b].is_body(); }
  [[nodiscard]] const std::vector<BoneRole>& roles() const { return roles_; }

  /// The bone whose body carries each bone; -1: none.
  [[nodiscard]] std::vector<int> carriers() const;

 private:
  [[nodiscard]] int count() const { return static_cast<int>(bones_.size()); }
  [[nodiscard]] MergeChoice choice(int b) const {
    return b < static_cast<int>(choices_.size()) ? choices_[b] : MergeChoice::kAutomatic;
  }

  [[nodiscard]] int target(int b) const {
    while (hosts_[b] >= 0) b = hosts_[b];
    return b;
  }

  void merge(int b, int host, BoneReason reason) {
    hosts_[b] = host;
    roles_[b].reason = reason;
  }

  void hand_over_skin(int b) {
    Triangles& skin = skins_[target(b)];
    skin.insert(skin.end(), skins_[b].begin(), skins_[b].end());
    skins_[b].clear();
  }

  void merge_chosen_and_named(const std::vector<BoneName>& names);
  void merge_small();
  [[nodiscard]] int way_to(int host, int b) const;

  const std::vector<Bone>& bones_;
  const Surface& surface_;
  const std::vector<MergeChoice>& choices_;
  std::vector<Triangles> skins_;
  std::vector<int> hosts_;
  std::vector<BoneRole> roles_;
  std::vector<double> areas_;
};

void Decision::merge_chosen_and_named(const std::vector<BoneName>& names) {
  const auto named = merges_by_name(bones_, names);
  for (int b = 0; b < count(); ++b) {
    if (choice(b) == MergeChoice::kMerge && bones_[b].parent < 0) {
      throw UnmetChoice(b, "bone '" + bones_[b].name + "' has no parent that it could be merged with");
    }
    if (skins_[b].empty()) {
      const bool control = names[b].use == BoneUse::kControl;
      roles_[b].reason = control ? BoneReason::kControl : BoneReason::kNoSkin;
    } else if (choice(b) == MergeChoice::kMerge) {
      merge(b, bones_[b].parent, BoneReason::kMergeChosen);
    } else if (choice(b) == MergeChoice::kAutomatic && named[b]) {
      merge(b, way_to(named[b]->host, b), named[b]->reason);
    }
  }
  for (int b = 0; b < count(); ++b) {
    if (hosts_[b] >= 0) hand_over_skin(b);
  }
}

/// Children first, so that what is too small by itself makes its parent larger.
void Decision::merge_small() {
  SkinSize whole;
  for (int b = 0; b < count(); ++b) {
    const SkinSize size = measure(skins_[b], surface_, bones_[b]);
    whole.area += size.area;
    whole.volume += size.volume;
  }
  whole.length = height(surface_);
  for (int b = count() - 1; b >= 0; --b) {
    const bool chosen = choice(b) == MergeChoice::kBody;
    const bool has_solid = static_cast<int>(skins_[b].size()) >= kLeastTriangles;
    if (chosen && !has_solid) {
      throw UnmetChoice(b, "bone '" + bones_[b].name + "' cannot be a body: hardly any skin weighs upon it");
    }
    if (skins_[b].empty()) continue;
    const SkinSize size = measure(skins_[b], surface_, bones_[b]);
    if (chosen || (has_solid && !is_small(size, whole))) {
      roles_[b].reason = chosen ? BoneReason::kBodyChosen : BoneReason::kOwnSkin;
      areas_[b] = size.area;
      continue;
    }
    merge(b, bones_[b].parent, BoneReason::kTooSmall);
    if (hosts_[b] >= 0) hand_over_skin(b);
  }
}

/// The host, or the first bone with skin on the way to it: nothing but the nearest body above may carry a bone, as its
/// distance from its parent would change beside any other.
int Decision::way_to(int host, int b) const {
  do b = bones_[b].parent;
  while (b >= 0 && b != host && skins_[b].empty());
  return b;
}

std::vector<int> Decision::carriers() const {
  std::vector<int> carrier(count());
  std::vector<int> root(count());
  std::vector<int> root_carrier(count(), -1);
  for (int b = 0; b < count(); ++b) {
    const int parent = bones_[b].parent;
    root[b] = parent < 0 ? b : root[parent];
    const int inherited = parent < 0 ? -1 : carrier[parent];
    carrier[b] = is_body(b) ? b : inherited;
    int& best = root_carrier[root[b]];
    const bool topmost = is_body(b) && (parent < 0 || carrier[parent] < 0);
    if (topmost && (best < 0 || areas_[b] > areas_[best])) best = b;
  }
  for (int b = 0; b < count(); ++b) {
    if (carrier[b] < 0) carrier[b] = root_carrier[root[b]];
  }
  return carrier;
}

/// Adds the body of `bone` and all that hang on it, depth first.
void add_bodies(int root_bone, const std::vector<std::vector<int>>& children, BodyTree& tree,
                std::vector<int>& body_of_bone) {
  std::vector<std::pair<int, int>> pending{{root_bone, -1}};
  while (!pending.empty()) {
    const auto [bone, parent] = pending.back();
    pending.pop_back();
    const int body = static_cast<int>(tree.bone_of_body.size());
    body_of_bone[bone] = body;
    tree.bone_of_body.push_back(bone);
    tree.parent_of_body.push_back(parent);
    for (auto child = children[bone].rbegin(); child != children[bone].rend(); ++child) {
      pending.emplace_back(*child, body);
    }
  }
}

}  // namespace

BodyTree make_body_tree(const std::vector<Bone>& bones, const std::vector<BoneName>& names, const Surface& surface,
                        const std::vector<int>& owners, const std::vector<MergeChoice>& choices) {
  const Decision decision(bones, names, surface, owners, choices);
  const std::vector<int> carrier = decision.carriers();

  std::vector<std::vector<int>> children(bones.size());
  std::vector<int> roots;
  for (int b = 0; b < static_cast<int>(bones.size()); ++b) {
    if (!decision.is_body(b)) continue;
    int above = bones[b].parent;  // a bone above every body rides on one below it, perhaps on this one
    while (above >= 0 && carrier[above] == b) above = bones[above].parent;
    if (above < 0) {
      roots.push_back(b);
    } else {
      children[carrier[above]].push_back(b);
    }
  }
  if (roots.empty()) throw std::invalid_argument("no bone has enough skin to be a body; check the mesh's weights");

  BodyTree tree;
  tree.roles = decision.roles();
  std::vector<int> body_of_bone(bones.size(), -1);
  for (const int root : roots) add_bodies(root, children, tree, body_of_bone);
  for (const int bone : carrier) tree.carrier_of_bone.push_back(bone < 0 ? -1 : body_of_bone[bone]);
  return tree;
}

}  // namespace layfigure::doll
