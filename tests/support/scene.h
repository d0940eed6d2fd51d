#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"

/// Scenes that tests and benchmarks share, and their file format.
namespace layfigure::testing {

/// A force on one body at its com over [start, end], world axes.
struct Pull {
  enum class Shape { kSinSquared, kConstant };
  int body{0};
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< [N]; kSinSquared: at its height, half way
  double start{0.0};                               ///< [s]
  double end{0.0};                                 ///< [s]
  Shape shape{Shape::kSinSquared};
};

class Pulls : public dynamics::Loads {
 public:
  explicit Pulls(std::vector<Pull> pulls) : pulls_(std::move(pulls)) {}
  void add(double time, std::span<dynamics::BodyForce> forces) const override;
  [[nodiscard]] bool empty() const { return pulls_.empty(); }

 private:
  std::vector<Pull> pulls_;
};

/// A capsule on a body, in its frame; a ball where its ends are one.
struct Limb {
  int body{0};
  Eigen::Vector3d from{Eigen::Vector3d::Zero()};  ///< ends of the axis [m]
  Eigen::Vector3d to{Eigen::Vector3d::Zero()};
  double radius{0.05};  ///< [m]
};

struct Scene {
  std::string name;
  dynamics::ModelDefinition definition;
  double duration{1.0};  ///< [s]
  std::vector<Pull> pulls;
  std::vector<Limb> limbs;
  std::optional<double> floor;  ///< Coulomb's coefficient of the limbs on the plane z = 0, if that is a floor
};

/// Reads a scene: JSON with bodies in tree order, each with parent, anchor (in the parent's frame), com, mass, inertia
/// (diagonal, about the com), quat0 (w x y z, world orientation at the start; the rest rotation is the identity), K, D
/// and optionally yield_torque and flow_damping; gravity; duration; optionally law, loads, root ("ball" or "free"),
/// limbs (body, from, to, radius) and floor (its coefficient of friction). Limbs meet the floor alone, not each other.
/// Throws std::runtime_error that names the file and the field.
[[nodiscard]] Scene load_scene(const std::string& path);

struct ChainOptions {
  int links{20};
  double bend{0.0};       ///< rotation of each joint at the start about an axis that turns along the chain [rad]
  double stiffness{2.0};  ///< K_f [N m/rad]
  double damping{0.02};   ///< D_f [N m s/rad]
  double yield_torque{std::numeric_limits<double>::infinity()};
  double flow_damping{0.0};
  dynamics::FlowLaw law{dynamics::FlowLaw::kPaper};
};
/// A chain of 0.1 m, 0.1 kg links that begins along x; with a bend it is a helix-like curve in 3-D.
[[nodiscard]] Scene chain(const ChainOptions& options);

/// A chain whose last link is pulled past yield and let go.
[[nodiscard]] Scene pulled_chain(const ChainOptions& options);

/// Steps the scene, which has no floor, to its end with `steps` equal steps.
struct RunResult {
  dynamics::State state;
  std::vector<Eigen::Vector3d> coms;  ///< world [m]
  int solves{0};
  bool converged{true};
  bool finite{true};
  double cpu_seconds{0.0};  ///< of the stepping alone, by the thread's CPU clock
};
[[nodiscard]] RunResult run_scene(const Scene& scene, const dynamics::Model& model, int steps, int order);

/// Root mean square distance of two lists of points [m].
[[nodiscard]] double rms_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b);

}  // namespace layfigure::testing
