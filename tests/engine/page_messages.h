// The page's side of the protocol for tests, written from docs/protocol.md alone: builds page messages byte by byte and
// keeps a mirror of what the engine sends. It shares no code with the library's encoder.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace kerf::test {

/// Appends little-endian values; finish() puts the length into the header.
class PageWriter {
 public:
  explicit PageWriter(std::uint16_t type) { u16(type).u16(7).u32(0); }
  PageWriter& u16(std::uint16_t v) { return put(v, 2); }
  PageWriter& u32(std::uint32_t v) { return put(v, 4); }
  PageWriter& u64(std::uint64_t v) { return put(v, 8); }
  PageWriter& f32(float v) {
    std::uint32_t bits;
    std::memcpy(&bits, &v, 4);
    return put(bits, 4);
  }
  PageWriter& f64(double v) {
    std::uint64_t bits;
    std::memcpy(&bits, &v, 8);
    return put(bits, 8);
  }
  PageWriter& text(const std::string& s) {
    for (const char c : s) bytes_.push_back(static_cast<std::byte>(c));
    while (bytes_.size() % 4 != 0) bytes_.push_back(std::byte{0});
    return *this;
  }
  std::vector<std::byte> finish() {
    const auto n = static_cast<std::uint32_t>(bytes_.size());
    for (std::size_t i = 0; i < 4; ++i) bytes_[4 + i] = static_cast<std::byte>(n >> (8 * i) & 255);
    return bytes_;
  }

 private:
  PageWriter& put(std::uint64_t v, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) bytes_.push_back(static_cast<std::byte>(v >> (8 * i) & 255));
    return *this;
  }
  std::vector<std::byte> bytes_;
};

struct Point {
  double x = 0, y = 0, z = 0;
};
struct PageRay {
  Point origin, direction;
};
inline PageRay ray_between(Point a, Point b) {
  const double dx = b.x - a.x, dy = b.y - a.y, dz = b.z - a.z, n = std::sqrt(dx * dx + dy * dy + dz * dz);
  return {a, {dx / n, dy / n, dz / n}};
}

inline std::vector<std::byte> page_hello(std::uint64_t session = 0, std::uint32_t body = 0, std::uint32_t version = 0) {
  return PageWriter(64).u32(7).u32(0).u64(session).u32(body).u32(version).finish();
}
inline std::vector<std::byte> page_ack(std::uint32_t seq) { return PageWriter(65).u32(seq).u32(0).finish(); }
inline std::vector<std::byte> page_tool(std::uint32_t input, std::uint32_t tool, std::uint32_t phase,
                                        const std::vector<PageRay>& rays, std::uint32_t modifiers = 0, float size = 0) {
  PageWriter w(66);
  w.u32(input).u32(tool).u32(phase).u32(modifiers).u32(static_cast<std::uint32_t>(rays.size())).f32(size);
  for (const PageRay& r : rays)
    w.f64(1)
        .f64(r.origin.x)
        .f64(r.origin.y)
        .f64(r.origin.z)
        .f64(r.direction.x)
        .f64(r.direction.y)
        .f64(r.direction.z)
        .f32(0.5f)
        .f32(0);
  return w.finish();
}
inline std::vector<std::byte> page_ray(std::uint32_t input, const PageRay& r, float near = 0) {
  return PageWriter(67)
      .u32(input)
      .f32(near)
      .f64(r.origin.x)
      .f64(r.origin.y)
      .f64(r.origin.z)
      .f64(r.direction.x)
      .f64(r.direction.y)
      .f64(r.direction.z)
      .finish();
}
inline std::vector<std::byte> page_command(std::uint32_t input, std::uint32_t code, std::vector<double> values = {},
                                           const std::string& text = {}) {
  values.resize(4);
  PageWriter w(68);
  w.u32(input).u32(code).u32(static_cast<std::uint32_t>(text.size())).u32(0);
  for (const double v : values) w.f64(v);
  return w.text(text).finish();
}
inline std::vector<std::byte> page_device(std::uint32_t input, std::uint32_t tool, Point position, Point rotation,
                                          double jaws) {
  return PageWriter(71)
      .u32(input)
      .u32(tool)
      .f64(position.x)
      .f64(position.y)
      .f64(position.z)
      .f64(rotation.x)
      .f64(rotation.y)
      .f64(rotation.z)
      .f64(jaws)
      .finish();
}
inline std::vector<std::byte> page_claim(bool take) { return PageWriter(69).u32(take ? 1 : 0).u32(0).finish(); }
inline std::vector<std::byte> page_upload(std::uint32_t upload, std::uint32_t part, const std::string& name,
                                          std::uint32_t offset, std::uint32_t total, const std::string& bytes) {
  return PageWriter(70)
      .u32(upload)
      .u32(part)
      .u32(static_cast<std::uint32_t>(name.size()))
      .u32(offset)
      .u32(total)
      .u32(static_cast<std::uint32_t>(bytes.size()))
      .text(name)
      .text(bytes)
      .finish();
}

