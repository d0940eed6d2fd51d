#include "source_reader.h"

#include <assimp/commonMetaData.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <new>
#include <stdexcept>
#include <unordered_map>

#include "fbx_limits.h"
#include "folder_io.h"
#include "source_material.h"
#include "text.h"
#include "unbound_skin.h"
#include "unit.h"

namespace layfigure::character {
namespace {

using Eigen::Affine3d;

constexpr std::size_t kMostNodes = 1U << 20U;
constexpr std::size_t kMostVertices = 20'000'000;

/// What is known of a format by the name of its reader: how it delivers the axes, and its unit.
struct Format {
  std::string_view name;  ///< part of the reader's own
  int up_axis{1};         ///< 0 x, 1 y, 2 z
  double metres_per_unit{1.0};
  bool unit_is_stated{false};
  bool skin_replaces_node{false};
  bool skeletons_are_read{true};
};

/// Those that differ from the default: Y up, no unit, most often metres. Most readers turn their format's axes to Y up
/// themselves. The games that SMD, MDL and MD5 were made for count in inches.
constexpr std::array kFormats{
    Format{.name = "glTF", .unit_is_stated = true, .skin_replaces_node = true},
    Format{.name = "Collada", .unit_is_stated = true},  // its reader has made metres of the unit
    Format{.name = "FBX", .unit_is_stated = true},      // and the up axis: see read_fbx_settings
    Format{.name = "XFile", .skin_replaces_node = true},
    Format{.name = "SMD", .up_axis = 2, .metres_per_unit = kInch},
    Format{.name = "Quake Mesh", .metres_per_unit = kInch},  // MDL of all kinds
    Format{.name = "MD5", .metres_per_unit = kInch},
    Format{.name = "Inter-Quake", .skeletons_are_read = false},
};

Affine3d to_affine(const aiMatrix4x4& m) {
  Affine3d pose = Affine3d::Identity();
  pose.linear() << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  pose.translation() << m.a4, m.b4, m.c4;
  return pose;
}

/// Right-handed rotation that takes the file's up axis (0 x, 1 y, 2 z; sign +-1) to Z.
Eigen::Quaterniond z_from_up(int axis, int sign) {
  return Eigen::Quaterniond::FromTwoVectors(sign * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::UnitZ());
}

Format format_of(const aiScene& scene) {
  aiString reader;
  if (scene.mMetaData != nullptr) scene.mMetaData->Get(AI_METADATA_SOURCE_FORMAT, reader);
  const std::string_view name = reader.C_Str();
  for (const Format& format : kFormats) {
    if (name.find(format.name) != std::string_view::npos) return format;
  }
  return {};
}

/// FBX counts in UnitScaleFactor centimetres and says which axis is up. Returns the up axis' sign.
int read_fbx_settings(const aiMetadata& settings, Format& format) {
  int axis = format.up_axis;
  int sign = 1;
  float factor = 1.0F;
  settings.Get("UpAxis", axis);
  settings.Get("UpAxisSign", sign);
  settings.Get("UnitScaleFactor", factor);
  if (axis >= 0 && axis <= 2) format.up_axis = axis;
  format.metres_per_unit = 0.01 * (std::isfinite(factor) && factor > 0.0F ? factor : 1.0F);
  return sign < 0 ? -1 : 1;
}

void set_axes_and_unit(const aiScene& scene, Format format, SourceScene& source) {
  int up_sign = 1;
  if (format.name == "FBX" && scene.mMetaData != nullptr) up_sign = read_fbx_settings(*scene.mMetaData, format);
  source.world_from_file = z_from_up(format.up_axis, up_sign) * Eigen::Scaling(format.metres_per_unit);
  source.metres_per_unit = format.metres_per_unit;
  source.unit_is_stated = format.unit_is_stated;
  source.skin_replaces_node = format.skin_replaces_node;
}

/// Nodes in the order of SourceScene::nodes, and where a name leads.
struct NodeList {
  std::vector<const aiNode*> nodes;
  std::unordered_map<std::string, int> index_of_name;  ///< by the file's own names
};

/// The node tree, depth first. Of several nodes with one name, bones mean the first that holds no mesh.
NodeList add_nodes(const aiScene& scene, const Format& format, SourceScene& source) {
  NodeList list;
  std::size_t mended = 0;
  std::vector<std::pair<const aiNode*, int>> pending{{scene.mRootNode, -1}};
  while (!pending.empty()) {
    const auto [node, parent] = pending.back();
    pending.pop_back();
    if (source.nodes.size() >= kMostNodes) throw std::runtime_error("it has more than a million nodes; remove some");
    const Affine3d local = to_affine(node->mTransformation);
    const int index = static_cast<int>(source.nodes.size());
    const bool has_object = node->mNumMeshes > 0;
    std::string name = node->mName.C_Str();
    const auto [entry, is_new] = list.index_of_name.try_emplace(name, index);
    if (!is_new && source.nodes[entry->second].has_object && !has_object) entry->second = index;
    mended += make_readable(name) ? 1 : 0;
    source.nodes.push_back(
        {std::move(name), parent, parent < 0 ? local : source.nodes[parent].pose * local, has_object});
    if (format.name == "FBX") source.nodes.back().limits = fbx_limits(*node, source.nodes.back().name, source.warnings);
    list.nodes.push_back(node);
    for (unsigned child = node->mNumChildren; child-- > 0;) pending.emplace_back(node->mChildren[child], index);
  }
  if (mended > 0) {
    source.warnings.push_back(std::to_string(mended) +
                              " names are not UTF-8 or hold control characters: read as Latin-1, with _ for those");
  }
  return list;
}

SourceJoint make_joint(const aiBone& bone, const aiMesh& mesh, int node, const std::string& mesh_name) {
  SourceJoint joint;
  joint.node = node;
  joint.offset = to_affine(bone.mOffsetMatrix);
  for (unsigned w = 0; w < bone.mNumWeights; ++w) {
    const aiVertexWeight& weight = bone.mWeights[w];
    if (weight.mVertexId >= mesh.mNumVertices) {
      throw std::runtime_error("mesh '" + mesh_name +
                               "' has a weight on a vertex that does not exist; export it again");
    }
    joint.weights.push_back({static_cast<int>(weight.mVertexId), weight.mWeight});
  }
  return joint;
}

/// The joint of the skin that a joint of that offset is nearest to in the bind pose.
const SourceJoint& nearest_joint(const std::vector<SourceJoint>& joints, const Affine3d& offset) {
  const Eigen::Vector3d place = offset.inverse().translation();
  return *std::min_element(joints.begin(), joints.end(), [&](const SourceJoint& a, const SourceJoint& b) {
    return (a.offset.inverse().translation() - place).norm() < (b.offset.inverse().translation() - place).norm();
  });
}

/// Makes a node for a bone that only the skin knows: where the skin has it, on the joint beside it.
int add_missing_node(const aiBone& bone, const SourceMesh& mesh, NodeList& list, SourceScene& scene) {
  std::string name = bone.mName.C_Str();
  const int node = static_cast<int>(scene.nodes.size());
  list.index_of_name.emplace(name, node);
  make_readable(name);
  if (mesh.joints.empty()) {
    throw std::runtime_error("mesh '" + mesh.name + "' is bound to bone '" + name +
                             "', which the file does not have; export the skeleton with the mesh");
  }
  const Affine3d offset = to_affine(bone.mOffsetMatrix);
  const SourceJoint& parent = nearest_joint(mesh.joints, offset);
  scene.warnings.push_back("bone '" + name + "' of mesh '" + mesh.name + "' is not in the skeleton: hung on '" +
                           scene.nodes[parent.node].name + "', the nearest one");
  scene.nodes.push_back({name, parent.node, scene.nodes[parent.node].pose * parent.offset * offset.inverse(), false});
  return node;
}

void add_joints(const aiMesh& mesh, NodeList& list, SourceScene& scene, SourceMesh& source) {
  std::vector<const aiBone*> missing;
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const auto node = list.index_of_name.find(bone.mName.C_Str());
    if (node == list.index_of_name.end()) {
      missing.push_back(&bone);
    } else {
      source.joints.push_back(make_joint(bone, mesh, node->second, source.name));
    }
  }
  for (const aiBone* bone : missing) {
    const int node = add_missing_node(*bone, source, list, scene);
    source.joints.push_back(make_joint(*bone, mesh, node, source.name));
  }
}

void add_triangles(const aiMesh& mesh, SourceMesh& source) {
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines
    const unsigned* corner = face.mIndices;
    if (corner[0] >= mesh.mNumVertices || corner[1] >= mesh.mNumVertices || corner[2] >= mesh.mNumVertices) {
      throw std::runtime_error("mesh '" + source.name +
                               "' has a face on a vertex that does not exist; export it again");
    }
    source.triangles.emplace_back(static_cast<int>(corner[0]), static_cast<int>(corner[1]),
                                  static_cast<int>(corner[2]));
  }
}

