#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace layfigure::character {

/// How far the file lets a bone turn: its rotation from the reference is taken apart into turns about the axes J, and
/// each angle is bounded.
struct BoneLimits {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  Eigen::Quaterniond axes{Eigen::Quaterniond::Identity()};       ///< R_BJ
  Eigen::Quaterniond reference{Eigen::Quaterniond::Identity()};  ///< R_PB at which all angles are zero
  Eigen::Vector3d lower{Eigen::Vector3d::Constant(-kInfinity)};  ///< about x, y, z of J [rad]; infinite: none
  Eigen::Vector3d upper{Eigen::Vector3d::Constant(kInfinity)};   ///< [rad], >= lower
};

/// A bone of the skeleton, as the file has it, converted to the world's units and axes (metres, Z up, no scale).
struct Bone {
  std::string name;
  int parent{-1};                                         ///< index of an earlier bone, -1 for a root
  Eigen::Isometry3d rest{Eigen::Isometry3d::Identity()};  ///< X_PB where the file poses it; a root's: X_WB
  Eigen::Isometry3d bind{Eigen::Isometry3d::Identity()};  ///< X_WB when the mesh was bound to it
  std::optional<BoneLimits> limits{};                     ///< none: the file says nothing; a root never has some
};

/// Weight of one bone on one vertex.
struct Influence {
  int bone{0};
  double weight{0.0};  ///< in (0, 1]; a vertex's weights sum to 1
};

/// How a texture goes on outside of 0..1.
enum class Wrap : int { kRepeat, kClamp, kMirror };

/// How a surface looks. Its base colour texture is a file (`texture`) or a picture that the character's file holds
/// (`image`), or there is none.
struct Material {
  std::string name;                           ///< as the file has it: may be empty, or another material's too
  Eigen::Vector3d base_color{0.8, 0.8, 0.8};  ///< linear RGB in 0..1, times the texture's colour
  double opacity{1.0};                        ///< in 0..1, times the texture's alpha if that counts
  bool texture_alpha{false};                  ///< the texture's alpha counts
  double alpha_cutoff{0.0};                   ///< in 0..1; > 0: what has less alpha is not there, all else is opaque
  std::string texture;                        ///< path with /, from the character's folder unless absolute; unchecked
  int image{-1};                              ///< into Rig::images
  std::array<Wrap, 2> wrap{Wrap::kRepeat, Wrap::kRepeat};  ///< along u and v
};

/// A picture that the character's file holds, in the bytes of that picture's own format.
struct Image {
  std::string name;    ///< for people; neither unique nor a path
  std::string format;  ///< "png", "jpg", "tga" or what else the file says
  std::string bytes;
};

/// What of a mesh's looks can differ between triangles that share a vertex. A wedge is a vertex with one normal and one
/// texture coordinate, as one or more corners of triangles have it (Hoppe, Efficient implementation of progressive
/// meshes, 1998). Wedge k is of vertex k, where there are so many; further ones follow.
struct Wedges {
  std::vector<Eigen::Vector3f> normals;    ///< per wedge, unit, world; empty: the file has none
  std::vector<Eigen::Vector2f> uvs;        ///< per wedge, (0, 0) is the texture's lower left corner; empty: none
  std::vector<Eigen::Vector3i> triangles;  ///< wedges of each triangle's corners; empty: those of its vertices
};

/// A skinned triangle mesh in its bind pose, world axes, metres; vertices joined.
struct SkinnedMesh {
  std::string name;
  int material{-1};  ///< into Rig::materials; -1: the file names none
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;          ///< counter-clockwise seen from outside
  std::vector<std::vector<Influence>> influences;  ///< one list per vertex, heaviest first, never empty
  Wedges wedges;
};

/// A rigged character as plain data.
struct Rig {
  std::string name;
  std::string source_file;    ///< base name
  std::string source_folder;  ///< absolute; empty if its name is not UTF-8
  std::vector<Bone> bones;    ///< parents before children
  std::vector<SkinnedMesh> meshes;
  std::vector<Material> materials;    ///< each is of one mesh or more
  std::vector<Image> images;          ///< each is of one material or more; at most kMostImageBytes in all
  std::vector<std::string> warnings;  ///< one line each: what of the file was mended or left out
  std::uint64_t content_hash{0};      ///< of bones, meshes and their looks: equal hashes, equal characters
};

/// Of all pictures of a character; further ones are left out. They are sent to clients with the meshes, of whose
/// queues they take a third (messaging::SendLimits).
inline constexpr std::size_t kMostImageBytes = 32U << 20U;

}  // namespace layfigure::character
