#include "layfigure/collision/world.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "moving_body.h"
#include "narrow_phase.h"
#include "near_pairs.h"
#include "shape_set.h"
#include "validate.h"

namespace layfigure::collision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// What a listed pair's last test gave. The world's points stand as long as neither body moves.
struct PairContact {
  std::pair<int, int> shapes;
  bool tested{false};
  /// The pair has no points, and needs no test, until its bodies have travelled so far in sum, their reaches included.
  double apart_until{-std::numeric_limits<double>::infinity()};
  Pose X_AB;  ///< when it was tested
  Manifold manifold;
  std::array<ContactPoint, kMaxPoints> points;
};

}  // namespace

struct World::Data {
  Data(WorldDefinition given, const Data* like);

  [[nodiscard]] bool move(std::span<const Pose> X_WB, std::span<const double> reach);
  void list_pairs(UpdateReport& report);
  void test_pairs(UpdateReport& report);
  [[nodiscard]] bool stays_apart(const NearPair& near, PairContact& pair) const;
  [[nodiscard]] bool must_test(const NearPair& near, const PairContact& pair) const;
  void test(const NearPair& near, PairContact& pair);
  void collide_pair(const NearPair& near, Manifold& manifold);
  void write_points(const NearPair& near, PairContact& pair);

  [[nodiscard]] const MovingBody& body_a(const NearPair& near) const { return bodies[near.bodies.first]; }
  [[nodiscard]] const MovingBody& body_b(const NearPair& near) const { return bodies[near.bodies.second]; }
  [[nodiscard]] double travel_of(const NearPair& near) const { return body_a(near).travel + body_b(near).travel; }
  [[nodiscard]] double reach_of(const NearPair& near) const { return body_a(near).reach + body_b(near).reach; }

  ShapeSet shapes;
  std::vector<MovingBody> bodies;  ///< the world first
  bool active;                     ///< there are shapes that may meet
  bool fresh{true};                ///< nothing is remembered

  NearPairs near_pairs;
  std::vector<PairContact> pairs;  ///< those listed
  std::vector<PairContact> last_pairs;
  std::vector<ContactPoint> contacts;
  NarrowScratch scratch;
};

World::Data::Data(WorldDefinition given, const Data* like)
    : shapes(std::move(given), like == nullptr ? nullptr : &like->shapes),
      bodies(shapes.definition().bodies + 1),
      active(shapes.some_may_meet()),
      near_pairs(shapes) {
  const std::vector<double> radii = shapes.radii();
  for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i].radius = radii[i];
}

/// Takes the poses and reaches over; true if any differs from the last one.
bool World::Data::move(std::span<const Pose> X_WB, std::span<const double> reach) {
  bool any = fresh;
  for (std::size_t i = 0; i < X_WB.size(); ++i) {
    MovingBody& body = bodies[i + 1];
    const double new_reach = reach.empty() ? 0.0 : reach[i];
    fresh ? body.start(X_WB[i], new_reach) : body.move(X_WB[i], new_reach);
    any = any || body.moved;
  }
  fresh = false;
  return any;
}

/// Lists the near pairs anew, and carries on what was remembered of each.
void World::Data::list_pairs(UpdateReport& report) {
  near_pairs.find(bodies, report);
  std::swap(pairs, last_pairs);
  pairs.clear();
  auto last = last_pairs.begin();
  for (const NearPair& near : near_pairs.list()) {
    while (last != last_pairs.end() && last->shapes < near.shapes) ++last;
    if (last != last_pairs.end() && last->shapes == near.shapes) {
      pairs.push_back(*last);
      continue;
    }
    PairContact& pair = pairs.emplace_back();
    pair.shapes = near.shapes;
    pair.apart_until = travel_of(near) + near.apart - shapes.definition().activity;
  }
}

/// Whether the pair cannot come within the activity distance before the next update.
bool World::Data::stays_apart(const NearPair& near, PairContact& pair) const {
  const double used = travel_of(near) + reach_of(near);
  if (used < pair.apart_until) return true;
  if (!pair.tested || pair.manifold.apart == Manifold::kTouching || near.plane) return false;
  // Bodies that are carried along together travel far and come no nearer.
  const double moved = largest_motion(pair.X_AB, body_a(near).pose_of(body_b(near)), body_b(near).radius);
  pair.apart_until = travel_of(near) + pair.manifold.apart - moved - shapes.definition().activity;
  return used < pair.apart_until;
}

bool World::Data::must_test(const NearPair& near, const PairContact& pair) const {
  return !pair.tested || body_a(near).moved || body_b(near).moved;
}

void World::Data::test_pairs(UpdateReport& report) {
  contacts.clear();
  scratch.direction_searches = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const NearPair& near = near_pairs.list()[k];
    PairContact& pair = pairs[k];
    if (stays_apart(near, pair)) continue;
    if (must_test(near, pair)) {
      test(near, pair);
      ++report.narrow_tests;
    }
    contacts.insert(contacts.end(), pair.points.begin(), pair.points.begin() + pair.manifold.count);
  }
  report.direction_searches = scratch.direction_searches;
}

void World::Data::test(const NearPair& near, PairContact& pair) {
  collide_pair(near, pair.manifold);
  pair.tested = true;
  pair.X_AB = body_a(near).pose_of(body_b(near));
  pair.apart_until = travel_of(near) + pair.manifold.apart - shapes.definition().activity;
  write_points(near, pair);
}

void World::Data::collide_pair(const NearPair& near, Manifold& manifold) {
  const double layer = shapes.definition().activity;
  const Activity activity{.distance = layer + reach_of(near), .layer = layer};
  const MovingBody& body = body_a(near);
  const MovingBody& other = body_b(near);
  const Matrix3d R_AB = body.R_WB.transpose() * other.R_WB;
  const Vector3d p_AB = body.R_WB.transpose() * (other.X_WB.position - body.X_WB.position);
  const CoreShape& a = shapes.cores()[near.a];
  if (near.plane) {
    const PlaneShape& plane = shapes.planes()[near.b];
    const Vector3d normal_A = R_AB * plane.normal;
    const double offset = plane.offset + normal_A.dot(p_AB);
    collide_with_plane(a.core, normal_A, offset, activity, scratch, manifold);
  } else {
    const CoreShape& b = shapes.cores()[near.b];
    place(a.core, a.shrunk, b.core, b.shrunk, R_AB, p_AB, scratch);
    collide(activity, scratch, manifold);
  }
}

void World::Data::write_points(const NearPair& near, PairContact& pair) {
  const auto [shape_a, shape_b] = near.shapes;
  const auto& a = shapes.definition().shapes[shape_a];
  const auto& b = shapes.definition().shapes[shape_b];
  const MovingBody& body = body_a(near);
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
  if (bad != X_WB.end() || static_cast<int>(X_WB.size()) != data.shapes.definition().bodies) {
    return {.status = UpdateStatus::kBadPose, .bad_body = static_cast<int>(bad - X_WB.begin())};
  }
  UpdateReport report;
  if (!data.active || !data.move(X_WB, reach)) return report;
  if (!data.near_pairs.hold(data.bodies)) data.list_pairs(report);
  data.test_pairs(report);
  return report;
}

bool World::active() const { return data_->active; }

std::span<const ContactPoint> World::contacts() const { return data_->contacts; }

void World::forget() {
  data_->pairs.clear();
  data_->contacts.clear();
  data_->near_pairs.forget();
  data_->fresh = true;
}

}  // namespace layfigure::collision