/// Normals, texture coordinates and material.
void add_looks(const aiScene& scene, const aiMesh& mesh, SourceScene& result, SourceMesh& source) {
  if (mesh.mMaterialIndex < scene.mNumMaterials) source.material = static_cast<int>(mesh.mMaterialIndex);
  const unsigned channel = texture_channel(scene, mesh);
  for (unsigned v = 0; v < mesh.mNumVertices && mesh.HasNormals(); ++v) {
    source.normals.emplace_back(mesh.mNormals[v].x, mesh.mNormals[v].y, mesh.mNormals[v].z);
  }
  for (unsigned v = 0; v < mesh.mNumVertices && mesh.HasTextureCoords(channel); ++v) {
    source.uvs.emplace_back(mesh.mTextureCoords[channel][v].x, mesh.mTextureCoords[channel][v].y);
  }
  if (source.uvs.empty() && has_texture(scene, mesh)) {
    result.warnings.push_back("mesh '" + source.name + "' has a texture, but no texture coordinates that can be read");
  }
  if (mesh.HasVertexColors(0)) {
    result.warnings.push_back("mesh '" + source.name + "' has vertex colours: left out");
  }
}

SourceMesh make_mesh(const aiScene& scene, const aiMesh& mesh, int node, NodeList& list, SourceScene& result) {
  SourceMesh source;
  source.name = mesh.mName.C_Str();
  make_readable(source.name);
  source.node = node;
  source.vertices.reserve(mesh.mNumVertices);
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    source.vertices.emplace_back(mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z);
  }
  add_looks(scene, mesh, result, source);
  add_triangles(mesh, source);
  add_joints(mesh, list, result, source);
  return source;
}

