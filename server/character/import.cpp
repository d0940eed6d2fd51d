#include "layfigure/character/import.h"

#include <assimp/commonMetaData.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "convert.h"
#include "file_check.h"
#include "isolate.h"
#include "rig_bytes.h"
#include "source_scene.h"

// The only file that sees assimp: it turns a scene of assimp's into a SourceScene.
namespace layfigure::character {
namespace {

using Eigen::Affine3d;

constexpr std::size_t kMostNodes = 1U << 20U;
constexpr std::size_t kMostVertices = 20'000'000;

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

bool starts_with(const std::string& text, const char* prefix) { return text.rfind(prefix, 0) == 0; }

std::string source_format(const aiScene& scene) {
  aiString format;
  if (scene.mMetaData != nullptr) scene.mMetaData->Get(AI_METADATA_SOURCE_FORMAT, format);
  return format.C_Str();
}

/// FBX counts in UnitScaleFactor centimetres and says which axis is up; the other formats arrive in metres, Y up.
Affine3d world_from_file(const aiScene& scene, const std::string& format) {
  int up_axis = 1;
  int up_sign = 1;
  double metres = 1.0;
  if (format.find("FBX") != std::string::npos && scene.mMetaData != nullptr) {
    scene.mMetaData->Get("UpAxis", up_axis);
    scene.mMetaData->Get("UpAxisSign", up_sign);
    float factor = 1.0F;
    scene.mMetaData->Get("UnitScaleFactor", factor);
    if (std::isfinite(factor) && factor > 0.0F) metres = 0.01 * factor;
  }
  if (up_axis < 0 || up_axis > 2) up_axis = 1;
  return Affine3d(z_from_up(up_axis, up_sign < 0 ? -1 : 1) * Eigen::Scaling(metres));
}

/// The node tree, depth first; `indices` finds the first node of a name.
void add_nodes(const aiScene& scene, SourceScene& source, std::map<std::string, int>& indices,
               std::map<const aiNode*, int>& index_of) {
  std::vector<std::pair<const aiNode*, int>> pending{{scene.mRootNode, -1}};
  while (!pending.empty()) {
    const auto [node, parent] = pending.back();
    pending.pop_back();
    if (source.nodes.size() >= kMostNodes) throw std::runtime_error("it has more than a million nodes; remove some");
    const Affine3d local = to_affine(node->mTransformation);
    const int index = static_cast<int>(source.nodes.size());
    source.nodes.push_back(
        {node->mName.C_Str(), parent, parent < 0 ? local : source.nodes[parent].pose * local, node->mNumMeshes > 0});
    indices.try_emplace(source.nodes.back().name, index);
    index_of[node] = index;
    for (unsigned child = node->mNumChildren; child-- > 0;) pending.emplace_back(node->mChildren[child], index);
  }
}

Eigen::Vector3d base_color(const aiScene& scene, const aiMesh& mesh) {
  aiColor4D color(0.8F, 0.8F, 0.8F, 1.0F);
  const aiMaterial& material = *scene.mMaterials[mesh.mMaterialIndex];
  if (material.Get(AI_MATKEY_BASE_COLOR, color) != AI_SUCCESS) material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
  const Eigen::Vector3d rgb(color.r, color.g, color.b);
  return rgb.allFinite() ? Eigen::Vector3d(rgb.cwiseMax(0.0).cwiseMin(1.0)) : Eigen::Vector3d::Constant(0.8);
}

void add_joints(const aiMesh& mesh, const std::map<std::string, int>& indices, SourceMesh& source) {
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const auto node = indices.find(bone.mName.C_Str());
    if (node == indices.end()) {
      throw std::runtime_error("mesh '" + source.name + "' is bound to bone '" + bone.mName.C_Str() +
                               "', which the file does not have; export the skeleton with the mesh");
    }
    SourceJoint joint;
    joint.node = node->second;
    joint.offset = to_affine(bone.mOffsetMatrix);
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      const aiVertexWeight& weight = bone.mWeights[w];
      if (weight.mVertexId >= mesh.mNumVertices) {
        throw std::runtime_error("mesh '" + source.name +
                                 "' has a weight on a vertex that does not exist; export it again");
      }
      joint.weights.push_back({static_cast<int>(weight.mVertexId), weight.mWeight});
    }
    source.joints.push_back(std::move(joint));
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

SourceMesh make_mesh(const aiScene& scene, const aiMesh& mesh, int node, const std::map<std::string, int>& indices) {
  SourceMesh source;
  source.name = mesh.mName.C_Str();
  source.node = node;
  source.color = base_color(scene, mesh);
  source.vertices.reserve(mesh.mNumVertices);
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    source.vertices.emplace_back(mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z);
  }
  add_triangles(mesh, source);
  add_joints(mesh, indices, source);
  return source;
}

SourceScene to_source(const aiScene& scene) {
  SourceScene source;
  const std::string format = source_format(scene);
  source.world_from_file = world_from_file(scene, format);
  source.skin_replaces_node = starts_with(format, "glTF");
  std::map<std::string, int> indices;
  std::map<const aiNode*, int> index_of;
  add_nodes(scene, source, indices, index_of);
  std::size_t vertices = 0;
  for (const auto& [node, index] : index_of) {
    for (unsigned m = 0; m < node->mNumMeshes; ++m) vertices += scene.mMeshes[node->mMeshes[m]]->mNumVertices;
  }
  if (vertices > kMostVertices) throw std::runtime_error("it has more than 20 million vertices; reduce its meshes");
  std::vector<const aiNode*> nodes(source.nodes.size());
  for (const auto& [node, index] : index_of) nodes[index] = node;
  for (int index = 0; index < static_cast<int>(nodes.size()); ++index) {
    for (unsigned m = 0; m < nodes[index]->mNumMeshes; ++m) {
      source.meshes.push_back(make_mesh(scene, *scene.mMeshes[nodes[index]->mMeshes[m]], index, indices));
    }
  }
  return source;
}

/// assimp's own message, apart from the one that it has for all files that no reader recognises.
std::string refusal(const std::string& message) {
  if (starts_with(message, "No suitable reader")) {
    return "it is broken, or not a format that is known; export it again as .glb";
  }
  return message + "; export it again";
}

Rig read(const std::filesystem::path& path) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_REMOVE_EMPTY_BONES, false);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_SortByPType);
  if (scene == nullptr) throw std::runtime_error(refusal(importer.GetErrorString()));
  if (scene->mRootNode == nullptr) throw std::runtime_error("it has no scene; export it with its mesh and skeleton");
  return convert(to_source(*scene));
}

/// One line, whatever a library put into its message.
std::string one_line(std::string text) {
  for (char& c : text) {
    if (std::iscntrl(static_cast<unsigned char>(c)) != 0) c = ' ';
  }
  return text;
}

}  // namespace

Rig import_rig(const std::filesystem::path& path) {
  check_file(path);
  try {
    // assimp crashes on some broken files, so it reads in a process of its own.
    Rig rig = from_bytes(run_isolated([&] { return to_bytes(read(path)); }));
    rig.name = path.stem().string();
    rig.source_file = path.filename().string();
    return rig;
  } catch (const std::exception& error) {
    throw ImportError("character " + path.string() + ": " + one_line(error.what()));
  }
}

}  // namespace layfigure::character