/// Reads a message from the engine and fails the test when it does not fit.
class EngineReader {
 public:
  explicit EngineReader(std::span<const std::byte> bytes) : bytes_(bytes) {
    type = u16();
    EXPECT_EQ(u16(), 7);
    EXPECT_EQ(u32(), bytes.size());
    EXPECT_EQ(bytes.size() % 4, 0u);
  }
  std::uint16_t type = 0;
  std::uint16_t u16() { return get<std::uint16_t>(); }
  std::uint32_t u32() { return get<std::uint32_t>(); }
  std::int32_t i32() { return get<std::int32_t>(); }
  std::uint64_t u64() { return get<std::uint64_t>(); }
  float f32() {
    const float x = get<float>();
    EXPECT_TRUE(std::isfinite(x));
    return x;
  }
  double f64() {
    EXPECT_EQ(at_ % 8, 0u);
    const double x = get<double>();
    EXPECT_TRUE(std::isfinite(x));
    return x;
  }
  template <class T>
  std::vector<T> array(std::size_t n) {
    EXPECT_EQ(at_ % 4, 0u);
    std::vector<T> out;
    if (at_ + n * sizeof(T) > bytes_.size()) {
      ADD_FAILURE() << "array of " << n << " reaches past the end";
      return out;
    }
    out.resize(n);
    if (n > 0) std::memcpy(out.data(), bytes_.data() + at_, n * sizeof(T));
    at_ = (at_ + n * sizeof(T) + 3) & ~std::size_t{3};
    return out;
  }
  std::string text(std::size_t n) {
    const auto c = array<char>(n);
    return {c.begin(), c.end()};
  }
  void end() { EXPECT_EQ(at_, bytes_.size()); }

 private:
  template <class T>
  T get() {
    T v{};
    if (at_ + sizeof v > bytes_.size()) {
      ADD_FAILURE() << "message too short";
      return v;
    }
    std::memcpy(&v, bytes_.data() + at_, sizeof v);
    at_ += sizeof v;
    return v;
  }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

using F3 = std::array<float, 3>;
using I4 = std::array<std::int16_t, 4>;
using U3 = std::array<std::uint32_t, 3>;
using U8 = std::array<std::uint32_t, 8>;

/// What a page keeps of a body.
struct MirroredBody {
  std::uint32_t body = 0, version = 0;
  std::vector<F3> rest;
  std::vector<I4> normal;
  std::vector<std::uint32_t> copy;
  std::vector<U3> skin, wall;
  std::vector<U8> copies;
  std::vector<I4> cells;
  std::vector<F3> nodes;
  std::map<std::uint32_t, F3> offsets;        ///< of fading vertices
  std::vector<std::array<float, 16>> frames;  ///< origin, 0, axes, cell
  friend bool operator==(const MirroredBody&, const MirroredBody&) = default;

