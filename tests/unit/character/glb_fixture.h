#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace layfigure::character::test {

/// A binary glTF file in the making: change `json` and `data` at will, then write it.
struct GlbFile {
  nlohmann::json json;
  std::vector<char> data;

  /// Bytes of the whole file.
  [[nodiscard]] std::string bytes() const;
  /// Overwrites one float of an accessor.
  void set_float(int accessor, int index, float value);
};

/// Adds an accessor of values and returns its index; `type` is "VEC2" and so on.
int add_floats(GlbFile& file, const std::vector<float>& values, const char* type, int components);
int add_shorts(GlbFile& file, const std::vector<std::uint16_t>& values, const char* type, int components);

/// Adds bytes as a picture in the file and returns its index among the images.
int add_image(GlbFile& file, const std::string& bytes, const std::string& mime_type);

/// A square bar, 0.2 m wide and 2 m high (glTF: along Y), skinned to the bones "low" (from y = 0) and "high" (from y =
/// 1), half and half at the ring between; "tip", a joint of the skin at y = 2, weighs upon nothing. Below "armature".
/// Node indices: 0 armature, 1 low, 2 high, 3 tip, 4 bar (the mesh). Accessors: see kPositions and so on.
[[nodiscard]] GlbFile make_bar();

inline constexpr int kPositions = 0;
inline constexpr int kIndices = 1;
inline constexpr int kJoints = 2;
inline constexpr int kWeights = 3;
inline constexpr int kInverseBinds = 4;

/// A folder of its own for the running test, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Writes a file in it and returns its path.
  std::filesystem::path write(const std::string& name, const std::string& bytes) const;

 private:
  std::filesystem::path path_;
};

}  // namespace layfigure::character::test
