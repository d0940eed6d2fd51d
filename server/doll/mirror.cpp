#include "mirror.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <utility>

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;
using Pair = std::pair<int, int>;

constexpr double kTolerance = 0.03;           // of the extent: sculpted characters are not quite symmetric
constexpr double kLeastMirroredShare = 0.5;   // of the bodies, for a plane that no name speaks for
constexpr double kLeastDistanceShare = 1e-6;  // of the extent: a pair's bodies are apart

double extent(const BodyLayout& layout) {
  Eigen::AlignedBox3d box;
  for (const BodyPlace& body : layout) box.extend(body.joint).extend(body.com);
  return box.isEmpty() ? 0.0 : box.diagonal().norm();
}

/// Left and right of names that are the same but for the side, where one body each has them.
std::vector<Pair> named_pairs(const BodyLayout& layout) {
  std::map<std::string, std::array<std::vector<int>, 2>> sides;
  for (int b = 0; b < static_cast<int>(layout.size()); ++b) {
    const BoneName& name = layout[b].name;
    if (name.side != BodySide::kNone) sides[name.stem][name.side == BodySide::kLeft ? 0 : 1].push_back(b);
  }
  std::vector<Pair> pairs;
  for (const auto& [stem, bodies] : sides) {
    if (bodies[0].size() == 1 && bodies[1].size() == 1) pairs.emplace_back(bodies[0][0], bodies[1][0]);
  }
  return pairs;
}

/// The plane between the pairs, those far apart counting more. False if they cancel out.
bool plane_between(const BodyLayout& layout, const std::vector<Pair>& pairs, Mirror& mirror) {
  Vector3d sum = Vector3d::Zero();
  for (const auto& [a, b] : pairs) sum += layout[a].joint - layout[b].joint + layout[a].com - layout[b].com;
  if (!(sum.norm() > kLeastDistanceShare * extent(layout))) return false;
  mirror.normal = sum.normalized();
  double weight = 0.0;
  mirror.offset = 0.0;
  for (const auto& [a, b] : pairs) {
    const double distance = (layout[a].com - layout[b].com).norm();
    weight += distance;
    mirror.offset += 0.5 * distance * mirror.normal.dot(layout[a].com + layout[b].com);
  }
  if (!(weight > 0.0)) return false;
  mirror.offset /= weight;
  return true;
}

bool names_agree(const BoneName& a, const BoneName& b, bool same_body) {
  if (same_body) return a.side == BodySide::kNone;
  return (a.side == BodySide::kNone) == (b.side == BodySide::kNone) &&
         (a.side == BodySide::kNone || (a.side != b.side && a.stem == b.stem));
}

/// How far `b` is from where the plane puts `a`.
double misfit(const Mirror& mirror, const BodyPlace& a, const BodyPlace& b) {
  return std::max((mirror.reflected(a.joint) - b.joint).norm(), (mirror.reflected(a.com) - b.com).norm());
}

void pair_up(const BodyLayout& layout, Mirror& mirror) {
  const int count = static_cast<int>(layout.size());
  const double tolerance = kTolerance * extent(layout);
  mirror.mirror_of_body.assign(count, -1);
  for (int a = 0; a < count; ++a) {
    if (mirror.mirror_of_body[a] >= 0) continue;
    const int above = layout[a].parent < 0 ? -1 : mirror.mirror_of_body[layout[a].parent];
    if (layout[a].parent >= 0 && above < 0) continue;
    int best = -1;
    double least = tolerance;
    for (int b = a; b < count; ++b) {
      if (layout[b].parent != above || mirror.mirror_of_body[b] >= 0) continue;
      if (!names_agree(layout[a].name, layout[b].name, a == b)) continue;
      const double distance = misfit(mirror, layout[a], layout[b]);
      if (distance > least) continue;
      least = distance;
      best = b;
    }
    if (best < 0) continue;
    mirror.mirror_of_body[a] = best;
    mirror.mirror_of_body[best] = a;
  }
}

int mirrored_bodies(const Mirror& mirror) {
  return static_cast<int>(mirror.mirror_of_body.size()) -
         static_cast<int>(std::count(mirror.mirror_of_body.begin(), mirror.mirror_of_body.end(), -1));
}

bool has_pair(const Mirror& mirror) {
  for (int b = 0; b < static_cast<int>(mirror.mirror_of_body.size()); ++b) {
    if (mirror.mirror_of_body[b] >= 0 && mirror.mirror_of_body[b] != b) return true;
  }
  return false;
}

std::vector<Pair> confirmed(const std::vector<Pair>& pairs, const Mirror& mirror) {
  std::vector<Pair> result;
  std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(result),
               [&](const Pair& pair) { return mirror.mirror_of_body[pair.first] == pair.second; });
  return result;
}

/// Once more between the pairs that the first plane confirmed: one sword less on the left does not tilt it.
Mirror mirror_by_names(const BodyLayout& layout, const std::vector<Pair>& pairs) {
  Mirror mirror;
  if (!plane_between(layout, pairs, mirror)) return mirror;
  pair_up(layout, mirror);
  if (plane_between(layout, confirmed(pairs, mirror), mirror)) pair_up(layout, mirror);
  mirror.found = has_pair(mirror);
  return mirror;
}

Mirror mirror_by_places(const BodyLayout& layout) {
  Mirror best;
  int most = static_cast<int>(kLeastMirroredShare * static_cast<double>(layout.size()));
  for (int a = 0; a < static_cast<int>(layout.size()); ++a) {
    for (int b = a + 1; b < static_cast<int>(layout.size()); ++b) {
      if (layout[a].parent != layout[b].parent) continue;
      Mirror mirror;
      if (!plane_between(layout, {{a, b}}, mirror)) continue;
      pair_up(layout, mirror);
      if (!has_pair(mirror) || mirrored_bodies(mirror) <= most) continue;
      most = mirrored_bodies(mirror);
      mirror.found = true;
      best = mirror;
    }
  }
  return best;
}

void report(const BodyLayout& layout, const std::vector<Pair>& pairs, const Mirror& mirror,
            std::vector<std::string>& warnings) {
  const std::size_t refused = pairs.size() - (mirror.found ? confirmed(pairs, mirror).size() : 0);
  if (refused == 0) return;
  const auto first = std::find_if(pairs.begin(), pairs.end(), [&](const Pair& pair) {
    return !mirror.found || mirror.mirror_of_body[pair.first] != pair.second;
  });
  warnings.push_back(std::to_string(refused) + " pairs of bones that are called left and right do not mirror each " +
                     "other in the bind pose, the first '" + layout[first->first].bone +
                     "'; they are not treated as pairs");
}

}  // namespace

Vector3d Mirror::reflected(const Vector3d& point) const { return point - 2.0 * (normal.dot(point) - offset) * normal; }

Eigen::Matrix3d Mirror::reflection() const { return Eigen::Matrix3d::Identity() - 2.0 * normal * normal.transpose(); }

Mirror find_mirror(const BodyLayout& layout, std::vector<std::string>& warnings) {
  const std::vector<Pair> pairs = named_pairs(layout);
  Mirror mirror = mirror_by_names(layout, pairs);
  if (!mirror.found) mirror = mirror_by_places(layout);
  if (!mirror.found) mirror.mirror_of_body.assign(layout.size(), -1);
  report(layout, pairs, mirror, warnings);
  return mirror;
}

}  // namespace layfigure::doll