  void check() const {
    for (const U3& t : skin)
      for (const auto v : t) ASSERT_LT(v, rest.size());
    for (const U3& t : wall)
      for (const auto v : t) ASSERT_LT(v, rest.size());
    for (const auto c : copy) {
      ASSERT_LT(c, copies.size());
      ASSERT_NE(copies[c][0], 0xffffffffu) << "a vertex hangs on a dead copy";
    }
    for (const U8& c : copies)
      for (const auto n : c) ASSERT_TRUE(c[0] == 0xffffffffu ? n == 0xffffffffu : n < nodes.size());
  }
  /// Where the page draws a vertex: trilinear in its copy's nodes.
  [[nodiscard]] F3 drawn(std::size_t v) const {
    const std::uint32_t c = copy[v];
    const std::array<float, 16>& at = frames.at(static_cast<std::size_t>(cells[c][3]));
    F3 local{};
    for (std::size_t k = 0; k < 3; ++k) {
      float q = 0;
      for (std::size_t i = 0; i < 3; ++i) q += at[4 + 3 * k + i] * (rest[v][i] - at[i]);
      local[k] = q / at[13 + k] - static_cast<float>(cells[c][k]);
    }
    F3 out{};
    for (std::size_t n = 0; n < 8; ++n) {
      float w = 1;
      for (std::size_t k = 0; k < 3; ++k) w *= (n >> k & 1) ? local[k] : 1 - local[k];
      for (std::size_t i = 0; i < 3; ++i) out[i] += w * nodes[copies[c][n]][i];
    }
    if (const auto f = offsets.find(static_cast<std::uint32_t>(v)); f != offsets.end())
      for (std::size_t i = 0; i < 3; ++i) out[i] += f->second[i];
    return out;
  }
  void fade(const std::vector<std::uint32_t>& ids, const std::vector<F3>& by) {
    offsets.clear();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      ASSERT_LT(ids[i], rest.size());
      if (i > 0) {
        ASSERT_LT(ids[i - 1], ids[i]);
      }
      offsets[ids[i]] = by[i];
    }
  }
};

/// One page: what it has been told.
struct MirroredPage {
  MirroredBody body;
  std::uint64_t session = 0;
  std::uint32_t client = 0, holder = 0, frames = 0, bodies = 0, patches = 0, last_seq = 0, last_input = 0;
  bool held = false;
  std::string name, json;
  std::uint32_t flags = 0, undo_depth = 0, redo_depth = 0, grasps = 0;
  double time = 0;
  std::size_t patch_bytes = 0, frame_bytes = 0;
  struct Cut {
    std::uint32_t input, outcome, pieces, triangles, invariants;
    std::array<std::uint32_t, 6> counts;
    std::string text;
    float total_ms;
  };
  std::vector<Cut> cuts;
  struct Trouble {
    std::uint32_t input, code;
    std::string text;
  };
  std::vector<Trouble> errors;
  struct Hit {
    std::uint32_t input;
    std::int32_t triangle;
    double t;
    std::array<double, 3> point;
    F3 normal;
    float beside;
    std::uint32_t copy;
  };
  std::vector<Hit> hits;
  std::map<std::string, std::string> files;
  struct Loading {
    std::uint32_t input = 0, state = 0;
    float fraction = 0;
    std::string stage;
  };
  std::vector<Loading> loadings;
  // Obstacles, tools and contacts of the last frame
  std::string things;
  std::vector<F3> thing_positions;
  std::vector<U3> thing_triangles;
  std::vector<std::array<float, 8>> places;
  std::vector<std::array<float, 14>> tools;
  std::vector<std::array<float, 10>> contacts;
  std::vector<std::uint32_t> partners;
  std::uint32_t touching = 0;
  float press = 0;
  std::array<float, 7> score{};  ///< lesion m^3, its share gone, healthy m^3 gone, share, roughness, force, time
  std::uint32_t score_pieces = 0, scores = 0;
  std::vector<std::uint32_t> fixed, held_vertices;  ///< nodes that supports hold, and vertices where nodes move
  // What the pieces weigh (kg), one copy of each, and copies of what is held
  std::vector<float> masses;
  std::vector<std::uint32_t> mass_copies, grasp_copies;
  std::vector<std::array<float, 6>> grasp_places;  ///< m: of what is held, and where it is pulled to
  float uncut_mass = 0;
  std::uint32_t masses_version = 0, weighings = 0;
  std::uint32_t overlays = 0;
  struct {
    std::vector<F3> rest, foot_rest;
    std::vector<U3> triangles;
    std::vector<std::array<std::uint32_t, 2>> links, feet;
  } overlay;  ///< the last one
  std::array<std::uint32_t, 6> counts{};
  std::uint32_t pieces = 0, dropped = 0, bad = 0, clients = 0;

