// Layers that are bonded: a scalpel cuts as deep as its edge reaches, a blade led flat between two of them parts them, and undo brings all of it back.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "kerf/scene/scene_file.h"
#include "kerf/session/session.h"
#include "session/make_session.h"
#include "support/source_dir.h"

namespace kerf::bonded_bodies_test {
namespace {

using test::make;

void expect_valid(const Session& session) {
  const Status valid = session.validate();
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

SceneBody layer(const char* name, double bottom, double thickness, double young) {
  SceneBody body;
  body.name = name;
  body.model = "closed-sheet";
  body.options.visual_triangles = 1500;
  body.options.collision_triangles = 72;
  body.size = Vec3{0.12, 0.09, thickness};
  body.position = {0, 0, bottom + thickness / 2};
  body.material.young = young;
  body.material.density = 1000;
  return body;
}

SceneBond bond(const char* lower, const char* upper) {
  SceneBond b;
  b.lower = lower;
  b.upper = upper;
  b.strength = 5e3;
  b.toughness = 30;
  return b;
}

/// Muscle 10 mm, fat 8, skin 2, from z = 0 up; the muscle is held from below.
Scene pad() {
  Scene scene;
  scene.body = layer("muscle", 0, 0.010, 50e3);
  scene.more_bodies = {layer("fat", 0.010, 0.008, 20e3), layer("skin", 0.018, 0.002, 200e3)};
  scene.bonds = {bond("muscle", "fat"), bond("fat", "skin")};
  SceneFix& fix = scene.fixes.emplace_back();
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {0, 0, 0.0005};
  fix.region.normal = {0, 0, -1};
  scene.simulation.time_step = 0.005;
  return scene;
}

/// Across the whole pad at this x, to this depth, in steps.
void cut_across(Session& session, double x, double deep) {
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kWorld, true).ok());
  for (int i = 0; i <= 24; ++i) {
    const double y = -0.06 + 0.005 * i;
    const Status done = session.move_blade({x, y, 0.05}, {x, y, deep});
    ASSERT_TRUE(done.ok()) << done.error().message;
    ASSERT_TRUE(session.step(1).ok());
  }
  ASSERT_TRUE(session.end_stroke().ok());
}

/// kg of each piece, ascending.
std::vector<double> masses(const Session& session) {
  std::vector<double> out = session.piece_masses().mass;
  std::sort(out.begin(), out.end());
  return out;
}

TEST(BondedBodies, PointsCoverTheSkinsThatFaceEachOther) {
  const Session session = make(pad());
  const Session::BondState bonds = session.bonds();
  EXPECT_NEAR(bonds.area, 2 * 0.12 * 0.09, 1e-9);
  EXPECT_GE(bonds.points, 2u * 16 * 81);
  EXPECT_EQ(bonds.torn, 0u);
  for (const Vec3 p : session.bond_places())
    EXPECT_NEAR(std::min(std::abs(p.z - 0.010), std::abs(p.z - 0.018)), 0, 1e-9);
}

TEST(BondedBodies, HoldTheirWeightAndStayAtRest) {
  Session session = make(pad());
  ASSERT_TRUE(session.step(100).ok());
  EXPECT_EQ(session.bonds().torn, 0u);
  for (const double d : session.bond_damage()) EXPECT_EQ(d, 0);
  expect_valid(session);
}

TEST(BondedBodies, AScalpelThatEndsInTheSecondLayerLeavesTheThirdWhole) {
  Session session = make(pad());
  ASSERT_TRUE(session.step(5).ok());
  const auto before = session.snapshot();
  const std::uint64_t hash = session.hash();
  const std::vector<Vec3> places = session.node_positions();
  const std::vector<double> damage = session.bond_damage();
  const double whole = session.bonds().stored;
  cut_across(session, 0.013, 0.0115);
  expect_valid(session);
  EXPECT_EQ(session.counts().pieces, 5);
  const std::vector<double> kg = masses(session);
  ASSERT_EQ(kg.size(), 5u);
  const double left = (0.06 + 0.013) / 0.12, area = 0.12 * 0.09 * 1000;
  const std::vector<double> want = {0.002 * (1 - left) * area, 0.002 * left * area, 0.008 * (1 - left) * area,
                                    0.008 * left * area, 0.010 * area};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(kg[i] / want[i], 1, 0.02) << i;
  EXPECT_EQ(session.bonds().torn, 0u);  // the blade stands upright on them
  ASSERT_TRUE(session.step(40).ok());
  expect_valid(session);
  const double stored = session.bonds().stored;
  const std::uint64_t cut = session.hash();
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.counts().pieces, 3);
  EXPECT_EQ(session.node_positions(), places);
  EXPECT_EQ(session.bonds().stored, whole);
  EXPECT_EQ(session.bond_damage(), damage);
  expect_valid(session);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.counts().pieces, 5);
  EXPECT_EQ(session.hash(), cut);
  EXPECT_EQ(session.bonds().stored, stored);
  expect_valid(session);
  session.restore(before);
  EXPECT_EQ(session.hash(), hash);
}

