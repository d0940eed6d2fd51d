#include "layfigure/collision/world.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "narrow_phase.h"
#include "sweep.h"
#include "validate.h"

namespace layfigure::collision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Body {
  Pose X_WB{};
  Matrix3d R_WB{Matrix3d::Identity()};
  double reach{0.0};
  bool moved{false};  ///< since the last update, or its reach changed
};

// Shapes as the tests use them, in the frame of the body that carries them. `shape` is the definition's index.
struct CoreShape {
  int shape;
  Polytope core;
  ShrunkCore shrunk;
};
struct PlaneShape {
  int shape;
  Vector3d normal;
  double offset;
};

/// Two shapes whose bounds are near each other. `a` is an index into the cores; `b` too, or into the planes.
struct Candidate {
  std::pair<int, int> shapes;
  int a;
  int b;
  bool plane;
};

/// What a pair's last test gave. The world's points stand as long as neither body moves.
struct PairContact {
  std::pair<int, int> shapes;
  Manifold manifold;
  std::array<ContactPoint, kMaxPoints> points;
};

Box box_of(const Polytope& core, const Body& body, double margin) {
  const Vector3d center = body.R_WB * core.box_center + body.X_WB.position;
  const Vector3d half = body.R_WB.cwiseAbs() * core.box_half + Vector3d::Constant(margin);
  return {center - half, center + half};
}

