#pragma once

#include <string>

#include "stress_scene.h"

namespace layfigure::testing {

/// Writes the scene as JSON, every number to its last bit, with a line on what is wrong with it.
void write_scene(const StressScene& scene, const std::string& failure, const std::string& path);

/// Reads it again. Throws std::runtime_error that names the file and the field.
[[nodiscard]] StressScene read_scene(const std::string& path);

}  // namespace layfigure::testing
