#include "narrow_phase.h"

#include <algorithm>
#include <cmath>

#include "clip.h"
#include "reduce.h"
#include "segments.h"
#include "separation.h"

namespace layfigure::collision {
namespace {

using Cores = std::array<PlacedCore, 2>;
using Eigen::Vector3d;

// A point this little outside the prism over a face, relative to the size, counts as inside where it proves a distance:
// it is wrong by less than that, and boxes stacked flush stay proved.
constexpr double kInside = 1e-6;

// Overlaps beyond this, relative to the size, are proved by no face: an edge may part the cores better.
constexpr double kShallow = 1e-2;

// Edges whose directions differ by less than this [rad] touch along a line, not at a point.
constexpr double kAlongside = 0.02;

enum class FeatureKind : std::uint64_t { kFace, kEdges, kPlane };

std::uint64_t feature_of(FeatureKind kind, std::uint64_t rest) { return static_cast<std::uint64_t>(kind) << 62 | rest; }

std::uint64_t face_feature(const FaceRef& face, const Corner& corner) {
  const auto bits = [](int value, int shift) { return static_cast<std::uint64_t>(value) << shift; };
  return feature_of(FeatureKind::kFace, bits(face.side, 60) | bits(face.face, 40) | bits(face.facing + 1, 20) |
                                            bits(corner.before, 10) | bits(corner.after, 0));
}

/// A point of the manifold from one of each core; the radii are added along the normal.
LocalPoint rounded(const Cores& cores, const Vector3d& core_a, const Vector3d& core_b, const Vector3d& normal,
                   std::uint64_t feature) {
  const double radius_a = cores[0].core->radius, radius_b = cores[1].core->radius;
  const double gap = normal.dot(core_a - core_b) - radius_a - radius_b;
  return {core_a - radius_a * normal, core_b + radius_b * normal, normal, gap, feature};
}

/// The face of the other core that lies against `face`: of those about the deepest vertex, the one that looks at it
/// most; the last one while it is about as good.
int facing_face(const Cores& cores, const FaceSeparation& found, const FaceRef& last) {
  const Vector3d n = cores[found.face.side].normal(found.face.face);
  const PlacedCore& other = cores[1 - found.face.side];
  const bool same = last.side == found.face.side && last.face == found.face.face;
  int best = -1;
  double least = 1.0;
  for (const int face : other.core->vertex_faces[found.support]) {
    const double cosine = n.dot(other.normal(face)) - (same && face == last.facing ? kPointHysteresis : 0.0);
    if (cosine < least) {
      least = cosine;
      best = face;
    }
  }
  return best;
}

/// The least heights of points over a face.
struct FaceHeights {
  double all{std::numeric_limits<double>::infinity()};
  double inside{all};  ///< of those as far inside the prism over the face as they are deep, and not very deep
};

/// Fills scratch.points with the face's contact points within the activity distance.
FaceHeights find_face_points(const FaceRef& face, double activity, NarrowScratch& scratch) {
  const double size = smaller_size(scratch.cores), deepest = -kShallow * size;
  clip_facing(face, kPointHysteresis * size, scratch);
  const PlacedCore& own = scratch.cores[face.side];
  const Vector3d outward = own.normal(face.face);
  const double offset = own.core->faces[face.face].offset + outward.dot(own.p);
  const bool on_a = face.side == 0;
  const Vector3d normal = on_a ? Vector3d(-outward) : outward;
  FaceHeights least;
  scratch.points.clear();
  for (const Corner& corner : scratch.polygon) {
    const double height = outward.dot(corner.p) - offset;
    const Vector3d below = corner.p - height * outward;
    const LocalPoint point =
        rounded(scratch.cores, on_a ? below : corner.p, on_a ? corner.p : below, normal, face_feature(face, corner));
    least.all = std::min(least.all, height);
    const bool inside = height > deepest && corner.outside <= std::min(0.0, height) + kInside * size;
    if (inside) least.inside = std::min(least.inside, height);
    if (point.gap <= activity) scratch.points.push_back(point);
  }
  return least;
}

/// Of the normal that the face gives the contact: from b to a.
Vector3d normal_of(const Cores& cores, const FaceRef& face) {
  return (face.side == 0 ? -1.0 : 1.0) * cores[face.side].normal(face.face);
}

/// What a face makes of a contact.
struct FaceContact {
  FaceSeparation found;  ///< side -1: there is no face
  Vector3d normal{Vector3d::Zero()};
  FaceHeights least;

