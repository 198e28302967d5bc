// Notes about what of a scene does nothing, or not what its writer may have meant.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "kerf/base/random.h"
#include "kerf/scene/scene_file.h"
#include "session/make_session.h"

namespace kerf::session_notes_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// Strips lie flat, 200 x 24 x 3 mm, their length along x.
constexpr const char* kStrip =
    "[body]\nmodel = \"strip\"\n[simulation]\ntime_step = 0.01\ngravity = [0, 0, 0]\n";  // five lines

Scene scene_of(const std::string& text) {
  auto scene = parse_scene(text, "scene.toml");
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  return scene.ok() ? *scene : Scene{};
}
/// What is said at the start and in so many steps.
std::vector<std::string> notes_of(const std::string& text, int steps = 0) {
  Session session = test::make(scene_of(text));
  const Status done = session.step(steps);
  EXPECT_TRUE(done.ok()) << done.error().message;
  return session.notes();
}

TEST(SessionNotes, AKeyThatDecidesNothingIsNoted) {
  EXPECT_THAT(notes_of(std::string(kStrip) + "[cut]\nsnap = 0.04\n"),
              ElementsAre(StartsWith("[cut] snap decides nothing")));
}

TEST(SessionNotes, ARegionOfMaterialThatMarksNoCellIsNoted) {
  const std::string strip = kStrip;
  EXPECT_THAT(
      notes_of(strip + "[[material.region]]\nsphere = { center = [9, 9, 9], radius = 0.1 }\nyoung = 1\n"),
      ElementsAre(StartsWith("scene.toml:7: [[material.region]] number 1 marks nothing: the middle of no cell")));
  const std::string left =
      "[[material.region]]\nhalf_space = { point = [0, 0, 0], normal = [-1, 0, 0] }\nyoung = 1e5\n";
  const std::string all = "[[material.region]]\nhalf_space = { point = [9, 0, 0], normal = [-1, 0, 0] }\nyoung = 2e5\n";
  EXPECT_THAT(notes_of(strip + all + left), IsEmpty());
  EXPECT_THAT(notes_of(strip + left + all),
              ElementsAre(StartsWith("scene.toml:7: [[material.region]] number 1 changes nothing: later regions")));
}

TEST(SessionNotes, PointsFarFromTheBodyAreNoted) {
  const std::string strip = kStrip;
  const auto grasp = [&](const std::string& point) {
    return strip + "[[command]]\nat = 0\ntype = \"grasp\"\nid = \"g\"\npoint = " + point + "\n";
  };
  EXPECT_THAT(notes_of(grasp("[5, 5, 5]"), 1),
              ElementsAre(StartsWith("scene.toml:6: grasp 'g' takes hold 8.6 m away from its point")));
  EXPECT_THAT(notes_of(grasp("[5, 5, 5]\nframe = \"world\""), 1),
              ElementsAre(HasSubstr("(world coordinates, metres)")));
  EXPECT_THAT(notes_of(grasp("[5, 0, 0]\nradius = 6"), 1), IsEmpty());
  const auto load = [&](const std::string& point) {
    return strip + "[[load]]\npoint = " + point + "\nforce = [0, 0, 1e-4]\n";
  };
  EXPECT_THAT(notes_of(load("[5, 5, 5]"), 2),
              ElementsAre(StartsWith("scene.toml:7: [[load]] number 1 acts 8.6 m away from its point")));
  // Anywhere on the surface is near enough.
  for (const char* x : {"-0.1", "-0.0731", "0.0049", "0.0512", "0.1"})
    for (const char* y : {"-0.012", "-0.0057", "0.0009", "0.012"}) {
      const std::string point = std::string("[") + x + ", " + y + ", 0.0015]";
      EXPECT_THAT(notes_of(grasp(point), 1), IsEmpty()) << point;
      EXPECT_THAT(notes_of(load(point)), IsEmpty()) << point;
    }
}

TEST(SessionNotes, APunchThatCutsNothingIsNoted) {
  const auto punch = [](const std::string& rest) {
    return std::string(kStrip) + "[[command]]\nat = 0\ntype = \"punch\"\n" + rest;
  };
  EXPECT_THAT(notes_of(punch("point = [5, 5, 5]\nradius = 0.001\n"), 1),
              ElementsAre(StartsWith("scene.toml:6: the punch cut nothing: its outline meets no material along")));
  EXPECT_THAT(notes_of(punch("point = [0, 0, 0.1]\nradius = 0.005\nreach = 0.05\n"), 1),
              ElementsAre(HasSubstr("within its reach")));
  EXPECT_THAT(notes_of(punch("point = [0, 0, 0.1]\nradius = 0.005\ntake = true\n"), 1), IsEmpty());
  EXPECT_THAT(notes_of(punch("point = [0, 0, 0]\nradius = 10\n"), 1),
              ElementsAre(HasSubstr("it goes all around what lies inside: make it smaller")));
}

