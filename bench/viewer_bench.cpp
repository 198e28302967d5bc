// What the engine behind `kerf view` costs: loading, a tool message until its patch is ready, undo, a tick.
//   viewer_bench [visual triangles...]     closed sheets of these sizes; without: the steak, then 106,496 and 1,000,000
// Thread time; median, 99th percentile and maximum.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

#include "kerf/engine/engine.h"

namespace {

using namespace kerf;

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}
double resident_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}
void report(const char* what, std::vector<double> ms) {
  if (ms.empty()) return;
  std::sort(ms.begin(), ms.end());
  fmt::print("  {:34} {:8.3f} {:8.3f} {:8.3f}  ({})\n", what, ms[ms.size() / 2], ms[(ms.size() * 99) / 100], ms.back(),
             ms.size());
}

/// A message of a page, value by value (docs/protocol.md).
class Message {
 public:
  explicit Message(std::uint16_t type) { put(type).put(protocol::kVersion).put(std::uint32_t{0}); }
  template <class T>
  Message& put(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
    return *this;
  }
  const std::vector<std::byte>& finish() {
    const auto length = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data() + 4, &length, sizeof length);
    return bytes_;
  }

 private:
  std::vector<std::byte> bytes_;
};

std::vector<std::byte> tool(std::uint32_t phase, Vec3 eye, Vec3 through) {
  Message m(66);
  m.put(std::uint32_t{9})
      .put(std::uint32_t{0})
      .put(phase)
      .put(std::uint32_t{0})
      .put(std::uint32_t{1})
      .put(std::uint32_t{0});
  const Vec3 d = normalized(through - eye);
  for (const double x : {0.0, eye.x, eye.y, eye.z, d.x, d.y, d.z}) m.put(x);
  m.put(0.5f).put(0.0f);
  return m.finish();
}
std::vector<std::byte> command(std::uint32_t code) {
  Message m(68);
  m.put(std::uint32_t{9}).put(code).put(std::uint32_t{0}).put(std::uint32_t{0});
  for (int i = 0; i < 4; ++i) m.put(0.0);
  return m.finish();
}

struct Page {
  Engine& engine;
  std::uint32_t id;
  std::vector<double> patch_kb;
  void drain() {
    while (const protocol::Message m = engine.next(id)) {
      std::uint16_t type = 0;
      std::memcpy(&type, m->data(), 2);
      if (type == 3) patch_kb.push_back(static_cast<double>(m->size()) / 1024);
      if (type != 4) continue;
      std::uint32_t seq = 0;
      std::memcpy(&seq, m->data() + 12, 4);
      engine.receive(id, Message(65).put(seq).put(std::uint32_t{0}).finish());
    }
  }
};

int run(const std::string& name, const std::string& text, double size) {
  SceneSource source;
  source.name = name;
  source.text = text;
  const double before = thread_ms();
  EngineOptions options;
  options.step_budget = 1e9;
  auto made = Engine::create(source, options);
  if (!made.ok()) return fmt::print("{}: {}\n", name, made.error().message), 1;
  Engine engine = std::move(made).value();
  fmt::print("{}: loaded in {:.0f} ms, {:.0f} MB resident\n", name, thread_ms() - before, resident_mb());
  Page page{engine, engine.connect(), {}};
  const double hello = thread_ms();
  engine.receive(page.id, Message(64)
                              .put(std::uint32_t{protocol::kVersion})
                              .put(std::uint32_t{0})
                              .put(std::uint64_t{0})
                              .put(std::uint32_t{0})
                              .put(std::uint32_t{0})
                              .finish());
  page.drain();
  fmt::print("  hello and body {:.1f} ms\n", thread_ms() - hello);

  std::vector<double> down, poses, undo, redo, tick, tick_up;
  const auto timed = [&](std::vector<double>& list, auto&& what) {
    const double start = thread_ms();
    what();
    list.push_back(thread_ms() - start);
    page.drain();
  };
  const Vec3 eye{0.02 * size, -0.5 * size, 3 * size};
  const auto ticks = [&](int n) {
    for (int i = 0; i < n; ++i) timed(tick, [&] { engine.tick(1.0 / 60); });
  };
  ticks(10);
  constexpr int kStrokes = 12, kPoses = 80;
  for (int k = 0; k < kStrokes; ++k) {
    const double x = size * (-0.3 + 0.05 * k);
    const auto at = [&](int i) {
      return Vec3{x + 0.02 * size * (i % 7 - 3) / 7.0, size * (-0.6 + 1.2 * i / kPoses), 0};
    };
    timed(down, [&] { engine.receive(page.id, tool(0, eye, at(0))); });
    for (int i = 1; i <= kPoses; ++i) {
      timed(poses, [&] { engine.receive(page.id, tool(1, eye, at(i))); });
      if (i % 4 == 0) ticks(1);
    }
    engine.receive(page.id, tool(2, eye, at(kPoses)));
    page.drain();
    timed(tick_up, [&] { engine.tick(1.0 / 60); });
    if (k % 2 == 1) {
      timed(undo, [&] { engine.receive(page.id, command(6)); });
      timed(tick_up, [&] { engine.tick(1.0 / 60); });
      timed(redo, [&] { engine.receive(page.id, command(7)); });
      timed(tick_up, [&] { engine.tick(1.0 / 60); });
      timed(undo, [&] { engine.receive(page.id, command(6)); });
      timed(tick_up, [&] { engine.tick(1.0 / 60); });
    }
  }
  report("stroke begins, ms", down);
  report("tool message to patch, ms", poses);
  report("undo to patch, ms", undo);
  report("redo to patch, ms", redo);
  report("tick, ms", tick);
  report("tick with a report, ms", tick_up);
  report("patch, KiB", page.patch_kb);
  fmt::print("  {} visual triangles, {} pieces, {:.0f} MB resident\n", engine.session().counts().visual_triangles,
             engine.session().counts().pieces, resident_mb());
  return 0;
}

std::string sheet(const std::string& triangles) {
  return "[body]\nmodel = \"closed-sheet\"\noptions = { visual_triangles = " + triangles +
         ", collision_triangles = 500 }\n[simulation]\ntime_step = 0.005\n"
         "[[fix]]\nhalf_space = { point = [-0.45, 0, 0], normal = [-1, 0, 0] }\n"
         "[[fix]]\nhalf_space = { point = [0.45, 0, 0], normal = [1, 0, 0] }\n";
}

}  // namespace

int main(int argc, char** argv) {
  int status = 0;
  if (argc == 1)
    status |= run("steak",
                  "[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.005\n"
                  "[[fix]]\nhalf_space = { point = [0, 0.055, 0], normal = [0, 1, 0] }\n",
                  0.2);
  std::vector<std::string> sizes(argv + 1, argv + argc);
  if (argc == 1) sizes = {"106496", "1000000"};
  for (const std::string& n : sizes) status |= run("sheet of " + n, sheet(n), 1);
  return status;
}
