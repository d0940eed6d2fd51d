#include "topology.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fixture.h"
#include "small_doll.h"
#include "tube_rig.h"

namespace layfigure::skinning {
namespace {

using character::Rig;

/// The upper half of the triangles in a mesh of their own, with vertices of their own.
Rig in_two_meshes(const Rig& rig) {
  Rig split = rig;
  split.meshes.push_back(rig.meshes.front());
  auto& triangles = split.meshes[0].triangles;
  auto& others = split.meshes[1].triangles;
  triangles.resize(triangles.size() / 2);
  others.erase(others.begin(), others.begin() + static_cast<long>(triangles.size()));
  return split;
}

bool all_closed(const Topology& topology) {
  return std::all_of(topology.closed.begin(), topology.closed.end(), [](bool closed) { return closed; });
}

bool none_closed(const Topology& topology) {
  return std::none_of(topology.closed.begin(), topology.closed.end(), [](bool closed) { return closed; });
}

TEST(Topology, Tube_IsClosedAndNeighboursAreMutual) {
  const Skin skin(testing::tube_rig({}));
  const Topology topology = make_topology(skin);
  EXPECT_TRUE(all_closed(topology));
  for (int t = 0; t < static_cast<int>(topology.corners.size()); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const int other = topology.neighbours[t][corner];
      ASSERT_GE(other, 0);
      EXPECT_NE(other, t);
      EXPECT_EQ((topology.neighbours[other].array() == t).count(), 1);
      const auto& corners = topology.corners[other];
      for (const int shared : {(corner + 1) % 3, (corner + 2) % 3}) {
        EXPECT_EQ((corners.array() == topology.corners[t][shared]).count(), 1);
      }
    }
  }
}

TEST(Topology, TrianglesAround_AreThoseWithThatCorner) {
  const Skin skin(testing::tube_rig({}));
  const Topology topology = make_topology(skin);
  std::size_t total = 0;
  for (int point = 0; point < skin.vertex_count(); ++point) {
    total += topology.around(point).size();
    for (const int t : topology.around(point)) EXPECT_EQ((topology.corners[t].array() == point).count(), 1);
  }
  EXPECT_EQ(total, 3 * skin.triangles().size());
}

TEST(Topology, MissingTriangle_OpensItsPartOnly) {
  Rig rig = test::cube_rig();
  rig.meshes.push_back(rig.meshes.front());
  for (auto& vertex : rig.meshes[1].vertices) vertex.x() += 5.0;
  rig.meshes[1].triangles.pop_back();
  const Topology topology = make_topology(Skin(rig));
  for (std::size_t t = 0; t < topology.closed.size(); ++t) EXPECT_EQ(topology.closed[t], t < 12) << t;
  EXPECT_EQ(topology.neighbours[0].minCoeff() >= 0, true);
}

TEST(Topology, StripOfTriangles_IsOpen) { EXPECT_TRUE(none_closed(make_topology(Skin(testing::small_doll().rig)))); }

TEST(Topology, TriangleTurnedRound_OpensIt) {
  Rig rig = test::cube_rig();
  std::swap(rig.meshes[0].triangles[3][0], rig.meshes[0].triangles[3][1]);
  EXPECT_TRUE(none_closed(make_topology(Skin(rig))));
}

TEST(Topology, ThirdTriangleAtAnEdge_OpensIt) {
  Rig rig = test::cube_rig();
  rig.meshes[0].vertices.emplace_back(3, 3, 3);
  rig.meshes[0].influences.push_back({{0, 1.0}});
  rig.meshes[0].triangles.emplace_back(0, 1, 8);
  EXPECT_TRUE(none_closed(make_topology(Skin(rig))));
}

TEST(Topology, TubeInTwoMeshes_IsClosed) {
  const Skin skin(in_two_meshes(testing::tube_rig({})));
  EXPECT_EQ(skin.meshes().size(), 2U);
  EXPECT_TRUE(all_closed(make_topology(skin)));
}

TEST(Topology, MeshesBoundDifferently_ComeApartAndAreOpen) {
  Rig rig = in_two_meshes(testing::tube_rig({}));
  for (auto& influences : rig.meshes[1].influences) influences = {{0, 1.0}};
  EXPECT_TRUE(none_closed(make_topology(Skin(rig))));
}

TEST(Topology, NoTriangles_IsEmpty) {
  Rig rig = test::cube_rig();
  rig.meshes.clear();
  const Topology topology = make_topology(Skin(rig));
  EXPECT_TRUE(topology.corners.empty());
  EXPECT_TRUE(topology.closed.empty());
}

}  // namespace
}  // namespace layfigure::skinning