TEST(SessionNotes, ABladeThatCutsNothingIsNoted) {
  const auto blade = [](const std::string& rest) {
    return std::string(kStrip) + "[[command]]\nat = 0\ntype = \"blade\"\n" + rest;
  };
  EXPECT_THAT(
      notes_of(blade("poses = [{ time = 0, base = [0, -1, 1], tip = [0, -1, -1] }, { time = 0.001, base = [0, 1, 1], "
                     "tip = [0, 1, -1] }]\n"),
               1),
      IsEmpty());
  const std::string far =
      "poses = [{ time = 0, base = [5, 5, 5], tip = [5, 5, 4] }, { time = 0.01, base = [5, 6, 5], tip = [5, 6, 4] }]\n";
  EXPECT_THAT(notes_of(blade(far), 3),
              ElementsAre(AllOf(StartsWith("scene.toml:6: the blade cut nothing: its edge passes through no"),
                                HasSubstr("(world coordinates, metres); move its poses onto the body"))));
  EXPECT_THAT(notes_of(blade("frame = \"rest\"\n" + far), 3), ElementsAre(HasSubstr("(rest coordinates, metres)")));
  const std::string shallow =
      "poses = [{ time = 0, base = [0, -0.02, 0.01], tip = [0, -0.02, 0.0005] }, { time = 0.01, base = [0, 0.02, 0.01], tip = [0, 0.02, 0.0005] }]\n";
  EXPECT_THAT(notes_of(blade(shallow), 3),
              ElementsAre(AllOf(HasSubstr("its edge ends in the thickness, and passes through no uncut middle of it"),
                                HasSubstr("lead it deeper"))));
}

TEST(SessionNotes, AShaverThatMeetsNoCutIsNoted) {
  const std::string shaver =
      "[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.01\n[[command]]\nat = 0\ntype = \"shave\"\nradius = 0.001\n"
      "smoothing = 1\nposes = [{ time = 0, base = [5, 5, 5], tip = [5, 5, 4] }, { time = 0.01, base = [5, 6, 5], tip = [5, 6, 4] }]\n";
  EXPECT_THAT(notes_of(shaver, 3),
              ElementsAre(StartsWith("scene.toml:5: the shaver took nothing off: it meets no cut surface")));
}

TEST(SessionNotes, AnUnfixThatLetsGoOfNothingIsNoted) {
  const auto unfix = [](const char* x, const char* fixed) {
    return std::string(kStrip) + "[[fix]]\nsphere = { center = [" + fixed +
           ", 0, 0], radius = 0.05 }\n[[command]]\nat = 0\ntype = \"unfix\"\nsphere = { center = [" + x +
           ", 0, 0], radius = 0.05 }\n";
  };
  EXPECT_THAT(notes_of(unfix("-0.1", "-0.1"), 1), IsEmpty());
  for (const char* x : {"0.1", "9"})
    EXPECT_THAT(notes_of(unfix(x, "-0.1"), 1),
                ElementsAre(StartsWith("scene.toml:8: unfix lets go of nothing: no node that is held lies in")));
}

TEST(SessionNotes, RemovingNothingOrAWholeBodyIsNoted) {
  const std::string remove =
      "[[command]]\nat = 0.01\ntype = \"remove\"\nsphere = { center = [0, 0, 0], radius = 10 }\n";
  EXPECT_THAT(
      notes_of(kStrip + remove, 2),
      ElementsAre("scene.toml:6: remove took nothing away: the body is in one piece, and only loose pieces can go"));
  const std::string cut = "[[command]]\nat = 0\ntype = \"punch\"\npoint = [0, 0, 0]\nradius = 0.005\n";
  EXPECT_THAT(notes_of(kStrip + cut + remove, 2), IsEmpty());
  EXPECT_THAT(
      notes_of(kStrip + cut +
                   "[[command]]\nat = 0.01\ntype = \"remove\"\nsphere = { center = [0.09, 0, 0], radius = 0.005 }\n",
               2),
      ElementsAre(StartsWith("scene.toml:11: remove took nothing away: no loose piece reaches there")));
  const std::string two =
      "[[body]]\nmodel = \"strip\"\n[body.material]\ndensity = 2000\n[[body]]\nmodel = \"strip\"\nname = \"upper\"\nposition = [0, 0, 0.1]\n[simulation]\ntime_step = 0.01\ngravity = [0, 0, 0]\n";
  EXPECT_THAT(notes_of(two + remove, 2),
              ElementsAre(StartsWith("scene.toml:12: remove took all away that there was of upper")));
}