std::vector<std::pair<int, int>> sorted_pairs(std::vector<std::pair<int, int>> pairs) {
  for (auto& [a, b] : pairs) {
    if (a > b) std::swap(a, b);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace

struct World::Data {
  Data(WorldDefinition given, const Data* other);

  void add(const Sphere& shape, int index) { add_core(make_polytope(shape, definition.shapes[index].X_BS), index); }
  void add(const Capsule& shape, int index) { add_core(make_polytope(shape, definition.shapes[index].X_BS), index); }
  void add(const ConvexHull& shape, int index);
  void add(const Plane&, int index);
  [[nodiscard]] const Polytope* core_of(int index, const ConvexHull& shape, const Pose& X_BS) const;
  void add_core(Polytope core, int index);

  [[nodiscard]] bool some_may_meet() const;
  [[nodiscard]] bool may_meet(int shape_a, int shape_b) const;
  [[nodiscard]] Body& carrier(int shape) { return bodies[definition.shapes[shape].body + 1]; }

  bool move(std::span<const Pose> X_WB, std::span<const double> reach);
  [[nodiscard]] Activity activity_of(const Candidate& candidate) {
    const double reach = carrier(candidate.shapes.first).reach + carrier(candidate.shapes.second).reach;
    return {.distance = definition.activity + reach, .layer = definition.activity};
  }
  void find_near_cores(UpdateReport& report);
  void find_near_planes(UpdateReport& report);
  void test_candidates(UpdateReport& report);
  void test(const Candidate& candidate, PairContact& pair);
  void write_points(PairContact& pair);

  const Data* like;            ///< while the shapes are added
  WorldDefinition definition;  ///< its excluded pairs sorted
  std::vector<Body> bodies;    ///< the world first
  std::vector<CoreShape> cores;
  std::vector<PlaneShape> planes;
  bool active;       ///< there are shapes that may meet
  bool fresh{true};  ///< nothing is remembered

  Sweep sweep;
  std::vector<Box> boxes;  ///< of the cores, enlarged by half the activity distance
  std::vector<std::pair<int, int>> overlapping;
  std::vector<Candidate> candidates;
  std::vector<PairContact> pairs;
  std::vector<PairContact> last_pairs;
  std::vector<ContactPoint> contacts;
  NarrowScratch scratch;
};

World::Data::Data(WorldDefinition given, const Data* other)
    : like(other), definition(std::move(given)), bodies(definition.bodies + 1), sweep(0) {
  definition.excluded = sorted_pairs(std::move(definition.excluded));
  for (int i = 0; i < static_cast<int>(definition.shapes.size()); ++i) {
    std::visit([&](const auto& shape) { add(shape, i); }, definition.shapes[i].shape);
  }
  sweep = Sweep(static_cast<int>(cores.size()));
  boxes.resize(cores.size());
  active = some_may_meet();
  like = nullptr;
}

/// The hull's core, if there is that shape under that index.
const Polytope* World::Data::core_of(int index, const ConvexHull& shape, const Pose& X_BS) const {
  const auto found = std::ranges::find(cores, index, &CoreShape::shape);
  if (found == cores.end()) return nullptr;
  const ShapeDefinition& known = definition.shapes[index];
  const auto* hull = std::get_if<ConvexHull>(&known.shape);
  const bool same = hull != nullptr && hull->vertices == shape.vertices &&
                    known.X_BS.rotation.coeffs() == X_BS.rotation.coeffs() && known.X_BS.position == X_BS.position;
  return same ? &found->core : nullptr;
}

void World::Data::add(const ConvexHull& shape, int index) {
  const Pose& X_BS = definition.shapes[index].X_BS;
  const Polytope* known = like == nullptr ? nullptr : like->core_of(index, shape, X_BS);
  add_core(known == nullptr ? make_polytope(shape, X_BS) : *known, index);
}

void World::Data::add(const Plane&, int index) {
  const Pose& X_BS = definition.shapes[index].X_BS;
  const Vector3d normal = X_BS.rotation.normalized() * Vector3d::UnitZ();
  planes.push_back({index, normal, normal.dot(X_BS.position)});
}

void World::Data::add_core(Polytope core, int index) {
  ShrunkCore shrunk(core);
  cores.push_back({index, std::move(core), std::move(shrunk)});
}

bool World::Data::some_may_meet() const {
  const auto& shapes = definition.shapes;
  return std::any_of(shapes.begin(), shapes.end(), [&](const ShapeDefinition& shape) {
    return shape.body != shapes.front().body && (shape.group == 0 || shape.group != shapes.front().group);
  });
}

bool World::Data::may_meet(int shape_a, int shape_b) const {
  const auto& a = definition.shapes[shape_a];
  const auto& b = definition.shapes[shape_b];
  if (a.body == b.body || (a.group != 0 && a.group == b.group)) return false;
  return !std::binary_search(definition.excluded.begin(), definition.excluded.end(),
                             std::pair<int, int>(std::minmax(a.body, b.body)));
}

/// Takes the poses and reaches over; true if any differs from the last one.
bool World::Data::move(std::span<const Pose> X_WB, std::span<const double> reach) {
  bool any = fresh;
  for (std::size_t i = 0; i < X_WB.size(); ++i) {
    Body& body = bodies[i + 1];
    const Pose& to = X_WB[i];
    const double new_reach = reach.empty() ? 0.0 : reach[i];
    body.moved = fresh || body.X_WB.position != to.position || body.X_WB.rotation.coeffs() != to.rotation.coeffs() ||
                 body.reach != new_reach;
    if (!body.moved) continue;
    any = true;
    body.X_WB = to;
    body.reach = new_reach;
    body.R_WB = to.rotation.normalized().toRotationMatrix();
  }
  return any;
}

void World::Data::find_near_cores(UpdateReport& report) {
  for (std::size_t i = 0; i < cores.size(); ++i) {
    const Body& body = carrier(cores[i].shape);
    if (fresh || body.moved) boxes[i] = box_of(cores[i].core, body, 0.5 * definition.activity + body.reach);
  }
  overlapping.clear();
  report.box_tests += sweep.find(boxes, overlapping);
  for (auto [a, b] : overlapping) {
    if (!may_meet(cores[a].shape, cores[b].shape)) continue;
    if (definition.shapes[cores[a].shape].body == kWorldBody) std::swap(a, b);
    candidates.push_back({{cores[a].shape, cores[b].shape}, a, b, false});
  }
}

void World::Data::find_near_planes(UpdateReport& report) {
  for (int p = 0; p < static_cast<int>(planes.size()); ++p) {
    const PlaneShape& plane = planes[p];
    const Body& body = carrier(plane.shape);
    const Vector3d normal = body.R_WB * plane.normal;
    const double highest = plane.offset + normal.dot(body.X_WB.position) + 0.5 * definition.activity + body.reach;
    for (int c = 0; c < static_cast<int>(cores.size()); ++c) {
      const Box& box = boxes[c];
      ++report.box_tests;
      const double lowest = 0.5 * (normal.dot(box.low + box.high) - normal.cwiseAbs().dot(box.high - box.low));
      if (lowest > highest || !may_meet(cores[c].shape, plane.shape)) continue;
      candidates.push_back({{cores[c].shape, plane.shape}, c, p, true});
    }
  }
}

/// Carries on what was remembered of each pair, and tests those of which a body moved.
void World::Data::test_candidates(UpdateReport& report) {
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& p, const Candidate& q) { return p.shapes < q.shapes; });
  std::swap(pairs, last_pairs);
  pairs.clear();
  contacts.clear();
  scratch.direction_searches = 0;
  auto last = last_pairs.begin();
  for (const Candidate& candidate : candidates) {
    while (last != last_pairs.end() && last->shapes < candidate.shapes) ++last;
    const bool known = last != last_pairs.end() && last->shapes == candidate.shapes;
    PairContact& pair = pairs.emplace_back(known ? *last : PairContact{candidate.shapes, {}, {}});
    if (!known || carrier(candidate.shapes.first).moved || carrier(candidate.shapes.second).moved) {
      test(candidate, pair);
      ++report.narrow_tests;
    }
    contacts.insert(contacts.end(), pair.points.begin(), pair.points.begin() + pair.manifold.count);
  }
  report.direction_searches = scratch.direction_searches;
}

