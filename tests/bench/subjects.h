#pragma once

#include <string>
#include <vector>

/// The subjects of layfigure-bench. work_precision prints runs; the others print figures (figures.h). Each prints a
/// table, or JSON when asked.
namespace layfigure::bench {

struct WorkPrecisionOptions {
  std::string scene;      ///< path of a scene file
  int order{1};           ///< 1 to 6
  std::vector<double> h;  ///< lengths of the steps to try [s]
  bool json{false};
};
/// CPU time of the stepping and where it ends, for each h. Throws std::runtime_error if the scene cannot be read.
void work_precision(const WorkPrecisionOptions& options);

struct CostOptions {
  std::string scene;
  bool json{false};
};
/// CPU time of a step of each order, and per joint and solve; wall time on two threads.
void cost(const CostOptions& options);

struct ContactOptions {
  int most_rows{300};  ///< the scenes come in the order of their sizes, and end before the first larger one
  bool json{false};
};
/// The complementarity problems of real contact sets: time, iterations and residual of our solver, cold and warm, and
/// of Bullet's on the same matrices; and what a step costs with contacts and without.
void contact(const ContactOptions& options);

struct SkipOptions {
  bool json{false};
};
/// What is saved by computing nothing that a scene does not need, as ratios of the CPU times of steps: sleep, rest,
/// welded joints, limits and contacts that are far.
void skip(const SkipOptions& options);

struct HapticsOptions {
  bool quick{false};               ///< smaller counts
  std::vector<std::string> parts;  ///< of haptics_parts(); none: all
  std::string z_width;             ///< file for the map of stable walls (JSON); empty: none
  bool json{false};
};
[[nodiscard]] std::vector<std::string> haptics_parts();
/// What the haptics are held to, with the simulated device: pose, tensions, stable walls, energy, what is felt of a
/// doll against the full model, and the times of ticks. Throws std::runtime_error if the file cannot be written.
void haptics(const HapticsOptions& options);

struct LatencyOptions {
  std::string server;     ///< path of layfigure-server
  std::string character;  ///< of 60 joints, if the targets are to mean what they say
  bool quick{false};      ///< fewer messages
  bool json{false};
};
/// Between processes: from a pointer's message to the pose that contains its effect, over the broker and over multicast
/// (in a network of its own, where that is allowed); and what subscribers get beside one that has stopped and one that
/// is slow. Wall-clock times. Throws std::runtime_error if the server fails.
void latency(const LatencyOptions& options);

struct StressOptions {
  int scenes{10'000};  ///< of the stress test's random scenes, from seed 0 on
  bool json{false};
};
/// How long the random scenes take, and how many of their steps needed help.
void stress(const StressOptions& options);

}  // namespace layfigure::bench