TEST(BondedBodies, OneThatEndsInTheFirstLayerCutsTheFirstAlone) {
  Session session = make(pad());
  cut_across(session, 0.0, 0.0185);
  EXPECT_EQ(session.counts().pieces, 4);
  expect_valid(session);
}

TEST(BondedBodies, ABladeLedFlatBetweenTwoLayersPartsThem) {
  Session session = make(pad());
  ASSERT_TRUE(session.step(5).ok());
  const std::uint64_t hash = session.hash();
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  // Along the boundary of skin and fat, under half of the skin.
  for (int i = 0; i <= 13; ++i) {
    const double x = 0.065 - 0.005 * i;
    ASSERT_TRUE(session.move_blade({x, -0.06, 0.018}, {x, 0.06, 0.018}).ok());
  }
  ASSERT_TRUE(session.end_stroke().ok());
  EXPECT_EQ(session.counts().pieces, 3);
  EXPECT_NEAR(session.bonds().torn_area, 0.06 * 0.09, 0.03 * 0.06 * 0.09);
  EXPECT_EQ(session.undo_depth(), 1);
  const std::uint64_t cut = session.hash();
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.hash(), hash);
  EXPECT_EQ(session.bonds().torn, 0u);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.hash(), cut);
  ASSERT_TRUE(session.step(40).ok());
  expect_valid(session);
}

/// A pose takes the provisional tip of the last one back, and the copies that the next tip makes have the numbers of those.
TEST(BondedBodies, AProvisionalTipLeavesEachBondWithItsOwnMaterial) {
  Session session = make(pad());
  ASSERT_TRUE(session.step(2).ok());
  const auto began = session.snapshot();
  const std::vector<std::vector<Vec2>> ways = {
      {{-0.0412, -0.0289}, {-0.0412, -0.0191}, {-0.0412, -0.0123}},
      {{0.0491, -0.0155}, {0.0447, -0.0155}, {0.0334, -0.0155}},
      {{0.0134, -0.0148}, {0.0134, -0.0008}, {0.0134, 0.0131}, {0.0134, 0.0278}, {0.0202, 0.0278}}};
  for (const std::vector<Vec2>& way : ways) {
    session.restore(began);
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kWorld, true).ok());
    for (const Vec2 at : way) {
      ASSERT_TRUE(session.step(1).ok());
      ASSERT_TRUE(session.move_blade({at.x, at.y, 0.05}, {at.x, at.y, 0.0115}).ok());
      expect_valid(session);
    }
    const auto middle = session.snapshot();
    ASSERT_TRUE(session.step(5).ok());
    expect_valid(session);
    const std::uint64_t hash = session.hash();
    session.restore(middle);  // finds all bonds anew
    ASSERT_TRUE(session.step(5).ok());
    EXPECT_EQ(session.hash(), hash) << way[0].x;
  }
}

