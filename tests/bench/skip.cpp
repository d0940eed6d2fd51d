#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "cpu_clock.h"
#include "figures.h"
#include "layfigure/math/rotation.h"
#include "layfigure/scene/scene.h"
#include "scene.h"
#include "subjects.h"
#include "touching_scenes.h"

namespace layfigure::bench {
namespace {

using dynamics::Coupling;
using dynamics::ModelDefinition;
using dynamics::RootKind;
using dynamics::State;

constexpr double kStep = 1e-3;
constexpr int kSteps = 1000;
constexpr int kRepeats = 31;
// Seconds until the doll of 52 joints hangs still, and until it has then fallen asleep.
constexpr double kSettling = 40.0;
constexpr double kFallingAsleep = 1.0;
// What posing one hand may cost of the whole doll.
constexpr double kTargetRatio = 0.25;
// Of the doll of 52 joints.
constexpr int kHand = 9;
constexpr int kFingertip = 15;

/// Base steps that are to be timed.
struct Course {
  scene::SceneDefinition definition;
  State start;
  double sleep_angle{0.0};
  std::vector<Coupling> grips{};  ///< that of each step, if there is one
};

struct Run {
  double cpu_seconds{0.0};
  double asleep{0.0};  ///< bodies, on average
  int rows{0};         ///< solved for, in the step that had most
};

Run run(const Course& course) {
  scene::Scene scene(course.definition);
  State state = course.start;
  Run run;
  const double start = testing::thread_cpu_seconds();
  for (int k = 0; k < kSteps; ++k) {
    dynamics::Inputs inputs;
    if (!course.grips.empty()) inputs.couplings = {&course.grips[k], 1};
    const auto report = scene.step(state, inputs, {.step = kStep, .sleep_angle = course.sleep_angle}).step;
    if (report.status != dynamics::StepStatus::kOk) throw std::runtime_error("skip: a step failed");
    run.asleep += static_cast<double>(report.asleep) / kSteps;
    run.rows = std::max(run.rows, report.constraints.rows);
  }
  run.cpu_seconds = testing::thread_cpu_seconds() - start;
  return run;
}

/// The same course with what there is to skip and without.
struct Comparison {
  Run skipping;
  Run plain;
  [[nodiscard]] double ratio() const { return skipping.cpu_seconds / plain.cpu_seconds; }
};

/// The least times of runs that take turns, so that what else the machine does meets both.
Comparison compare(const Course& skipping, const Course& plain) {
  Comparison least{.skipping = run(skipping), .plain = run(plain)};
  for (int k = 1; k < kRepeats; ++k) {
    least.skipping.cpu_seconds = std::min(least.skipping.cpu_seconds, run(skipping).cpu_seconds);
    least.plain.cpu_seconds = std::min(least.plain.cpu_seconds, run(plain).cpu_seconds);
  }
  return least;
}

Comparison compare_sleep(const Course& course) {
  Course sleeping = course;
  sleeping.sleep_angle = dynamics::kSleepAngle;
  return compare(sleeping, course);
}

/// From a definition's pose.
Course course_of(const scene::SceneDefinition& definition) {
  return {.definition = definition, .start = initial_state(dynamics::Model(definition.model))};
}

Course course_of(const ModelDefinition& definition) {
  return course_of({.model = definition, .shapes = {}, .excluded = {}});
}

ModelDefinition doll_52() { return testing::load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json").definition; }

void make_unstrained(ModelDefinition& definition) {
  for (dynamics::BodyDefinition& body : definition.bodies) body.rest_rotation = body.rotation;
}

void advance(scene::Scene& scene, State& state, double seconds, double sleep_angle) {
  for (int k = 0; k * kStep < seconds; ++k) {
    (void)scene.step(state, {}, {.step = kStep, .sleep_angle = sleep_angle});
  }
}

/// The doll of 52 joints, asleep as it hangs.
Course resting_doll(RootKind root) {
  ModelDefinition definition = doll_52();
  definition.root = root;
  make_unstrained(definition);
  Course course = course_of(definition);
  scene::Scene scene(course.definition);
  advance(scene, course.start, kSettling, 0.0);
  advance(scene, course.start, kFallingAsleep, dynamics::kSleepAngle);
  return course;
}

/// Something that holds a body by its com and moves up and down.
struct Grip {
  int body;
  double stiffness;  ///< [N/m]
  double damping;    ///< [N s/m]
  double amplitude;  ///< [m]
};

std::vector<Coupling> moved(const Grip& grip, const Course& course) {
  constexpr double kRate = 6.0;  // [rad/s]
  const dynamics::Model model(course.definition.model);
  std::vector<dynamics::BodyPose> poses;
  world_poses(model, course.start, poses);
  std::vector<Coupling> couplings;
  for (int k = 0; k < kSteps; ++k) {
    const double phase = kRate * k * kStep;
    Coupling coupling{
        .body = grip.body, .point = model.body(grip.body).com, .stiffness = grip.stiffness, .damping = grip.damping};
    coupling.target_position = poses[grip.body].com + grip.amplitude * std::sin(phase) * Eigen::Vector3d::UnitZ();
    coupling.target_velocity.z() = grip.amplitude * kRate * std::cos(phase);
    couplings.push_back(coupling);
  }
  return couplings;
}

void tell_posing(const std::string& name, Course course, const Grip& grip, std::vector<Figure>& figures) {
  course.grips = moved(grip, course);
  const Comparison found = compare_sleep(course);
  figures.push_back({name + ", step: rest asleep / all awake", found.ratio(), "", kTargetRatio});
  figures.push_back({name + ", step: rest asleep", found.skipping.cpu_seconds / kSteps * 1e6, "us"});
  figures.push_back({name + ": bodies asleep, mean", found.skipping.asleep, ""});
}

void tell_rest(const Course& resting, std::vector<Figure>& figures) {
  const Comparison found = compare_sleep(resting);
  figures.push_back({"doll at rest, step: at rest / all awake", found.ratio(), ""});
  figures.push_back({"doll at rest, step", found.skipping.cpu_seconds / kSteps * 1e6, "us"});
}

/// What looking for sleepers costs where there are none.
void tell_motion(std::vector<Figure>& figures) {
  const Comparison found = compare_sleep(course_of(doll_52()));
  figures.push_back({"doll in motion, step: with sleep / without", found.ratio(), ""});
  figures.push_back({"doll in motion: bodies asleep, mean", found.skipping.asleep, ""});
}

/// A chain of eight links, three of its joints of a stiffness [N m/rad].
Course stiffened_chain(double stiffness) {
  ModelDefinition definition = testing::chain({.links = 8, .bend = 0.2}).definition;
  make_unstrained(definition);
  for (const int joint : {3, 4, 5}) definition.bodies[joint].joint.stiffness = stiffness;
  return course_of(definition);
}

void tell_welds(std::vector<Figure>& figures) {
  // Just below what counts as rigid.
  const Comparison found = compare(stiffened_chain(INFINITY), stiffened_chain(0.99 * dynamics::kRigidStiffness));
  figures.push_back({"chain of 8, 3 joints, step: welded / stiff", found.ratio(), ""});
}

/// A doll of capsules that falls from high over the floor, its joints bent and swinging well within their limits.
Course falling_doll() {
  constexpr double kHeight = 100.0;
  scene::SceneDefinition definition = testing::capsule_doll(kHeight, INFINITY);
  for (dynamics::BodyDefinition& body : definition.model.bodies) {
    body.rotation = math::exp_rotation(Eigen::Vector3d(0.05, 0.1, 0.05));
  }
  return course_of(definition);
}

void tell_limits(std::vector<Figure>& figures) {
  Course limited = falling_doll();
  limited.definition.shapes.clear();
  Course free = limited;
  for (dynamics::BodyDefinition& body : free.definition.model.bodies) body.limits = {};
  const Comparison found = compare(limited, free);
  figures.push_back({"joints far from their limits, step: with limits / without", found.ratio(), ""});
  figures.push_back({"joints far from their limits: rows, most", static_cast<double>(found.skipping.rows), ""});
}

void tell_shapes(std::vector<Figure>& figures) {
  const Course shaped = falling_doll();
  Course bare = shaped;
  bare.definition.shapes.clear();
  const Comparison found = compare(shaped, bare);
  figures.push_back({"shapes far apart, step: with shapes / without", found.ratio(), ""});
  figures.push_back({"shapes far apart: rows, most", static_cast<double>(found.skipping.rows), ""});
}

}  // namespace

void skip(const SkipOptions& options) {
  std::vector<Figure> figures;
  const Course resting = resting_doll(RootKind::kBall);
  tell_posing("one finger posed", resting, {.body = kFingertip, .stiffness = 5.0, .damping = 0.2, .amplitude = 3e-3},
              figures);
  tell_posing("one hand posed", resting_doll(RootKind::kFixed),
              {.body = kHand, .stiffness = 2000.0, .damping = 150.0, .amplitude = 5e-3}, figures);
  tell_rest(resting, figures);
  tell_motion(figures);
  tell_welds(figures);
  tell_limits(figures);
  tell_shapes(figures);
  print(figures, options.json);
}

}  // namespace layfigure::bench
