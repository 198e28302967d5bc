#include "kerf/cutting/face_boxes.h"

#include <gtest/gtest.h>

#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "kerf/cutting/collision_split.h"
#include "support/synthetic_complex.h"

namespace kerf::face_boxes_test {
namespace {

using namespace testing_support;

Box3 box_of(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionTriangle f) {
  Box3 box;
  for (int i = 0; i < 3; ++i) box.add(position[mesh.from(CollisionMesh::corner(f, i)).index()]);
  return box;
}

/// All triangles whose own box meets a region must be met, in rising order.
void expect_complete(const CollisionMesh& mesh, std::span<const Vec3> position, const FaceBoxes& boxes,
                     Random& random) {
  for (int k = 0; k < 10; ++k) {
    const Vec3 at{random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.1, 0.1)};
    const double r = random.uniform(0, 0.1);
    const Box3 region{at - Vec3{r, r, r}, at + Vec3{r, r, r}};
    std::vector<CollisionTriangle> expected, found;
    for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count()))
      if (boxes_meet(box_of(mesh, position, f), region)) expected.push_back(f);
    CollisionTriangle last{-1};
    boxes.for_each([&](const Box3& box) { return boxes_meet(box, region); },
                   [&](CollisionTriangle f) {
                     EXPECT_LT(last, f);
                     last = f;
                     if (boxes_meet(box_of(mesh, position, f), region)) found.push_back(f);
                   });
    EXPECT_EQ(found, expected);
  }
}

TEST(FaceBoxes, MeetWhatComparingAllTrianglesMeetsWhileAMeshIsCutAndRestored) {
  SyntheticOptions options;
  options.subdivisions = 1;
  CellComplex body = make_synthetic_complex(sheet_65_mesh(), options);
  CutScratch scratch;
  const CutOptions cut_options;
  Random random(3);
  FaceBoxes boxes;
  JournalMark start;
  journal_mark(body, start);
  const CollisionMesh& mesh = body.collision;
  const auto first = body.collision.origin.mark();
  const std::size_t faces_at_first = mesh.face_count();
  for (int round = 0; round < 150; ++round) {
    // Bits of cuts anywhere, some taken back; now and then everything.
    JournalMark mark;
    journal_mark(body, mark);
    const auto origin = body.collision.origin.mark();
    const std::size_t faces = mesh.face_count();
    const CollisionTriangle face(random.next() % faces);
    const CollisionHalfEdge corner = CollisionMesh::corner(face, 0);
    const Vec2 middle = 0.3 * mesh.planar[corner] + 0.3 * mesh.planar[CollisionMesh::next(corner)] +
                        0.4 * mesh.planar[CollisionMesh::prev(corner)];
    cut::CutContext context{body, cut_options, scratch};
    scratch.flip_stack.clear();
    const bool done = cut::split_collision_face(context, face, middle, {0.3, 0.3, 0.4}).valid();
    if (done) {
      cut::flip_to_delaunay(context);
    } else {
      journal_rollback(body, mark);
      continue;
    }
    const auto mark_changed = [&](auto since) {
      mesh.origin.for_each_changed(since, [&](CollisionHalfEdge h) { boxes.mark(CollisionMesh::face(h)); });
    };
    mark_changed(origin);
    if (random.next() % 2 == 0) {
      boxes.refresh(mesh, mesh.rest.raw());
      expect_complete(mesh, mesh.rest.raw(), boxes, random);
    }
    if (random.next() % 3 == 0) {
      mark_changed(origin);
      boxes.shrink(faces);
      journal_rollback(body, mark);
    } else if (round % 40 == 39) {
      mark_changed(first);
      boxes.shrink(faces_at_first);
      journal_rollback(body, start);
    }
    boxes.refresh(mesh, mesh.rest.raw());
    expect_complete(mesh, mesh.rest.raw(), boxes, random);
  }
  std::vector<Vec3> moved;
  for (const Vec3 p : mesh.rest.raw()) moved.push_back({p.x + 0.1, p.y, p.z + 0.3 * p.x});
  boxes.forget();
  boxes.refresh(mesh, moved);
  expect_complete(mesh, moved, boxes, random);
}

}  // namespace
}  // namespace kerf::face_boxes_test