/// Takes hold of the skin beside its cut at x = 0, on the right, and moves it.
void push_right_lip(Session& session, Vec3 by, double over) {
  const auto& rest = session.body().complex.collision.rest;
  std::vector<CollisionVertex> lip;
  for (const CollisionVertex v : ids<CollisionVertex>(rest.size()))
    if (rest[v].z > 0.0185 && rest[v].x > 0.001 && rest[v].x < 0.025) lip.push_back(v);
  ASSERT_FALSE(lip.empty());
  ASSERT_TRUE(session.grasp("lip", lip).ok());
  SceneCommand push;
  SceneMove move;
  move.id = "lip";
  move.by = by;
  move.over = over;
  push.what = move;
  ASSERT_TRUE(session.apply(push).ok());
  ASSERT_TRUE(session.step(static_cast<int>(over / session.time_step())).ok());
}

TEST(BondedBodies, LipsOfACutThatArePressedTogetherStayApart) {
  for (const bool contact : {false, true}) {
    Scene scene = pad();
    scene.contact.enabled = contact;
    Session session = make(scene);
    cut_across(session, 0.0, 0.0185);
    push_right_lip(session, {-0.006, 0, 0}, 0.3);
    expect_valid(session);
    EXPECT_EQ(session.bonds().torn, 0u);
    const CollisionMesh& mesh = session.body().complex.collision;
    // Of vertices at one place at rest: how far the right lip lies left of the left one.
    const std::vector<Vec3>& now = session.collision_positions();
    double through = 0;
    std::vector<std::pair<CollisionVertex, bool>> lips;
    for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count()))
      for (int k = 0; k < 3; ++k) {
        const CollisionVertex v = mesh.origin[CollisionMesh::corner(t, k)];
        double middle = 0;
        for (int m = 0; m < 3; ++m) middle += mesh.rest[mesh.origin[CollisionMesh::corner(t, m)]].x;
        if (mesh.rest[v].z > 0.0185 && std::abs(mesh.rest[v].x) < 1e-3) lips.emplace_back(v, middle > 0);
      }
    for (const auto& [right, is_right] : lips)
      for (const auto& [left, is_right_too] : lips)
        if (is_right && !is_right_too && right != left && norm(mesh.rest[right] - mesh.rest[left]) < 1e-6)
          through = std::max(through, now[left.index()].x - now[right.index()].x);
    if (contact) EXPECT_LT(through, 2e-4);
    else EXPECT_GT(through, 1e-3);
  }
}

/// With 50 mm asked for there is one point a triangle, and what is torn is known by that.
TEST(BondedBodies, TornSkinsLieOnEachOtherWhateverSpacingWasAskedFor) {
  Scene scene = pad();
  for (SceneBond& b : scene.bonds) b.spacing = 0.05;
  Session session = make(scene);
  ASSERT_TRUE(session.step(1).ok());
  EXPECT_TRUE(session.contacts().empty());
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  for (int i = 0; i <= 13; ++i) {
    const double x = 0.065 - 0.005 * i;
    ASSERT_TRUE(session.move_blade({x, -0.06, 0.018}, {x, 0.06, 0.018}).ok());
  }
  ASSERT_TRUE(session.end_stroke().ok());
  ASSERT_TRUE(session.step(20).ok());
  EXPECT_FALSE(session.contacts().empty());
}

TEST(BondedBodies, WhatIsStoredIsThatOfTheBodyAsItIs) {
  Scene scene = pad();
  scene.contact.enabled = false;
  Session session = make(scene);
  ASSERT_TRUE(session.step(10).ok());
  const double before = session.bonds().stored;
  EXPECT_GT(before, 0);
  const auto whole = session.snapshot();
  cut_across(session, 0.013, 0.0115);
  const double after = session.bonds().stored;
  const auto cut = session.snapshot();
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.bonds().stored, before);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.bonds().stored, after);
  session.restore(whole);
  EXPECT_EQ(session.bonds().stored, before);
  session.restore(cut);
  EXPECT_EQ(session.bonds().stored, after);
}