void World::Data::test(const Candidate& candidate, PairContact& pair) {
  const Body& body_a = carrier(candidate.shapes.first);
  const Body& body_b = carrier(candidate.shapes.second);
  const Matrix3d R_AB = body_a.R_WB.transpose() * body_b.R_WB;
  const Vector3d p_AB = body_a.R_WB.transpose() * (body_b.X_WB.position - body_a.X_WB.position);
  const CoreShape& a = cores[candidate.a];
  if (candidate.plane) {
    const PlaneShape& plane = planes[candidate.b];
    const Vector3d normal_A = R_AB * plane.normal;
    const double offset = plane.offset + normal_A.dot(p_AB);
    collide_with_plane(a.core, normal_A, offset, activity_of(candidate), scratch, pair.manifold);
  } else {
    const CoreShape& b = cores[candidate.b];
    place(a.core, a.shrunk, b.core, b.shrunk, R_AB, p_AB, scratch);
    collide(activity_of(candidate), scratch, pair.manifold);
  }
  write_points(pair);
}

void World::Data::write_points(PairContact& pair) {
  const auto [shape_a, shape_b] = pair.shapes;
  const auto& a = definition.shapes[shape_a];
  const auto& b = definition.shapes[shape_b];
  const Body& body = carrier(shape_a);
  const double friction = std::sqrt(a.friction * b.friction);
  for (int k = 0; k < pair.manifold.count; ++k) {
    const LocalPoint& point = pair.manifold.points[k];
    pair.points[k] = {.body_a = a.body,
                      .body_b = b.body,
                      .shape_a = shape_a,
                      .shape_b = shape_b,
                      .p_Wa = body.R_WB * point.on_a + body.X_WB.position,
                      .p_Wb = body.R_WB * point.on_b + body.X_WB.position,
                      .normal_W = body.R_WB * point.normal,
                      .gap = point.gap,
                      .friction = friction,
                      .feature = point.feature};
  }
}

World::World(WorldDefinition definition) {
  validate(definition);
  data_ = std::make_unique<Data>(std::move(definition), nullptr);
}
World::World(WorldDefinition definition, const World& like) {
  validate(definition);
  data_ = std::make_unique<Data>(std::move(definition), like.data_.get());
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

UpdateReport World::update(std::span<const Pose> X_WB, std::span<const double> reach) {
  assert(reach.empty() || reach.size() == X_WB.size());
  Data& data = *data_;
  const auto bad = std::find_if_not(X_WB.begin(), X_WB.end(), is_rigid);
  if (bad != X_WB.end() || static_cast<int>(X_WB.size()) != data.definition.bodies) {
    return {.status = UpdateStatus::kBadPose, .bad_body = static_cast<int>(bad - X_WB.begin())};
  }
  UpdateReport report;
  if (!data.active || !data.move(X_WB, reach)) return report;
  data.candidates.clear();
  data.find_near_cores(report);
  data.find_near_planes(report);
  data.fresh = false;
  data.test_candidates(report);
  return report;
}

bool World::active() const { return data_->active; }

std::span<const ContactPoint> World::contacts() const { return data_->contacts; }

void World::forget() {
  data_->pairs.clear();
  data_->contacts.clear();
  data_->fresh = true;
}

}  // namespace layfigure::collision
