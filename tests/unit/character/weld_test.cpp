#include <gtest/gtest.h>

#include "skin.h"

namespace layfigure::character {
namespace {

/// A tetrahedron with three vertices of its own for each face, as a flat-shaded export has it.
SkinnedMesh unjoined_tetrahedron() {
  const Eigen::Vector3d corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  SkinnedMesh mesh;
  for (const auto& face : faces) {
    const int first = static_cast<int>(mesh.vertices.size());
    for (const int corner : face) {
      mesh.vertices.push_back(corners[corner]);
      mesh.influences.push_back({{corner, 1.0}});
    }
    mesh.triangles.emplace_back(first, first + 1, first + 2);
  }
  return mesh;
}

TEST(Weld, FacesWithVerticesOfTheirOwn_ShareThem) {
  SkinnedMesh mesh = unjoined_tetrahedron();
  const double volume6 = signed_volume6(mesh, Eigen::Vector3d::Zero());
  weld(mesh);
  EXPECT_EQ(mesh.vertices.size(), 4U);
  EXPECT_EQ(mesh.influences.size(), 4U);
  EXPECT_EQ(mesh.triangles.size(), 4U);
  EXPECT_DOUBLE_EQ(volume6, 1.0);
  EXPECT_DOUBLE_EQ(signed_volume6(mesh, Eigen::Vector3d::Zero()), volume6);
}

TEST(Weld, EqualPlacesOfUnequalWeight_StayApart) {
  SkinnedMesh mesh = unjoined_tetrahedron();
  mesh.influences[0] = {{3, 1.0}};
  weld(mesh);
  EXPECT_EQ(mesh.vertices.size(), 5U);
}

TEST(Weld, TriangleWithTwoEqualCorners_IsDropped) {
  SkinnedMesh mesh = unjoined_tetrahedron();
  mesh.vertices[1] = mesh.vertices[0];
  mesh.influences[1] = mesh.influences[0];
  weld(mesh);
  EXPECT_EQ(mesh.triangles.size(), 3U);
}

}  // namespace
}  // namespace layfigure::character