TEST(BondedBodies, WhatWouldTakeAwayOrShaveIsRefusedAndChangesNothing) {
  Session session = make(pad());
  ASSERT_TRUE(session.step(1).ok());
  const std::uint64_t hash = session.hash();
  SceneCommand command;
  ScenePunch punch;
  punch.point = {0, 0, 0.019};
  punch.axis = {0, 0, -1};
  punch.radius = 0.01;
  punch.take = true;
  command.what = punch;
  const Status punched = session.apply(command);
  ASSERT_FALSE(punched.ok());
  EXPECT_NE(punched.error().message.find("leave out `take`"), std::string::npos) << punched.error().message;
  EXPECT_EQ(session.hash(), hash);
  EXPECT_EQ(session.undo_depth(), 0);
  punch.take = false;
  command.what = punch;
  EXPECT_TRUE(session.apply(command).ok());
  EXPECT_GT(session.counts().pieces, 3);
  for (const Status& refused :
       {Status(session.remove_piece(CollisionTriangle(0)).error()),
        Status(session.shave({{0, 0, 0.03}, {0, 0, 0.02}, 0.003}, SceneFrame::kRest, 1, 0.001).error())})
    EXPECT_NE(refused.error().message.find("take the bonds out of the scene"), std::string::npos)
        << refused.error().message;
}

/// The pad is pressed down by 2 mm, four times as far as a blade may pass from a bond that it severs.
TEST(BondedBodies, ABladeInTheWorldPartsThemWhereTheyAreNow) {
  Scene scene = pad();
  scene.contact.enabled = false;
  scene.simulation.gravity = {0, 0, -200};
  for (SceneBond& b : scene.bonds) b.strength = 1e3;
  Session session = make(scene);
  ASSERT_TRUE(session.step(100).ok());
  const auto& rest = session.body().complex.collision.rest;
  double skin = 0;
  int count = 0;
  for (const CollisionVertex v : ids<CollisionVertex>(rest.size()))
    if (std::abs(rest[v].z - 0.019) < 1e-6) skin += session.collision_positions()[v.index()].z, ++count;
  const double z = skin / count - 0.001;
  EXPECT_GT(0.018 - z, 0.0015);
  for (const bool where_it_was : {true, false}) {
    const auto before = session.snapshot();
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kWorld, true).ok());
    for (int i = 0; i <= 13; ++i) {
      const double x = 0.065 - 0.005 * i, height = where_it_was ? 0.018 : z;
      ASSERT_TRUE(session.move_blade({x, -0.06, height}, {x, 0.06, height}).ok());
    }
    ASSERT_TRUE(session.end_stroke().ok());
    EXPECT_NEAR(session.bonds().torn_area, where_it_was ? 0 : 0.06 * 0.09, 0.03 * 0.06 * 0.09);
    session.restore(before);
  }
}

TEST(BondedBodies, WhatIsPulledOffTears) {
  Scene scene = pad();
  scene.contact.enabled = false;
  Session session = make(scene);
  SceneCommand hold;
  SceneGrasp grasp;
  grasp.id = "corner";
  grasp.point = {0.06, 0.045, 0.019};
  grasp.radius = 0.02;
  hold.what = grasp;
  ASSERT_TRUE(session.apply(hold).ok());
  SceneCommand pull;
  SceneMove move;
  move.id = "corner";
  move.by = Vec3{-0.02, -0.02, 0.04};
  move.over = 0.8;
  pull.what = move;
  ASSERT_TRUE(session.apply(pull).ok());
  const auto began = session.snapshot();
  std::vector<double> damage = session.bond_damage();
  for (int i = 0; i < 160; ++i) {
    ASSERT_TRUE(session.step(1).ok());
    for (std::size_t p = 0; p < damage.size(); ++p) EXPECT_GE(session.bond_damage()[p], damage[p]);
    damage = session.bond_damage();
  }
  const Session::BondState bonds = session.bonds();
  EXPECT_GT(bonds.torn, 50u);
  EXPECT_LT(bonds.torn, bonds.points / 2);
  EXPECT_NEAR(bonds.dissipated / bonds.torn_area / 30, 1.3, 0.35);  // with what is torn in part
  expect_valid(session);
  const std::uint64_t hash = session.hash();
  session.restore(began);
  ASSERT_TRUE(session.step(160).ok());
  EXPECT_EQ(session.hash(), hash);
}