  void hear(std::span<const std::byte> bytes) {
    EngineReader r(bytes);
    switch (r.type) {
      case 1: {
        session = r.u64();
        client = r.u32();
        r.u32();
        r.f32();
        const auto n = r.u32(), j = r.u32();
        r.u32();
        name = r.text(n);
        json = r.text(j);
        break;
      }
      case 2: {
        ++bodies;
        MirroredBody b;
        b.body = r.u32();
        b.version = r.u32();
        const auto nv = r.u32(), ns = r.u32(), nw = r.u32(), nc = r.u32(), nn = r.u32(), nfade = r.u32();
        const auto nb = r.u32();
        r.u32();
        b.frames = r.array<std::array<float, 16>>(nb);
        b.rest = r.array<F3>(nv);
        b.normal = r.array<I4>(nv);
        b.copy = r.array<std::uint32_t>(nv);
        b.skin = r.array<U3>(ns);
        b.wall = r.array<U3>(nw);
        b.copies = r.array<U8>(nc);
        b.cells = r.array<I4>(nc);
        b.nodes = r.array<F3>(nn);
        body = std::move(b);
        const auto faded = r.array<std::uint32_t>(nfade);
        body.fade(faded, r.array<F3>(nfade));
        body.check();
        break;
      }
      case 3: patch(r, bytes.size()); break;
      case 4: {
        const auto b = r.u32(), seq = r.u32(), version = r.u32(), input = r.u32();
        const double t = r.f64();
        r.f32();
        r.f32();
        const auto nn = r.u32(), f = r.u32(), u = r.u32(), re = r.u32(), ng = r.u32(), np = r.u32(), nt = r.u32(),
                   nk = r.u32();
        touching = r.u32();
        press = r.f32();
        const auto nfade = r.u32();
        auto nodes = r.array<F3>(nn);
        grasp_places = r.array<std::array<float, 6>>(ng);
        grasp_copies = r.array<std::uint32_t>(ng);
        places = r.array<std::array<float, 8>>(np);
        tools = r.array<std::array<float, 14>>(nt);
        contacts = r.array<std::array<float, 10>>(nk);
        partners = r.array<std::uint32_t>(nk);
        const auto faded = r.array<std::uint32_t>(nfade);
        const auto offsets = r.array<F3>(nfade);
        EXPECT_LE(nt, np);
        EXPECT_LE(nk, touching);
        for (const auto& p : places) EXPECT_NEAR(p[3] * p[3] + p[4] * p[4] + p[5] * p[5] + p[6] * p[6], 1, 1e-5);
        last_seq = seq;
        ++frames;
        frame_bytes += bytes.size();
        last_input = input;
        time = t;
        flags = f;
        undo_depth = u;
        redo_depth = re;
        grasps = ng;
        // A frame never overtakes its patch.
        EXPECT_EQ(b, body.body);
        EXPECT_EQ(version, body.version);
        if (version == body.version) {
          EXPECT_EQ(nn, body.nodes.size());
          body.nodes = std::move(nodes);
          body.fade(faded, offsets);
        }
        break;
      }
      case 5: {
        Hit h{};
        h.input = r.u32();
        h.triangle = r.i32();
        h.t = r.f64();
        for (double& x : h.point) x = r.f64();
        for (float& x : h.normal) x = r.f32();
        h.beside = r.f32();
        h.copy = r.u32();
        EXPECT_EQ(h.copy < body.copies.size(), h.triangle >= 0);
        hits.push_back(h);
        break;
      }
      case 6: {
        for (int i = 0; i < 4; ++i) r.f32();
        r.u32();
        r.f32();
        for (auto& c : counts) c = r.u32();
        pieces = r.u32();
        dropped = r.u32();
        bad = r.u32();
        clients = r.u32();
        break;
      }
      case 7: {
        Cut c{};
        c.input = r.u32();
        c.outcome = r.u32();
        c.pieces = r.u32();
        c.triangles = r.u32();
        for (int i = 0; i < 3; ++i) r.f32();
        c.total_ms = r.f32();
        for (auto& x : c.counts) x = r.u32();
        c.invariants = r.u32();
        const auto n = r.u32();
        c.text = r.text(n);
        pieces = c.pieces;
        cuts.push_back(c);
        break;
      }
      case 8:
        holder = r.u32();
        held = r.u32() == 1;
        clients = r.u32();
        r.u32();
        break;
      case 9: {
        Trouble e{};
        e.input = r.u32();
        e.code = r.u32();
        const auto n = r.u32();
        r.u32();
        e.text = r.text(n);
        errors.push_back(e);
        break;
      }
      case 10: {
        const auto b = r.u32(), v = r.u32(), ncv = r.u32(), nct = r.u32(), nb = r.u32(), nl = r.u32(), nf = r.u32();
        r.u32();
        overlay = {};
        overlay.rest = r.array<F3>(ncv);
        for (const auto c : r.array<std::uint32_t>(ncv)) EXPECT_LT(c, body.copies.size());
        overlay.triangles = r.array<U3>(nct);
        for (const U3& t : overlay.triangles)
          for (const auto x : t) EXPECT_LT(x, ncv);
        for (const auto& p : r.array<std::array<std::uint32_t, 2>>(nb))
          for (const auto x : p) EXPECT_LT(x, body.rest.size());
        overlay.links = r.array<std::array<std::uint32_t, 2>>(nl);
        overlay.feet = r.array<std::array<std::uint32_t, 2>>(nf);
        overlay.foot_rest = r.array<F3>(nf);
        for (const auto& p : overlay.links) {
          EXPECT_LT(p[0], ncv);
          EXPECT_LT(p[1], body.rest.size());
        }
        EXPECT_EQ(b, body.body);
        EXPECT_EQ(v, body.version);
        EXPECT_GT(nb, 0u);
        EXPECT_GT(nl, 0u);
        ++overlays;
        break;
      }
      case 11: {
        r.u32();
        const auto n = r.u32(), size = r.u32();
        r.u32();
        const std::string file = r.text(n);
        files[file] = r.text(size);
        break;
      }
      case 14: {
        for (float& x : score) x = r.f32();
        score_pieces = r.u32();
        ++scores;
        break;
      }
      case 15: {
        EXPECT_EQ(r.u32(), body.body);
        const auto n = r.u32();
        const auto h = r.u32();
        EXPECT_EQ(r.u32(), 0u);
        fixed = r.array<std::uint32_t>(n);
        held_vertices = r.array<std::uint32_t>(h);
        for (const auto& list : {fixed, held_vertices})
          for (std::size_t i = 1; i < list.size(); ++i) EXPECT_LT(list[i - 1], list[i]);
        break;
      }
      case 16: {
        EXPECT_EQ(r.u32(), body.body);
        masses_version = r.u32();
        EXPECT_LE(masses_version, body.version);
        uncut_mass = r.f32();
        const auto n = r.u32();
        masses = r.array<float>(n);
        mass_copies = r.array<std::uint32_t>(n);
        for (const float m : masses) EXPECT_GE(m, 0);
        if (masses_version == body.version) {
          for (const auto c : mass_copies) EXPECT_LT(c, body.copies.size());
        }
        ++weighings;
        break;
      }
      case 13: {
        EXPECT_EQ(r.u32(), body.body);
        const auto j = r.u32(), nv = r.u32(), nf = r.u32();
        things = r.text(j);
        thing_positions = r.array<F3>(nv);
        thing_triangles = r.array<U3>(nf);
        break;
      }
      case 12: {
        Loading l{};
        l.input = r.u32();
        l.state = r.u32();
        l.fraction = r.f32();
        const auto n = r.u32();
        l.stage = r.text(n);
        EXPECT_GE(l.fraction, 0);
        EXPECT_LE(l.fraction, 1);
        loadings.push_back(l);
        break;
      }
      default: ADD_FAILURE() << "unknown message " << r.type; return;
    }
    r.end();
  }

