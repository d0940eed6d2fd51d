#include "looks.h"

#include <map>

namespace layfigure::character {
namespace {

/// Copies items from one list to another as they are asked for, each once, and numbers them anew.
template <class Item>
class Selection {
 public:
  Selection(const std::vector<Item>& all, std::vector<Item>& chosen) : all_(all), chosen_(chosen) {}

  /// The new index of an item; -1 stays.
  int choose(int index) {
    if (index < 0) return index;
    const auto [entry, is_new] = index_of_.try_emplace(index, static_cast<int>(chosen_.size()));
    if (is_new) chosen_.push_back(all_[index]);
    return entry->second;
  }

 private:
  const std::vector<Item>& all_;
  std::vector<Item>& chosen_;
  std::map<int, int> index_of_;
};

}  // namespace

void add_looks(const SourceScene& scene, Rig& rig) {
  Selection materials(scene.materials, rig.materials);
  for (SkinnedMesh& mesh : rig.meshes) mesh.material = materials.choose(mesh.material);
  Selection images(scene.images, rig.images);
  for (Material& material : rig.materials) material.image = images.choose(material.image);
}

}  // namespace layfigure::character