/// The meshes in the order of the nodes that hold them; one that several nodes hold is there several times.
void add_meshes(const aiScene& scene, NodeList list, SourceScene& source) {
  std::size_t vertices = 0;
  for (std::size_t index = 0; index < list.nodes.size(); ++index) {
    const aiNode& node = *list.nodes[index];
    for (unsigned m = 0; m < node.mNumMeshes; ++m) {
      if (node.mMeshes[m] >= scene.mNumMeshes) {
        throw std::runtime_error("node '" + source.nodes[index].name +
                                 "' holds a mesh that does not exist; export it again");
      }
      const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
      vertices += mesh.mNumVertices;
      if (vertices > kMostVertices) throw std::runtime_error("it has more than 20 million vertices; reduce its meshes");
      source.meshes.push_back(make_mesh(scene, mesh, static_cast<int>(index), list, source));
    }
  }
}

void configure(Assimp::Importer& importer) {
  // The parts of a node's pose as nodes of their own: limits of joints are measured between them (fbx_limits.h).
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_REMOVE_EMPTY_BONES, false);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // Nothing but the skinned mesh is wanted: no stick figures for files without a mesh, no animations, no hit boxes.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_ANIMATIONS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_MD5_NO_ANIM_AUTOLOAD, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_SMD_LOAD_ANIMATION_LIST, false);
  for (const char* part : {AI_CONFIG_IMPORT_MDL_HL1_READ_ANIMATIONS, AI_CONFIG_IMPORT_MDL_HL1_READ_ATTACHMENTS,
                           AI_CONFIG_IMPORT_MDL_HL1_READ_BONE_CONTROLLERS, AI_CONFIG_IMPORT_MDL_HL1_READ_HITBOXES,
                           AI_CONFIG_IMPORT_MDL_HL1_READ_MISC_GLOBAL_INFO}) {
    importer.SetPropertyBool(part, false);
  }
}

/// assimp's own message, apart from those that say nothing to users.
[[noreturn]] void refuse(const Assimp::Importer& importer) {
  try {
    if (importer.GetException()) std::rethrow_exception(importer.GetException());
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {  // the message is in the error string
  }
  const std::string message = importer.GetErrorString();
  if (message.empty() || message.starts_with("No suitable reader")) {
    throw std::runtime_error("it is broken, or not a format that is known; export it again as .glb");
  }
  if (message.starts_with("No meshes remaining")) {
    throw std::runtime_error("it has no triangles, only points or lines; export it with its mesh");
  }
  throw std::runtime_error(message + "; export it again");
}

void check_has_skin(const aiScene& scene, const Format& format) {
  if (scene.mNumMeshes == 0) {
    throw std::runtime_error("it has no mesh, at most a skeleton and its motion; export the character with its mesh");
  }
  if (!format.skeletons_are_read) {
    throw std::runtime_error("of this format only meshes can be read, not the skeleton; export it as .glb");
  }
}

}  // namespace

Reading read_source(const std::filesystem::path& path) {
  Assimp::Importer importer;
  configure(importer);
  FolderIo* io = new FolderIo(path);
  importer.SetIOHandler(io);  // which owns it from here on
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_SortByPType);
  if (scene == nullptr) refuse(importer);
  if (scene->mRootNode == nullptr) throw std::runtime_error("it has no scene; export it with its mesh and skeleton");
  const Format format = format_of(*scene);
  check_has_skin(*scene, format);
  Reading reading;
  set_axes_and_unit(*scene, format, reading.scene);
  add_meshes(*scene, add_nodes(*scene, format, reading.scene), reading.scene);
  add_materials(*scene, format.name == "glTF", std::filesystem::absolute(path).parent_path(), reading.scene);
  bind_unbound_skins(reading.scene);
  reading.digest = io->character_digest();
  reading.companions = io->companions();
  return reading;
}

std::string reader_version() {
  return "assimp " + std::to_string(aiGetVersionMajor()) + "." + std::to_string(aiGetVersionMinor()) + "." +
         std::to_string(aiGetVersionPatch()) + " " + std::to_string(aiGetVersionRevision());
}

}  // namespace layfigure::character
