// Pages that watch a session which a program leads.
#include <gmock/gmock.h>

#include <atomic>
#include <optional>
#include <thread>

#include "engine_table.h"
#include "kerf/engine/led_session.h"
#include "kerf/scene/scene_file.h"

namespace kerf::engine_watch_test {
namespace {

using namespace kerf::test;

/// A program's session.
struct Program {
  Session session;
  std::shared_ptr<LedSession> led;
  std::uint64_t changes = 1;

  Program() : session(make()), led(std::make_shared<LedSession>(session)) {}
  static Session make() {
    auto scene = parse_scene(steak().text, "steak", "");
    EXPECT_TRUE(scene.ok());
    auto made = Session::create(*scene);
    EXPECT_TRUE(made.ok());
    return std::move(made).value();
  }
  Engine watched() {
    led->enter();
    auto engine = Engine::watch(led, steak(), {});
    led->leave(++changes);
    EXPECT_TRUE(engine.ok());
    return std::move(engine).value();
  }
  template <class Work>
  void does(Work&& work) {
    led->enter();
    work();
    led->leave(++changes);
  }
  void cut(double x) {
    does([&] {
      ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
      for (const double y : {-0.10, -0.02, 0.02}) ASSERT_TRUE(session.move_blade({x, y, 0.05}, {x, y, -0.05}).ok());
      ASSERT_TRUE(session.end_stroke().ok());
    });
  }
};

TEST(EngineWatch, PagesSeeWhatTheProgramDoes) {
  Program program;
  Table table(program.watched());
  const std::uint32_t page = table.join();
  table.tick();
  EXPECT_EQ(table.pages[page].holder, 0u);
  EXPECT_EQ(table.pages[page].flags & 1u, 0u) << "nothing moves";
  const auto start = program.session.snapshot();
  for (int round = 0; round < 2; ++round) {
    program.cut(0);
    table.tick();
    table.expect_mirrored(page);
    program.does([&] { ASSERT_TRUE(program.session.step(5).ok()); });
    program.cut(0.03);  // two calls between ticks
    program.does([&] { ASSERT_TRUE(program.session.undo().ok()); });
    table.tick();
    table.expect_mirrored(page);
    EXPECT_DOUBLE_EQ(table.pages[page].time, program.session.time());
    EXPECT_EQ(table.pages[page].flags & 1u, 1u) << "it plays";
    program.does([&] { program.session.restore(start); });
    table.tick();
    table.expect_mirrored(page);
  }
  table.tick(60);
  EXPECT_EQ(table.pages[page].flags & 1u, 0u) << "it stands still again";
  EXPECT_GT(table.pages[page].patches, 3u);
  const std::uint32_t late = table.join();
  table.expect_mirrored(late);
}

TEST(EngineWatch, TicksTakeNoSteps) {
  Program program;
  Table table(program.watched());
  const std::uint32_t page = table.join();
  table.tick(100);
  EXPECT_EQ(program.session.step_count(), 0);
  EXPECT_LT(table.pages[page].frames, 20u) << "where nothing moves a frame now and then is enough";
}

TEST(EngineWatch, ToolsAndCommandsAreRefused) {
  Program program;
  Table table(program.watched());
  const std::uint32_t page = table.join();
  const std::uint64_t before = program.session.hash();
  table.cut(page, {{0, -0.1, 0}, {0, 0.02, 0}});
  for (const std::uint32_t code : {1u, kStep, kReset, kUndo, kRedo, kFixAll, kRecording, kUnit})
    table.tell(page, page_command(9, code, {1, 0, 0, 0}));
  table.tell(page, page_claim(true));
  table.tick();
  EXPECT_EQ(program.session.hash(), before);
  EXPECT_EQ(table.pages[page].holder, 0u);
  ASSERT_GE(table.pages[page].errors.size(), 17u);
  for (const auto& error : table.pages[page].errors) {
    EXPECT_EQ(error.code, 3u);
    EXPECT_THAT(error.text, testing::HasSubstr("program leads"));
  }
  table.pages[page].errors.clear();
  table.tell(page, page_command(9, kOverlay, {1, 0, 0, 0}));
  table.tell(page, page_command(9, kExport, {0, 0, 0, 0}, "obj"));
  EXPECT_TRUE(table.pages[page].errors.empty());
  table.tick();
  EXPECT_EQ(table.pages[page].files.size(), 2u);
}

TEST(EngineWatch, WhatNobodyWatchesDoesNotPileUp) {
  Program program;
  Engine engine = program.watched();
  program.cut(0);
  for (int i = 0; i < 60; ++i) engine.tick(1.0 / 60);
  std::optional<SessionChanges> left;
  program.does([&] { left = program.session.take_changes(); });
  EXPECT_TRUE(left->visual_triangles.empty() && !left->everything);
}

TEST(EngineWatch, PagesAndTheProgramInThreads) {
  Program program;
  Table table(program.watched());
  const std::uint32_t page = table.join();
  std::atomic<bool> done = false;
  std::atomic<int> hellos = 0;
  std::thread server([&] {
    while (!done) {
      table.tick();
      table.tell(page, page_hello());  // the whole body anew
      ++hellos;
      std::this_thread::yield();
    }
  });
  for (int round = 0; round < 5; ++round) {
    program.does([&] {
      for (int i = 0; i < 5; ++i) {
        auto step = program.session.step();
        ASSERT_TRUE(step.ok());
        program.led->stepped(*step);
        program.led->let_look(++program.changes);
      }
    });
    program.cut(0.01 * round);
    if (round % 2 == 1) program.does([&] { ASSERT_TRUE(program.session.undo().ok()); });
    while (hellos <= round) std::this_thread::yield();
  }
  done = true;
  server.join();
  table.tick();
  table.expect_mirrored(page);
  EXPECT_GT(table.pages[page].bodies, 3u);
}

TEST(LedSession, WhoWaitsLooksBetweenTwoSteps) {
  Program program;
  LedSession& led = *program.led;
  std::atomic<bool> looked = false;
  led.enter();
  std::thread page([&] {
    const LedSession::Look look(led);
    looked = static_cast<bool>(look);
  });
  while (!looked) led.let_look(++program.changes);
  led.leave(++program.changes);
  page.join();
}

TEST(LedSession, WhoWaitsGoesWhenItEnds) {
  Program program;
  LedSession& led = *program.led;
  led.enter();
  std::atomic<int> looked = -1;
  std::thread page([&] {
    const LedSession::Look look(led);
    looked = look ? 1 : 0;
  });
  led.end();
  page.join();
  EXPECT_EQ(looked, 0);
  led.leave(1);
  led.enter();  // the program goes on
  led.leave(2);
  EXPECT_FALSE(LedSession::Look(led));
}

}  // namespace
}  // namespace kerf::engine_watch_test
