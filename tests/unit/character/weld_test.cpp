#include <gtest/gtest.h>

#include "skin.h"
#include "weld.h"

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

/// The tetrahedron with one normal for all, and one texture coordinate or, with seams, one for each face.
SkinnedMesh shaded_tetrahedron(bool seams) {
  SkinnedMesh mesh = unjoined_tetrahedron();
  for (int face = 0; face < 4; ++face) {
    for (int corner = 0; corner < 3; ++corner) {
      mesh.wedges.normals.emplace_back(0.0F, 0.0F, 1.0F);
      mesh.wedges.uvs.emplace_back(seams ? static_cast<float>(face) : 0.5F, 0.25F);
    }
  }
  return mesh;
}

TEST(Weld, WedgesThatAgree_AreTheVertices) {
  SkinnedMesh mesh = shaded_tetrahedron(false);
  weld(mesh);
  EXPECT_EQ(mesh.vertices.size(), 4U);
  EXPECT_EQ(mesh.wedges.normals.size(), 4U);
  EXPECT_EQ(mesh.wedges.uvs.size(), 4U);
  EXPECT_TRUE(mesh.wedges.triangles.empty());
}

TEST(Weld, Seams_KeepAWedgeForEachSide) {
  SkinnedMesh mesh = shaded_tetrahedron(true);
  weld(mesh);
  ASSERT_EQ(mesh.vertices.size(), 4U);
  EXPECT_EQ(mesh.wedges.normals.size(), 12U);  // three faces meet at each of four vertices
  ASSERT_EQ(mesh.wedges.uvs.size(), 12U);
  ASSERT_EQ(mesh.wedges.triangles.size(), 4U);
  for (int face = 0; face < 4; ++face) {
    for (int corner = 0; corner < 3; ++corner) {
      const int wedge = mesh.wedges.triangles[face][corner];
      EXPECT_EQ(mesh.wedges.uvs[wedge].x(), static_cast<float>(face));
      if (wedge < 4) {
        EXPECT_EQ(wedge, mesh.triangles[face][corner]);  // the first wedges are those of the vertices
      }
    }
  }
}

TEST(Weld, WedgesOfOneVertexThatAgree_AreOne) {
  SkinnedMesh mesh = shaded_tetrahedron(true);
  for (Eigen::Vector2f& uv : mesh.wedges.uvs) uv.x() = uv.x() < 1.5F ? 0.0F : 1.0F;  // two charts of two faces each
  weld(mesh);
  EXPECT_EQ(mesh.wedges.uvs.size(), 8U);
}

TEST(Weld, TriangleThatIsDropped_TakesItsWedgesAlong) {
  SkinnedMesh mesh = shaded_tetrahedron(true);
  mesh.vertices[1] = mesh.vertices[0];
  mesh.influences[1] = mesh.influences[0];
  weld(mesh);
  ASSERT_EQ(mesh.wedges.triangles.size(), 3U);
  for (const int wedge : mesh.wedges.triangles[0]) EXPECT_EQ(mesh.wedges.uvs[wedge].x(), 1.0F);  // of the second face
}

}  // namespace
}  // namespace layfigure::character