  /// No normal parts the cores by more than the distance of two of their points: then the face is the answer.
  [[nodiscard]] bool is_proved(double hysteresis) const { return least.inside <= found.separation + hysteresis; }
};

/// Fills scratch.points with it.
FaceContact contact_on(const FaceSeparation& found, const FaceRef& last, double activity, NarrowScratch& scratch) {
  FaceContact contact{.found = found, .normal = normal_of(scratch.cores, found.face), .least = {}};
  contact.found.face.facing = facing_face(scratch.cores, found, last);
  contact.least = find_face_points(contact.found.face, activity, scratch);
  return contact;
}

/// Adds the other core's deepest vertex, which lies outside the prism over the face.
void add_support(const FaceSeparation& found, const Vector3d& normal, double activity, NarrowScratch& scratch) {
  const Vector3d deepest = scratch.cores[1 - found.face.side].vertices[found.support];
  const bool on_a = found.face.side == 0;
  const Vector3d below = deepest + (on_a ? found.separation : -found.separation) * normal;
  const Corner corner{deepest, found.support, found.support, 0.0};
  const LocalPoint point =
      rounded(scratch.cores, on_a ? below : deepest, on_a ? deepest : below, normal, face_feature(found.face, corner));
  if (point.gap <= activity) scratch.points.push_back(point);
}

std::uint64_t edges_feature(const EdgeSeparation& found, std::array<double, 2> fractions, int index) {
  std::uint64_t bits = static_cast<std::uint64_t>(index) << 40;
  for (const int side : {0, 1}) {
    // At an end the vertex alone names the point: several edges share it.
    auto [first, second] = found.edges[side];
    if (fractions[side] <= 0.0) second = first;
    if (fractions[side] >= 1.0) first = second;
    bits |= static_cast<std::uint64_t>(first << 8 | second) << (16 * side);
  }
  return feature_of(FeatureKind::kEdges, bits);
}

/// The part of a that lies alongside b, as fractions of a; a start above the end if none does.
std::pair<double, double> alongside(const Segment& a, const Segment& b) {
  const Vector3d u = a.end - a.start, v = b.end - b.start;
  const double uu = u.squaredNorm();
  if (u.cross(v).norm() > kAlongside * std::sqrt(uu * v.squaredNorm()) || uu == 0.0 || v.isZero()) return {1.0, 0.0};
  const double s = u.dot(b.start - a.start) / uu, t = u.dot(b.end - a.start) / uu;
  return {std::max(0.0, std::min(s, t)), std::min(1.0, std::max(s, t))};
}

void find_edge_points(const EdgeSeparation& found, double activity, NarrowScratch& scratch) {
  const Cores& cores = scratch.cores;
  const auto segment = [&](int side) {
    const auto [first, second] = found.edges[side];
    return Segment{cores[side].vertices[first], cores[side].vertices[second]};
  };
  const Segment a = segment(0), b = segment(1);
  const auto add = [&](const Vector3d& on_a, const Vector3d& on_b, const Vector3d& normal, std::uint64_t feature) {
    const LocalPoint point = rounded(cores, on_a, on_b, normal, feature);
    if (point.gap <= activity) scratch.points.push_back(point);
  };
  scratch.points.clear();
  const auto [low, high] = alongside(a, b);
  if ((high - low) * (a.end - a.start).norm() > kPointHysteresis * smaller_size(cores)) {
    const bool round = cores[0].core->faces.empty() && cores[1].core->faces.empty();
    for (const int index : {0, 1}) {
      const Vector3d on_a = point_at(a, index == 0 ? low : high), on_b = point_at(b, closest_fraction(b, on_a));
      const Vector3d apart = on_a - on_b;
      // Between bare edges each point has its own normal; the faces about an edge leave it one alone.
      const bool own = round && apart.dot(found.normal) > 0.0;
      add(on_a, on_b, own ? Vector3d(apart.normalized()) : found.normal, edges_feature(found, {0.5, 0.5}, index + 1));
    }
  } else {
    const ClosestPoints points = closest_points(a, b);
    const std::array<double, 2> fractions{closest_fraction(a, points.a), closest_fraction(b, points.b)};
    add(points.a, points.b, found.normal, edges_feature(found, fractions, 0));
  }
}

/// A direction to look for separating edges along.
Vector3d first_direction(NarrowScratch& scratch, const FaceRef& face) {
  const Cores& cores = scratch.cores;
  if (!tries_all_edges(cores)) {
    ++scratch.direction_searches;
    const Vector3d found = separating_direction(*cores[0].shrunk, *cores[1].shrunk, cores[1].R, cores[1].p);
    if (!found.isZero()) return found;
  }
  if (face.side >= 0) return normal_of(cores, face);
  const Vector3d apart = cores[0].center() - cores[1].center();
  return apart.isZero() ? Vector3d::UnitZ() : Vector3d(apart.normalized());
}

void place_vertices(NarrowScratch& scratch) {
  PlacedCore& b = scratch.cores[1];
  scratch.vertices.clear();
  for (const auto& v : b.core->vertices) scratch.vertices.push_back(b.R * v + b.p);
  b.vertices = scratch.vertices;
  scratch.cores[0].vertices = scratch.cores[0].core->vertices;
}

double reach_of(const Cores& cores, const Activity& activity) {
  return activity.distance + cores[0].core->radius + cores[1].core->radius;
}

/// Whether the cores, `separation` apart along the normal, are beyond the activity distance: they are then reported so.
bool report_if_apart(const Vector3d& normal, double separation, const Activity& activity, const Cores& cores,
                     Manifold& manifold) {
  if (separation <= reach_of(cores, activity)) return false;
  manifold.separating = normal;
  manifold.apart = separation - cores[0].core->radius - cores[1].core->radius;
  manifold.count = 0;
  return true;
}

/// Reports what is in scratch.points.
void set_touching(const Vector3d& normal, double layer, NarrowScratch& scratch, Manifold& manifold) {
  manifold.separating.setZero();
  manifold.apart = Manifold::kTouching;
  reduce(scratch.points, normal, layer, kPointHysteresis * smaller_size(scratch.cores), manifold);
}

void touch_at_face(const FaceContact& contact, const Activity& activity, NarrowScratch& scratch, Manifold& manifold) {
  manifold.face = contact.found.face;
  set_touching(contact.normal, activity.layer, scratch, manifold);
}

void touch_at_edges(const EdgeSeparation& found, const Activity& activity, NarrowScratch& scratch, Manifold& manifold) {
  find_edge_points(found, activity.distance, scratch);
  manifold.face = {};
  manifold.edges = found.edges;
  set_touching(found.normal, activity.layer, scratch, manifold);
}

double hysteresis_of(const Cores& cores) { return kFaceHysteresis * smaller_size(cores); }

// What the pair's last test found, if it is still the answer: it is then reported, with true.

bool keep_separation(const Activity& activity, const NarrowScratch& scratch, Manifold& manifold) {
  if (manifold.separating.isZero()) return false;
  const double separation = unplaced_separation_along(scratch.cores, manifold.separating);
  return report_if_apart(manifold.separating, separation, activity, scratch.cores, manifold);
}

/// Else `last` is what has become of it.
bool keep_face(const Activity& activity, NarrowScratch& scratch, Manifold& manifold, FaceContact& last) {
  const Cores& cores = scratch.cores;
  last.found = separation_of(cores, manifold.face.side, manifold.face.face);
  if (report_if_apart(normal_of(cores, manifold.face), last.found.separation, activity, cores, manifold)) return true;
  last = contact_on(last.found, manifold.face, activity.distance, scratch);
  if (!last.is_proved(hysteresis_of(cores))) return false;
  touch_at_face(last, activity, scratch, manifold);
  return true;
}

/// The edges are the answer if no normal can part the cores by more, and no face by about as much.
bool keep_edges(const Activity& activity, NarrowScratch& scratch, Manifold& manifold) {
  if (manifold.count == 0) return false;
  const Cores& cores = scratch.cores;
  const double hysteresis = hysteresis_of(cores);
  const EdgeSeparation edges = separation_of(cores, manifold.edges, manifold.points[0].normal);
  if (report_if_apart(edges.normal, edges.separation, activity, cores, manifold)) return true;
  if (edges.distance > edges.separation + hysteresis) return false;
  if (some_face_about(cores, edges, edges.separation - hysteresis)) return false;
  touch_at_edges(edges, activity, scratch, manifold);
  return true;
}

/// `last`: what has become of the face of the last test.
void find_contact(const Activity& activity, const FaceContact& last, NarrowScratch& scratch, Manifold& manifold) {
  const Cores& cores = scratch.cores;
  const FaceSeparation found = largest_face_separation(cores, last.found, reach_of(cores, activity));
  const bool has_face = found.face.side >= 0;
  if (has_face && report_if_apart(normal_of(cores, found.face), found.separation, activity, cores, manifold)) return;
  const bool anew = has_face && found.face != last.found.face;
  const FaceContact face = anew ? contact_on(found, manifold.face, activity.distance, scratch) : last;
  const double hysteresis = hysteresis_of(cores);
  if (!face.is_proved(hysteresis)) {
    const EdgeSeparation edges = largest_edge_separation(scratch, first_direction(scratch, found.face));
    if (report_if_apart(edges.normal, edges.separation, activity, cores, manifold)) return;
    const bool beside = face.least.all > std::max(edges.separation, found.separation) + hysteresis;
    if (edges.separation > found.separation + (beside ? -hysteresis : hysteresis)) {
      return touch_at_edges(edges, activity, scratch, manifold);
    }
    if (has_face && face.least.all > found.separation + hysteresis) {
      add_support(face.found, face.normal, activity.distance, scratch);
    }
  }
  touch_at_face(face, activity, scratch, manifold);
}

}  // namespace

void place(const Polytope& a, const ShrunkCore& shrunk_a, const Polytope& b, const ShrunkCore& shrunk_b,
           const Eigen::Matrix3d& R_AB, const Vector3d& p_AB, NarrowScratch& scratch) {
  const auto set = [](const Polytope& core, const ShrunkCore& shrunk, const Eigen::Matrix3d& R, const Vector3d& p,
                      PlacedCore& placed) {
    placed.core = &core;
    placed.shrunk = &shrunk;
    placed.R = R;
    placed.p = p;
  };
  set(a, shrunk_a, Eigen::Matrix3d::Identity(), Vector3d::Zero(), scratch.cores[0]);
  set(b, shrunk_b, R_AB, p_AB, scratch.cores[1]);
}

void collide(const Activity& activity, NarrowScratch& scratch, Manifold& manifold) {
  if (keep_separation(activity, scratch, manifold)) return;
  place_vertices(scratch);
  FaceContact last;
  const bool on_face = manifold.face.side >= 0;
  if (on_face ? keep_face(activity, scratch, manifold, last) : keep_edges(activity, scratch, manifold)) {
    return;
  }
  find_contact(activity, last, scratch, manifold);
}

void collide_with_plane(const Polytope& a, const Vector3d& normal, double offset, const Activity& activity,
                        NarrowScratch& scratch, Manifold& manifold) {
  scratch.points.clear();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < a.vertices.size(); ++v) {
    const double height = normal.dot(a.vertices[v]) - offset;
    const double gap = height - a.radius;
    least = std::min(least, gap);
    if (gap > activity.distance) continue;
    const Vector3d below = a.vertices[v] - height * normal;
    scratch.points.push_back(
        {a.vertices[v] - a.radius * normal, below, normal, gap, feature_of(FeatureKind::kPlane, v)});
  }
  manifold.apart = least > activity.distance ? least : Manifold::kTouching;
  reduce(scratch.points, normal, activity.layer, kPointHysteresis * (a.size + a.radius), manifold);
}

}  // namespace layfigure::collision