TEST(BondedBodies, WhatCannotBeIsAnError) {
  Scene scene = pad();
  scene.bonds[0].lower = "bone";
  EXPECT_NE(Session::create(scene).error().message.find("there is no body \"bone\""), std::string::npos);
  scene = pad();
  scene.bonds[1].lower = "skin";
  EXPECT_NE(Session::create(scene).error().message.find("to itself"), std::string::npos);
  scene = pad();
  scene.bonds[1].lower = "muscle";
  EXPECT_NE(Session::create(scene).error().message.find("no skin of \"skin\" is within"), std::string::npos);
  scene = pad();
  scene.more_bodies[1].name = "fat";
  scene.bonds.pop_back();
  EXPECT_NE(Session::create(scene).error().message.find("bodies number 2 and 3 are both named \"fat\""),
            std::string::npos);
  scene = pad();
  scene.bonds[1].stiffness = 1e3;
  EXPECT_NE(Session::create(scene).error().message.find("[[bond]] number 2: bond: toughness 30 J/m2 must be more than"),
            std::string::npos);
}

TEST(BondedBodies, ASpacingThatTakesTooManyPointsIsRefusedWithOneThatDoesNot) {
  Scene scene = pad();
  scene.bonds[1].spacing = 1e-5;
  const std::string message = Session::create(scene).error().message;
  EXPECT_NE(message.find("[[bond]] number 2: spacing 1e-05 m takes 216"), std::string::npos) << message;
  const std::size_t at = message.find("give ");
  ASSERT_NE(at, std::string::npos);
  const double enough = std::stod(message.substr(at + 5));
  // 72 triangles of 83^2 points are fewer, of 84^2 more.
  EXPECT_NEAR(enough, std::sqrt(2 * 0.12 * 0.09 / 72) / 83, 0.05 * enough);
}

TEST(BondedBodies, FinePointsStandAtTheSpacingThatWasAskedFor) {
  Scene scene = pad();
  scene.bonds = {bond("fat", "skin")};
  for (SceneBody& body : scene.more_bodies) body.options.collision_triangles = 32;
  scene.bonds[0].spacing = 3.6e-4;
  EXPECT_GE(make(scene).bonds().points, 32u * 72 * 72);
}

TEST(BondedBodies, TheShippedPadHasTheStrengthsThatItAsksFor) {
  const auto scene = read_scene(test::source_dir() + "/scenes/suture-pad.toml");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  const Session session = make(*scene);
  for (const std::string& note : session.notes()) EXPECT_EQ(note.find("[[bond]]"), std::string::npos) << note;
}

TEST(BondedBodies, NotesNameTheModeThatWasLoweredAndTheStiffnessThatWasRaised) {
  Scene scene = pad();
  scene.bonds = {bond("fat", "skin")};
  const auto note_of = [&] {
    const Session session = make(scene);
    for (const std::string& note : session.notes())
      if (note.find("[[bond]]") != std::string::npos) return note;
    return std::string();
  };
  scene.bonds[0].strength = 100;
  EXPECT_EQ(note_of(), "");
  scene.bonds[0].shear_strength = 1e6;
  EXPECT_NE(note_of().find("Pa against sliding at its toughness"), std::string::npos) << note_of();
  EXPECT_EQ(note_of().find("opening"), std::string::npos) << note_of();
  scene.bonds[0].shear_strength.reset();
  scene.bonds[0].strength = 300;
  scene.bonds[0].stiffness = 4000;
  EXPECT_NE(note_of().find("its stiffness is 6e+03 Pa/m instead of 4e+03"), std::string::npos) << note_of();
}

}  // namespace
}  // namespace kerf::bonded_bodies_test
