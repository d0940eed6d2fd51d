// skin_dump CHARACTER: skins a character for each pose on standard input, one JSON object a line,
//     {"blend": "linear" | "dual_quaternion", "root_translation": [x, y, z], "rotations": [[w, x, y, z], ..]}
// as in doll::SkeletonPose, and writes the vertices of its meshes [m, world], one line for each pose:
//     [[[x, y, z], ..], ..]

#include <array>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "layfigure/character/import.h"
#include "layfigure/skinning/posed_skin.h"

namespace {

using namespace layfigure;
using nlohmann::json;

skinning::Blend read_blend(const std::string& name) {
  if (name == "linear") return skinning::Blend::kLinear;
  if (name == "dual_quaternion") return skinning::Blend::kDualQuaternion;
  throw std::invalid_argument("blend '" + name + "', expected linear or dual_quaternion");
}

doll::SkeletonPose read_pose(const json& line, std::size_t bones) {
  doll::SkeletonPose pose;
  const auto translation = line.at("root_translation").get<std::array<double, 3>>();
  pose.root_translation = Eigen::Vector3d(translation.data());
  for (const json& rotation : line.at("rotations")) {
    const auto [w, x, y, z] = rotation.get<std::array<double, 4>>();
    pose.rotations.emplace_back(w, x, y, z);
  }
  if (pose.rotations.size() == bones) return pose;
  throw std::invalid_argument(std::to_string(pose.rotations.size()) + " rotations, expected " + std::to_string(bones));
}

json vertices(const skinning::PosedSkin& posed) {
  json meshes = json::array();
  for (const auto& [first, count] : posed.skin().meshes()) {
    json& points = meshes.emplace_back(json::array());
    for (const Eigen::Vector3d& p : posed.positions().subspan(first, count)) points.push_back({p.x(), p.y(), p.z()});
  }
  return meshes;
}

void run(const char* character) {
  const skinning::Skin skin(character::import_rig(character));
  for (std::string text; std::getline(std::cin, text);) {
    const json line = json::parse(text);
    skinning::PosedSkin posed(skin, read_blend(line.at("blend")));
    posed.pose(read_pose(line, skin.bones().size()));
    std::cout << vertices(posed) << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw std::invalid_argument("usage: skin_dump CHARACTER < poses");
    run(argv[1]);
  } catch (const std::exception& error) {
    std::cerr << "skin_dump: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
