#include "rig_bytes.h"

#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace layfigure::character {
namespace {

class Writer {
 public:
  template <class T>
  void plain(T* values, std::size_t count) {
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  template <class Container>
  void size(Container& container) {
    std::size_t count = container.size();
    plain(&count, 1);
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}
  template <class T>
  void plain(T* values, std::size_t count) {
    require(count * sizeof(T));
    std::memcpy(static_cast<void*>(values), bytes_.data() + done_, count * sizeof(T));
    done_ += count * sizeof(T);
  }
  template <class Container>
  void size(Container& container) {
    std::size_t count = 0;
    plain(&count, 1);
    require(count);  // every element takes a byte or more
    container.resize(count);
  }
  void finish() const {
    if (done_ != bytes_.size()) throw std::runtime_error("bytes left over after the rig");
  }

 private:
  void require(std::size_t count) const {
    if (count > bytes_.size() - done_) throw std::runtime_error("the rig's bytes end too early");
  }

  const std::string& bytes_;
  std::size_t done_{0};
};

// One description of the layout for both directions.

template <class Archive, class T>
requires std::is_arithmetic_v<T>
void transfer(Archive& archive, T& value) { archive.plain(&value, 1); }

template <class Archive, class T, int kRows, int kColumns>
void transfer(Archive& archive, Eigen::Matrix<T, kRows, kColumns>& matrix) {
  archive.plain(matrix.data(), static_cast<std::size_t>(matrix.size()));
}

template <class Archive>
void transfer(Archive& archive, Eigen::Isometry3d& pose) {
  transfer(archive, pose.matrix());
}

template <class Archive>
void transfer(Archive& archive, std::string& text) {
  archive.size(text);
  archive.plain(text.data(), text.size());
}

template <class Archive>
void transfer(Archive& archive, Influence& influence) {
  transfer(archive, influence.bone);
  transfer(archive, influence.weight);
}

template <class Archive>
void transfer(Archive& archive, Bone& bone) {
  transfer(archive, bone.name);
  transfer(archive, bone.parent);
  transfer(archive, bone.rest);
  transfer(archive, bone.bind);
}

template <class Archive, class T>
void transfer(Archive& archive, std::vector<T>& items) {
  archive.size(items);
  for (T& item : items) transfer(archive, item);
}

template <class Archive>
void transfer(Archive& archive, SkinnedMesh& mesh) {
  transfer(archive, mesh.name);
  transfer(archive, mesh.color);
  transfer(archive, mesh.vertices);
  transfer(archive, mesh.triangles);
  transfer(archive, mesh.influences);
}

template <class Archive>
void transfer(Archive& archive, Rig& rig) {
  transfer(archive, rig.name);
  transfer(archive, rig.source_file);
  transfer(archive, rig.bones);
  transfer(archive, rig.meshes);
  transfer(archive, rig.warnings);
  transfer(archive, rig.content_hash);
}

}  // namespace

std::string to_bytes(Rig rig) {
  Writer writer;
  transfer(writer, rig);
  return writer.take();
}

Rig from_bytes(const std::string& bytes) {
  Reader reader(bytes);
  Rig rig;
  transfer(reader, rig);
  reader.finish();
  return rig;
}

}  // namespace layfigure::character
