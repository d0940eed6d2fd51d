#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "layfigure/collision/contact_point.h"
#include "layfigure/collision/shapes.h"

namespace layfigure::collision {

/// All that a World is made from.
struct WorldDefinition {
  int bodies{0};                              ///< number of bodies, >= 0
  std::vector<ShapeDefinition> shapes;        ///< in any order, any number per body
  std::vector<std::pair<int, int>> excluded;  ///< bodies that never meet: those that share a joint
  double activity{0.005};                     ///< contacts with a gap up to this are reported [m], >= 0
};

enum class UpdateStatus {
  kOk,
  kBadPose,  ///< a pose was not finite, its quaternion not unit, or missing; the contacts were left as they were
};

/// What an update did. Counts show what was skipped.
struct UpdateReport {
  UpdateStatus status{UpdateStatus::kOk};
  int bad_body{-1};           ///< the first whose pose was bad; the number of poses if there were too few or too many
  int box_tests{0};           ///< pairs of shapes whose bounds were compared; none while a list of near pairs stands
  int narrow_tests{0};        ///< pairs of shapes that were tested exactly
  int direction_searches{0};  ///< of those, pairs of hulls whose separating direction had to be searched for
};

/// Finds the contact points between the shapes of a fixed set of bodies.
///
/// A shape is a convex core (a point, a segment, a polytope) rounded by a radius. Of two cores, the gap is
///     max over unit n of   min over a's vertices of n . v_a  -  max over b's vertices of n . v_b
/// less the radii, and n the contact normal. The candidates for n are the faces' normals, and the directions between
/// the closest points of two edges; an n whose value equals the distance of two points of the cores is proved the best.
/// Everything that is reported is computed in double precision, in the frame of body a, so it is as accurate far from
/// the world's origin as near it, and no collision margin exists.
/// Of two hulls with many edges, only the edges about an approximate direction are tried. Bullet's GJK and EPA find it
/// in single precision, on cores shrunk about their centres: those stay apart while the hulls touch.
///
/// A pair has at most four points within the activity distance of its deepest: this, and those that span the largest
/// area with it; and with a reach (update()) as many again beyond, which may come to touch. So that a resting body
/// keeps them, the points chosen stay the same until others are better by 1e-4 of the smaller shape's size, and the
/// face they lie on until another normal's gap is larger by 1e-5 of it: so much a gap may be too small.
///
/// Pairs overlapping by more than about a tenth of their size get a normal that separates them, not always the best.
///
/// Not thread-safe. The same shapes and the same sequence of poses give the same contacts, bit for bit.
class World {
 public:
  /// O(v^3) for a hull of v vertices. Throws std::invalid_argument that names the shape, the value and the allowed
  /// range.
  explicit World(WorldDefinition definition);
  /// The same world, made sooner: hulls that `like` has too, as the same shape under the same index, are taken over.
  World(WorldDefinition definition, const World& like);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Moves the bodies to X_WB, one pose per body, and finds the contacts within the activity distance. `reach` [m], if
  /// not empty one finite value >= 0 per body, is how far a body's surface may get before the next update: it is added
  /// to the activity distance of the pairs that the body is in, so that nothing fast is missed.
  /// How far each body has gone is summed up, so that most is looked at only when it may matter: the sweep over the n
  /// shapes' bounds when a body has gone 16 times its reach, a pair when its bodies, one as seen from the other, have
  /// used up the distance that its last test found. A pair that touches is looked at where it touched last, and
  /// searched only where that does not prove to be the answer. Pairs neither of which moved keep their contacts;
  /// nothing at all is done where no two shapes may meet. Allocates only where there are more near pairs or contacts
  /// than ever before. Throws nothing else.
  [[nodiscard]] UpdateReport update(std::span<const Pose> X_WB, std::span<const double> reach = {});

  /// Some two shapes may meet: update() has something to do.
  [[nodiscard]] bool active() const;

  /// The contacts of the last update, ordered by shape_a and shape_b.
  [[nodiscard]] std::span<const ContactPoint> contacts() const;

  /// Drops what is remembered between updates: what follows is then as after construction, bit for bit. For use where
  /// a saved state is restored.
  void forget();

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace layfigure::collision