TEST(SessionNotes, AThicknessThatIsNotUsedIsNoted) {
  EXPECT_THAT(
      notes_of("[body]\nmodel = \"strip\"\nthickness = 0.5\n"),
      ElementsAre(
          "strip: the thickness of 0.5 m that was given is not used: the model is closed and says itself how thick it is"));
  EXPECT_THAT(notes_of("[body]\nmodel = \"sheet\"\nthickness = 0.05\n"), IsEmpty());
}

TEST(SessionNotes, ContactThatIsOffWithThingsToTouchIsNoted) {
  const std::string off = std::string(kStrip) + "[contact]\nenabled = false\n";
  EXPECT_THAT(notes_of(off), IsEmpty());
  EXPECT_THAT(notes_of(off + "[[tool]]\nid = \"a\"\nkind = \"probe\"\n[[obstacle]]\nshape = \"plane\"\n"),
              ElementsAre(AllOf(StartsWith("contact is off (enabled = false in [contact])"),
                                HasSubstr("1 obstacle and 1 tool;"))));
}

TEST(SessionNotes, ACommandThatBreaksOffAnotherIsNoted) {
  const std::string tools =
      std::string(kStrip) +
      "[[tool]]\nid = \"p\"\nkind = \"sphere\"\nposition = [0, 0, 0.05]\n[[tool]]\nid = \"q\"\nkind = \"sphere\"\n";
  const auto lead = [](const char* at, const char* id, const char* until) {
    return std::string("[[command]]\nat = ") + at + "\ntype = \"tool\"\nid = \"" + id +
           "\"\nposes = [{ time = " + until + ", position = [0, 0, 0.06] }]\n";
  };
  EXPECT_THAT(
      notes_of(tools + lead("0", "p", "0.5") + lead("0.1", "p", "0.1")),
      ElementsAre(
          "scene.toml:18: this command leads tool 'p' from 0.1 s on, and breaks off the one of line 13 that would have led it until 0.5 s"));
  EXPECT_THAT(notes_of(tools + lead("0", "p", "0.5") + lead("0.1", "q", "0.1")), IsEmpty());
  EXPECT_THAT(notes_of(tools + lead("0.1", "p", "0.2") + lead("0.3", "p", "0.1")), IsEmpty())
      << "0.1 + 0.2 is more than 0.3 in the last bit";
  const std::string held =
      std::string(kStrip) + "[[command]]\nat = 0\ntype = \"grasp\"\nid = \"g\"\npoint = [0.1, 0, 0]\n";
  EXPECT_THAT(
      notes_of(
          held +
          "[[command]]\nat = 0\ntype = \"move\"\nid = \"g\"\nby = [0, 0, 0.01]\nover = 0.5\n[[command]]\nat = 0.4\ntype = \"move\"\nid = \"g\"\nby = [0, 0, 0]\n"),
      ElementsAre(
          StartsWith("scene.toml:17: this command moves grasp 'g' from 0.4 s on, and breaks off the one of line 11")));
}

/// Two strips, one over the other, and an upright edge from z = -0.04 m, or `low`, to 0.06 m that goes through them in x = 0.
std::string knife(double low) {
  return "[[body]]\nmodel = \"strip\"\n[[body]]\nmodel = \"strip\"\nname = \"upper\"\nposition = [0, 0, 0.03]\n"
         "[simulation]\ntime_step = 0.01\ngravity = [0, 0, 0]\n"
         "[[fix]]\nhalf_space = { point = [0.09, 0, 0], normal = [1, 0, 0] }\n[[fix]]\nhalf_space = { point = [-0.09, 0, 0], normal = [-1, 0, 0] }\n"
         "[[tool]]\nid = \"k\"\nkind = \"scalpel\"\nrotation = [0, 0, 1.5708]\ntip = " +
         std::to_string(0.06 - low) + "\nwidth = 0.006\nposition = [0, -0.02, " + std::to_string(low) +
         "]\n"
         "[[command]]\nat = 0\ntype = \"tool\"\nid = \"k\"\nposes = [{ time = 0.2, position = [0, 0.02, " +
         std::to_string(low) + "] }]\n";
}

TEST(SessionNotes, WhatTheEdgeOfAToolGoesThroughIsNotedOnce) {
  Session session = test::make(scene_of(knife(-0.04)));
  ASSERT_TRUE(session.step(22).ok());
  EXPECT_EQ(session.counts().pieces, 3) << "one of the two is cut";
  EXPECT_THAT(session.notes(),
              ElementsAre(AllOf(StartsWith("while it cut "), HasSubstr("the edge of tool 'k' went through "))));
}

TEST(SessionNotes, AnEdgeThatReachesOneSheetOnlyIsNotNoted) {
  Session session = test::make(scene_of(knife(0.015)));
  ASSERT_TRUE(session.step(22).ok());
  EXPECT_EQ(session.counts().pieces, 3);
  EXPECT_THAT(session.notes(), IsEmpty());
}

