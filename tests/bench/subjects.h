#pragma once

#include <string>
#include <vector>

/// The subjects of layfigure-bench. Each prints a table, or JSON when asked.
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
/// CPU time of a step of each order, per joint and solve.
void cost(const CostOptions& options);

}  // namespace layfigure::bench
