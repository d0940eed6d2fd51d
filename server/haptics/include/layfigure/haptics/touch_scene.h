#pragma once

#include <span>
#include <vector>

#include "layfigure/doll/doll.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/fingertip.h"
#include "layfigure/scene/scene.h"

namespace layfigure::haptics {

/// A fingertip that is to be in the scene.
struct FingertipInScene {
  int pointer{0};
  FingertipDefinition definition;
  PointerPose pose;  ///< where it begins, if it was not there before
};

/// A doll and the fingertips that are out. The doll's bodies come first and keep their indices; one free root for each
/// fingertip follows, in the order given. Fingertips go through each other: the poses of two that meet are commanded,
/// by hands that feel through them what is between them, and not each other.
class TouchScene {
 public:
  explicit TouchScene(const doll::Doll& doll);

  [[nodiscard]] const dynamics::Model& model() const { return scene_.model(); }
  [[nodiscard]] scene::Scene& scene() { return scene_; }
  [[nodiscard]] const scene::Scene& scene() const { return scene_; }
  [[nodiscard]] dynamics::State& state() { return state_; }
  [[nodiscard]] const dynamics::State& state() const { return state_; }

  /// Body of the pointer's fingertip, -1: it is not out.
  [[nodiscard]] int body_of(int pointer) const;
  /// Pointer whose fingertip the body is, -1: it is the doll's.
  [[nodiscard]] int pointer_of(int body) const;

  /// These are the fingertips that are out. A scene that has other bodies is another scene: what the contacts remember
  /// for their warm start is lost, the doll's state is carried over bit for bit, and so is that of each fingertip that
  /// stays. Throws std::invalid_argument, one line, if one that comes begins inside something; nothing has changed
  /// then. Allocates; O(v^3) for hulls of v vertices, as a Scene.
  void set_fingertips(const doll::Doll& doll, std::span<const FingertipInScene> fingertips);

  /// After set_fingertips() with a doll whose joints have other laws, limits or gravity: all wakes that can move.
  void joints_changed();

  /// `state`, of the doll alone, at rest, with the time as it is. No fingertips may be out.
  void put_back(dynamics::State state);

  /// The initial pose at rest, with the time as it is; of the fingertips too.
  void reset();

  /// Carries the fingertips' weight; null if there are none.
  [[nodiscard]] const dynamics::Loads* weights() const { return fingertips_.empty() ? nullptr : &weights_; }

 private:
  class Weights : public dynamics::Loads {
   public:
    void add(double time, std::span<dynamics::BodyForce> forces) const override;
    int first{0};  ///< of the fingertips' bodies
    Eigen::Vector3d lift{Eigen::Vector3d::Zero()};
  };

  [[nodiscard]] dynamics::State carried_over(const dynamics::Model& model,
                                             std::span<const FingertipInScene> fingertips) const;

  int doll_bodies_;
  scene::Scene scene_;
  dynamics::State state_;
  std::vector<FingertipInScene> fingertips_;
  Weights weights_;
};

}  // namespace layfigure::haptics
