#include "file_check.h"

#include <array>
#include <cstdint>
#include <fstream>
#include <string>

#include "layfigure/character/import.h"

namespace layfigure::character {
namespace {

constexpr std::uintmax_t kLargestFile = 4ULL << 30;  // a GLB cannot be larger; an honest character is far below
constexpr std::size_t kGlbHeader = 12;

std::uint32_t little_endian(const unsigned char* bytes) {
  return bytes[0] | bytes[1] << 8U | bytes[2] << 16U | static_cast<std::uint32_t>(bytes[3]) << 24U;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw ImportError("character " + path.string() + ": " + why);
}

void check_glb_header(const std::filesystem::path& path, std::uintmax_t size) {
  std::array<unsigned char, kGlbHeader> header{};
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(header.data()), kGlbHeader);
  if (stream.gcount() != kGlbHeader || little_endian(header.data()) != 0x46546C67U) {  // "glTF"
    refuse(path, "it is not a binary glTF file, whatever its name says; export it again as .glb");
  }
  if (little_endian(header.data() + 4) != 2U) refuse(path, "it is glTF 1; export it again as glTF 2");
  const std::uint32_t length = little_endian(header.data() + 8);
  if (length > size) {
    refuse(path, "it is truncated: " + std::to_string(size) + " of " + std::to_string(length) +
                     " bytes are there; copy or export it again");
  }
}

}  // namespace

void check_file(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) refuse(path, "there is no such file; check the path");
  if (std::filesystem::is_directory(status)) refuse(path, "it is a folder; name the character's file in it");
  if (!std::filesystem::is_regular_file(status)) refuse(path, "it is not a regular file");
  const auto size = std::filesystem::file_size(path, error);
  if (error || !std::ifstream(path, std::ios::binary)) refuse(path, "it cannot be read; check its permissions");
  if (size == 0) refuse(path, "it is empty; export it again");
  if (size > kLargestFile) refuse(path, "it is larger than 4 GB; reduce its meshes");
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".glb") check_glb_header(path, size);
}

}  // namespace layfigure::character