 private:
  template <class T>
  static void change(std::vector<T>& of, const std::vector<std::uint32_t>& ids, const std::vector<T>& values,
                     std::size_t total, std::size_t appended) {
    of.resize(total - appended);  // an undo truncates
    ASSERT_EQ(values.size(), ids.size() + appended);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      ASSERT_LT(ids[i], of.size());
      if (i > 0) {
        ASSERT_LT(ids[i - 1], ids[i]);
      }
      of[ids[i]] = values[i];
    }
    of.insert(of.end(), values.begin() + static_cast<std::ptrdiff_t>(ids.size()), values.end());
  }
  void patch(EngineReader& r, std::size_t bytes) {
    ++patches;
    patch_bytes += bytes;
    EXPECT_EQ(r.u32(), body.body);
    EXPECT_EQ(r.u32(), body.version);
    body.version = r.u32();
    r.u32();
    const auto nv = r.u32(), ns = r.u32(), nw = r.u32(), nc = r.u32(), nn = r.u32();
    const auto mv = r.u32(), ms = r.u32(), mw = r.u32(), mc = r.u32();
    const auto av = r.u32(), as = r.u32(), aw = r.u32(), ac = r.u32();
    const auto nfade = r.u32();
    r.u32();
    const auto appended = [](std::size_t old, std::size_t now) { return now > old ? now - old : 0; };
    EXPECT_EQ(av, appended(body.rest.size(), nv));
    EXPECT_EQ(as, appended(body.skin.size(), ns));
    EXPECT_EQ(aw, appended(body.wall.size(), nw));
    EXPECT_EQ(ac, appended(body.copies.size(), nc));
    auto ids = r.array<std::uint32_t>(mv);
    const auto rest = r.array<F3>(mv + av);
    const auto normal = r.array<I4>(mv + av);
    const auto copy = r.array<std::uint32_t>(mv + av);
    change(body.rest, ids, rest, nv, av);
    change(body.normal, ids, normal, nv, av);
    change(body.copy, ids, copy, nv, av);
    ids = r.array<std::uint32_t>(ms);
    change(body.skin, ids, r.array<U3>(ms + as), ns, as);
    ids = r.array<std::uint32_t>(mw);
    change(body.wall, ids, r.array<U3>(mw + aw), nw, aw);
    ids = r.array<std::uint32_t>(mc);
    const auto copies = r.array<U8>(mc + ac);
    const auto cells = r.array<I4>(mc + ac);
    change(body.copies, ids, copies, nc, ac);
    change(body.cells, ids, cells, nc, ac);
    body.nodes = r.array<F3>(nn);
    const auto faded = r.array<std::uint32_t>(nfade);
    body.fade(faded, r.array<F3>(nfade));
    body.check();
  }
};

}  // namespace kerf::test