// About one stroke in two thousand leaves a part of its path uncut, in tubes that are in many pieces: this does, in its 40th.
TEST(SessionNotes, WhatACutLeavesUncutIsNotedOnceAStroke) {
  std::size_t refused = 0;
  Session session = test::make(scene_of("[body]\nmodel = \"tube\"\n[cut]\ndust = 0\n"));
  Box3 box;
  for (const Vec3 p : session.body().complex.collision.rest.raw()) box.add(p);
  Random random(1);
  const auto somewhere = [&] {
    return box.center() + Vec3{random.uniform(-0.6, 0.6) * box.size().x, random.uniform(-0.6, 0.6) * box.size().y, 0};
  };
  for (int i = 0; i < 40; ++i) {
    const Vec3 up = norm(box.size()) * normalized(Vec3{0.3 * (i % 3), 0.2 * (i % 5), 1});
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, i % 2 == 1).ok());
    const int parts = 2 + random.index(3);
    Vec3 p = somewhere();
    for (int k = 0; k < parts; ++k) {
      const Vec3 q = somewhere();
      for (int j = 0; j <= 4; ++j)
        ASSERT_TRUE(session.move_blade(lerp(p, q, 0.25 * j) + up, lerp(p, q, 0.25 * j) - up).ok());
      p = q;
    }
    ASSERT_TRUE(session.end_stroke().ok());
    refused += session.strokes().back().refused > 0;
  }
  std::size_t uncut = 0;
  for (const std::string& note : session.notes()) {
    if (note.find("the blade leaned") != std::string::npos || note.find("blades leaned") != std::string::npos) continue;
    ++uncut;
    EXPECT_THAT(note, AllOf(StartsWith("a part of a cut near ("), HasSubstr("was left uncut: "),
                            HasSubstr("lead the blade there again")));
  }
  EXPECT_EQ(uncut, refused);
}

// Walls stand square on the mid-surface. A blade that leans in the plane that it sweeps is not noted.
TEST(SessionNotes, ABladeThatLeansSaysHowFarItsLipsLieBesideIt) {
  const auto notes = [](Vec3 lean) {
    Session session = test::make(scene_of("[body]\nmodel = \"steak\"\n"));
    Box3 box;
    for (const Vec3 p : session.body().complex.collision.rest.raw()) box.add(p);
    const Vec3 across{0.4 * box.size().x, 0, 0}, down = 0.2 * (Vec3{0, 0, 1} + lean);
    EXPECT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
    for (int k = -4; k <= 4; ++k) {
      const Vec3 p = box.center() + 0.25 * k * across;
      EXPECT_TRUE(session.move_blade(p + down, p - down).ok());
    }
    EXPECT_TRUE(session.end_stroke().ok());
    return session.notes();
  };
  EXPECT_THAT(notes({}), IsEmpty());
  EXPECT_THAT(notes({0.8, 0, 0}), IsEmpty());
  EXPECT_THAT(notes({0, std::tan(0.16), 0}), IsEmpty()) << "0.08 of the thickness";
  EXPECT_THAT(notes({0, std::tan(0.25), 0}), ElementsAre(HasSubstr(", 0.13 of the thickness, beside"))) << "14 degrees";
  EXPECT_THAT(notes({0, 0.8, 0}),
              ElementsAre(AllOf(StartsWith("the blade leaned: near ("),
                                HasSubstr("up to 0.0073 m, 0.4 of the thickness, beside where the blade"))))
      << "0.8 of half the thickness";
  EXPECT_THAT(notes({0, 3.5, 0}), ElementsAre(HasSubstr("up to 0.032 m, 1.8 of the thickness, beside where the blade")))
      << "by 74 degrees";
}

std::string tube_cut(const char* more) {
  return std::string(
             "[body]\nmodel = \"tube\"\n[simulation]\ntime_step = 0.01\ngravity = [0, 0, 0]\n[[command]]\nat = 0\ntype = \"blade\"\nframe = \"rest\"\n") +
         more +
         "poses = [{ time = 0, base = [0, -0.07, 0.1], tip = [0, -0.07, -0.1] }, { time = 0.1, base = [0, 0.07, 0.1], tip = [0, 0.07, -0.1] }]\n";
}

TEST(SessionNotes, ABladeThatGoesThroughTwoLayersSaysHowToCutBoth) {
  EXPECT_THAT(notes_of(tube_cut(""), 12),
              ElementsAre(AllOf(
                  StartsWith("scene.toml:6: while it cut body 1 (tube), the blade went through another layer of it"),
                  HasSubstr("through = true"))));
  EXPECT_THAT(notes_of(tube_cut("through = true\n"), 12), IsEmpty());
  EXPECT_THAT(notes_of(tube_cut("tool = \"line\"\n"), 12), IsEmpty()) << "a line of sight goes on behind what it cuts";
}

}  // namespace
}  // namespace kerf::session_notes_test
