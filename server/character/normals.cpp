#include "normals.h"

#include <Eigen/Geometry>

namespace layfigure::character {
namespace {

/// Normal of a triangle, as long as twice its area.
Eigen::Vector3d area_normal(const SkinnedMesh& mesh, const Eigen::Vector3i& t) {
  const Eigen::Vector3d& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

const std::vector<Eigen::Vector3i>& wedge_triangles(const SkinnedMesh& mesh) {
  return mesh.wedges.triangles.empty() ? mesh.triangles : mesh.wedges.triangles;
}

/// The vertex of each wedge.
std::vector<int> wedge_vertices(const SkinnedMesh& mesh) {
  std::vector<int> vertices(mesh.wedges.normals.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) vertices[v] = static_cast<int>(v);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) vertices[wedge_triangles(mesh)[t][k]] = mesh.triangles[t][k];
  }
  return vertices;
}

}  // namespace

Eigen::Matrix3d normal_map(const Eigen::Matrix3d& linear) {
  Eigen::Matrix3d cofactors;
  for (int k = 0; k < 3; ++k) cofactors.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
  return linear.determinant() < 0.0 ? Eigen::Matrix3d(-cofactors) : cofactors;
}

Eigen::Vector3f unit_or_zero(const Eigen::Vector3d& normal) {
  const double largest = normal.cwiseAbs().maxCoeff();  // squares of huge or tiny numbers are none
  if (!normal.allFinite() || largest == 0.0) return Eigen::Vector3f::Zero();
  return (normal / largest).normalized().cast<float>();
}

void mend_normals(SkinnedMesh& mesh, std::vector<std::string>& warnings) {
  std::vector<Eigen::Vector3f>& normals = mesh.wedges.normals;
  std::size_t mended = 0;
  for (const Eigen::Vector3f& normal : normals) mended += normal.isZero(0.0F) ? 1 : 0;
  if (mended == 0) return;
  std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (const int vertex : t) sums[vertex] += area_normal(mesh, t);
  }
  const std::vector<int> vertices = wedge_vertices(mesh);
  for (std::size_t wedge = 0; wedge < normals.size(); ++wedge) {
    if (!normals[wedge].isZero(0.0F)) continue;
    normals[wedge] = unit_or_zero(sums[vertices[wedge]]);
    if (normals[wedge].isZero(0.0F)) normals[wedge] = Eigen::Vector3f::UnitZ();
  }
  warnings.push_back("mesh '" + mesh.name + "': " + std::to_string(mended) +
                     " normals have no direction: made of the triangles beside them");
}

double facing_area(const SkinnedMesh& mesh) {
  if (mesh.wedges.normals.empty()) return 0.0;
  double sum = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3d normal = area_normal(mesh, mesh.triangles[t]);
    for (const int wedge : wedge_triangles(mesh)[t]) sum += normal.dot(mesh.wedges.normals[wedge].cast<double>());
  }
  return sum;
}

}  // namespace layfigure::character
