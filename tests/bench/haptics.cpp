#include "haptics.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "subjects.h"

namespace layfigure::bench {
namespace {

const HapticsEffort kWhole{.contacts = 1'000'000,
                           .wrenches = 100'000'000,
                           .rest = 3600.0,
                           .pinch = 600.0,
                           .play = 600.0,
                           .rung = 1.1,
                           .dampings = {0.0, 1.0, 2.0, 4.0, 7.0, 10.0},
                           .frequencies = {0.5, 1.0, 2.0, 4.0, 7.0, 10.0},
                           .ticks = 100'000};
const HapticsEffort kQuick{.contacts = 1000,
                           .wrenches = 10'000,
                           .rest = 10.0,
                           .pinch = 5.0,
                           .play = 2.0,
                           .rung = 1.5,
                           .dampings = {1.0},
                           .frequencies = {4.0},
                           .ticks = 2000};

void write_walls(const std::vector<WallPoint>& points, const std::string& path, std::ofstream& file) {
  auto list = nlohmann::ordered_json::array();
  for (const WallPoint& point : points) {
    list.push_back(
        {{"rate_hz", point.rate_hz}, {"hand", point.hand}, {"damping", point.damping}, {"stiffness", point.stiffness}});
  }
  file << list.dump(1) << "\n";
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

using Tell = void (*)(const HapticsEffort& effort, std::vector<Figure>& figures);

struct Part {
  const char* name;
  Tell tell;  ///< null: that of the walls, which make a map as well
};

constexpr Part kParts[] = {{"device", tell_device}, {"walls", nullptr},        {"energy", tell_energy},
                           {"felt", tell_felt},     {"rest", tell_rest},       {"pinch", tell_pinch},
                           {"play", tell_play},     {"times", tell_tick_times}};

}  // namespace

std::vector<std::string> haptics_parts() {
  std::vector<std::string> names;
  for (const Part& part : kParts) names.emplace_back(part.name);
  return names;
}

void haptics(const HapticsOptions& options) {
  const HapticsEffort& effort = options.quick ? kQuick : kWhole;
  std::ofstream map;
  if (!options.z_width.empty()) map.open(options.z_width);
  if (!map) throw std::runtime_error(options.z_width + ": cannot be written");
  std::vector<Figure> figures;
  for (const auto& [name, tell] : kParts) {
    if (!options.parts.empty() && std::ranges::find(options.parts, name) == options.parts.end()) continue;
    if (tell != nullptr) {
      tell(effort, figures);
      continue;
    }
    const std::vector<WallPoint> walls = tell_walls(effort, figures);
    if (!options.z_width.empty()) write_walls(walls, options.z_width, map);
  }
  print(figures, options.json);
}

}  // namespace layfigure::bench
