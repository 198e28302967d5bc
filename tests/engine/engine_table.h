// An engine and its pages without sockets: every message is carried over at once.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>
#include <vector>

#include "kerf/engine/drawn_body.h"
#include "kerf/engine/engine.h"
#include "page_messages.h"

namespace kerf::test {

inline constexpr std::uint32_t kScalpel = 0, kGrasp = 1, kFix = 2, kRelease = 3, kLine = 4;
inline constexpr std::uint32_t kDown = 0, kMove = 1, kUp = 2, kCancel = 3;
inline constexpr std::uint32_t kPlay = 1, kPause = 2, kStep = 3, kReset = 5, kUndo = 6, kRedo = 7, kScene = 8,
                               kGravity = 9, kMaterial = 10, kExport = 11, kRecording = 12, kOverlay = 13,
                               kLoadUpload = 14, kFixAll = 15, kStopLoading = 16, kUnit = 17, kContacts = 18;
inline constexpr Point kEye{0.02, -0.05, 0.6};

inline SceneSource steak() {
  SceneSource source;
  source.name = "steak";
  source.text =
      "title = \"Steak\"\n[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.005\ngravity = [0, 0, -1]\n"
      "[[fix]]\nhalf_space = { point = [0, 0.055, 0], normal = [0, 1, 0] }\n";
  return source;
}

/// Engine and pages, with every message carried over at once.
struct Table {
  Engine engine;
  std::map<std::uint32_t, MirroredPage> pages;
  std::map<std::uint32_t, std::vector<protocol::Message>> kept;  ///< what the pages that stand here have heard

  explicit Table(EngineOptions options = {}, const SceneSource& source = steak())
      : engine(make(source, std::move(options))) {}
  explicit Table(Engine made) : engine(std::move(made)) {}
  static Engine make(const SceneSource& source, EngineOptions options) {
    options.step_budget = 1e9;  // no test depends on time
    auto engine = Engine::create(source, std::move(options));
    EXPECT_TRUE(engine.ok()) << (engine.ok() ? "" : engine.error().message);
    return std::move(engine).value();
  }
  std::uint32_t join(std::uint64_t session = 0, std::uint32_t body = 0, std::uint32_t version = 0) {
    const std::uint32_t id = engine.connect();
    pages[id];
    tell(id, page_hello(session, body, version));
    return id;
  }
  void tell(std::uint32_t id, const std::vector<std::byte>& message) {
    engine.receive(id, message);
    deliver();
  }
  void deliver() {
    for (auto& [id, page] : pages)
      while (const protocol::Message m = engine.next(id)) {
        page.hear(*m);
        if (const auto k = kept.find(id); k != kept.end()) k->second.push_back(m);
        if (page.last_seq > 0) engine.receive(id, page_ack(page.last_seq));
      }
  }
  void tick(int n = 1) {
    for (int i = 0; i < n; ++i) {
      engine.tick(1.0 / 60);
      deliver();
    }
  }
  /// Waits for the scene that is on its way; no simulated time passes.
  void until_loaded() {
    while (engine.loading()) {
      engine.tick(0);
      deliver();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  void load(std::uint32_t id, const std::vector<std::byte>& command) {
    tell(id, command);
    until_loaded();
  }
  /// A scalpel stroke over these points of the body's middle plane, seen from kEye.
  void cut(std::uint32_t id, const std::vector<Point>& points, bool ticks = true, std::uint32_t input = 100) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
      for (int k = 0; k < 8; ++k) {
        const double s = k / 8.0;
        const Point p{points[i].x + s * (points[i + 1].x - points[i].x),
                      points[i].y + s * (points[i + 1].y - points[i].y), 0};
        tell(id, page_tool(input, kScalpel, i == 0 && k == 0 ? kDown : kMove, {ray_between(kEye, p)}));
        if (ticks) tick();
      }
    tell(id, page_tool(input, kScalpel, kUp, {ray_between(kEye, points.back())}));
    tick();
  }
  /// The page holds exactly what the engine would send to a new one.
  void expect_mirrored(std::uint32_t id) {
    DrawnBody fresh;
    fresh.reset(engine.session().body());
    protocol::Body message = fresh.body_message();
    message.body = engine.body();
    message.version = engine.version();
    std::vector<Vec3f> nodes;
    std::vector<Vec3> shown;
    engine.session().shown_nodes(shown);
    for (const Vec3 p : shown) nodes.push_back(to_float(p));
    message.nodes = nodes;
    std::vector<std::uint32_t> fading;
    std::vector<Vec3f> offsets;
    fresh.fading(engine.session().fading_visual(), fading, offsets);
    message.fading = fading;
    message.offset = offsets;
    MirroredPage expected;
    expected.hear(protocol::encode(message));
    EXPECT_TRUE(pages.at(id).body == expected.body)
        << "the page's body differs from the engine's at version " << engine.version();
  }
};

}  // namespace kerf::test
