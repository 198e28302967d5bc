#include "kerf/engine/protocol.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "kerf/base/check.h"

namespace kerf::protocol {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are copied as they lie in memory");

constexpr std::size_t padded(std::size_t bytes) { return (bytes + 3) & ~std::size_t{3}; }
constexpr float finite(float x) { return x - x == 0 ? x : 0.0f; }
constexpr double finite(double x) { return x - x == 0 ? x : 0.0; }

/// Fills one message whose length is known beforehand.
class Writer {
 public:
  Writer(Type type, std::size_t body) : bytes_(kHeaderBytes + body) {
    const auto length = static_cast<std::uint32_t>(bytes_.size());
    put(static_cast<std::uint16_t>(type));
    put(kVersion);
    put(length);
  }
  Writer& u32(std::uint32_t value) { return put(value), *this; }
  Writer& size(std::size_t value) { return u32(static_cast<std::uint32_t>(value)); }
  Writer& i32(std::int32_t value) { return put(value), *this; }
  Writer& u64(std::uint64_t value) { return put(value), *this; }
  Writer& f32(float value) { return put(finite(value)), *this; }
  Writer& f64(double value) { return put(finite(value)), *this; }
  Writer& vec(Vec3f v) { return f32(v.x).f32(v.y).f32(v.z); }
  Writer& vec(Vec3 v) { return f64(v.x).f64(v.y).f64(v.z); }
  Writer& counts(const Counts& c) {
    return u32(c.visual_vertices)
        .u32(c.visual_triangles)
        .u32(c.collision_vertices)
        .u32(c.collision_triangles)
        .u32(c.nodes)
        .u32(c.hexahedra);
  }
  template <class T>
  Writer& array(std::span<const T> values) {
    raw(values.data(), values.size_bytes());
    at_ = padded(at_);  // the buffer starts as zeros
    return *this;
  }
  Writer& array(std::span<const Vec3f> values) {
    for (const Vec3f& v : values) vec(v);
    return *this;
  }
  Writer& array(std::span<const CellFrame> values) {
    for (const CellFrame& f : values) vec(f.origin).f32(0).vec(f.axes[0]).vec(f.axes[1]).vec(f.axes[2]).vec(f.cell);
    return *this;
  }
  Writer& text(std::string_view s) { return array(std::span<const char>(s.data(), s.size())); }
  Bytes finish() {
    KERF_ASSERT(at_ == bytes_.size());
    return std::move(bytes_);
  }

 private:
  template <class T>
  void put(T value) {
    raw(&value, sizeof value);
  }
  void raw(const void* data, std::size_t n) {
    KERF_ASSERT(at_ + n <= bytes_.size());
    if (n > 0) std::memcpy(bytes_.data() + at_, data, n);
    at_ += n;
  }
  Bytes bytes_;
  std::size_t at_ = 0;
};

/// Reads one message; past its end everything is zero and `short_` says so.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::uint16_t u16() { return get<std::uint16_t>(); }
  std::uint32_t u32() { return get<std::uint32_t>(); }
  std::uint64_t u64() { return get<std::uint64_t>(); }
  float f32() { return get<float>(); }
  double f64() { return get<double>(); }
  Vec3 vec() {
    Vec3 v;
    v.x = f64();
    v.y = f64();
    v.z = f64();
    return v;
  }
  std::string text(std::size_t n) {
    if (!has(padded(n))) return {};
    std::string out(n, '\0');
    if (n > 0) std::memcpy(out.data(), bytes_.data() + at_, n);
    at_ += padded(n);
    return out;
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool complete() const { return !short_ && left() == 0; }
  [[nodiscard]] bool ran_out() const { return short_; }

 private:
  bool has(std::size_t n) {
    if (n > left()) {
      short_ = true;
      at_ = bytes_.size();
      return false;
    }
    return true;
  }
  template <class T>
  T get() {
    T value{};
    if (!has(sizeof value)) return value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool short_ = false;
};

/// Well-formed UTF-8 without NUL.
bool is_text(std::string_view s) {
  for (std::size_t i = 0; i < s.size();) {
    const auto lead = static_cast<unsigned char>(s[i]);
    if (lead == 0) return false;
    std::size_t more = 0;
    std::uint32_t least = 0, code = 0;
    if (lead < 0x80) {
      ++i;
      continue;
    }
    if ((lead & 0xe0u) == 0xc0u) more = 1, least = 0x80, code = lead & 0x1fu;
    else if ((lead & 0xf0u) == 0xe0u) more = 2, least = 0x800, code = lead & 0x0fu;
    else if ((lead & 0xf8u) == 0xf0u) more = 3, least = 0x10000, code = lead & 0x07u;
    else return false;
    if (i + more >= s.size()) return false;
    for (std::size_t k = 1; k <= more; ++k) {
      const auto next = static_cast<unsigned char>(s[i + k]);
      if ((next & 0xc0u) != 0x80u) return false;
      code = code << 6 | (next & 0x3fu);
    }
    if (code < least || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return false;
    i += more + 1;
  }
  return true;
}

Status read_ray(Reader& r, ViewRay& ray) {
  ray.origin = r.vec();
  ray.direction = r.vec();
  if (r.ran_out()) return bad_input("the message ends inside a ray");
  if (!is_finite(ray.origin) || !is_finite(ray.direction)) return bad_input("a ray is not finite");
  const auto far = [](double x) { return std::abs(x) > kFarthest; };
  if (far(ray.origin.x) || far(ray.origin.y) || far(ray.origin.z))
    return bad_input("a ray starts more than 1e6 m from the origin");
  const double length = norm(ray.direction);
  if (!(length > 1e-6 && length < 1e6)) return bad_input("a ray's direction is not near a unit vector");
  ray.direction = (1 / length) * ray.direction;
  return {};
}

Result<PageMessage> read_tool(Reader& r) {
  constexpr std::size_t kSampleBytes = 64;
  ToolInput m;
  m.input = r.u32();
  const std::uint32_t tool = r.u32(), phase = r.u32();
  m.modifiers = r.u32();
  const std::uint32_t n = r.u32();
  m.size = r.f32();
  if (!(m.size >= 0 && m.size <= kFarthest)) return bad_input("a tool's size is negative or too large");
  if (tool > static_cast<std::uint32_t>(Tool::kProbe)) return bad_input(fmt::format("there is no tool {}", tool));
  if (phase > static_cast<std::uint32_t>(Phase::kCancel)) return bad_input(fmt::format("there is no phase {}", phase));
  m.tool = static_cast<Tool>(tool);
  m.phase = static_cast<Phase>(phase);
  if (r.ran_out() || n > r.left() / kSampleBytes || n * kSampleBytes != r.left())
    return bad_input(fmt::format("{} samples do not fit the message", n));
  if (n == 0 && m.phase == Phase::kDown) return bad_input("a tool that goes down has no sample");
  m.samples.resize(n);
  for (ToolSample& s : m.samples) {
    s.time_ms = r.f64();
    KERF_TRY(read_ray(r, s.ray));
    s.pressure = r.f32();
    r.f32();
    if (!std::isfinite(s.time_ms) || !std::isfinite(s.pressure)) return bad_input("a sample is not finite");
  }
  return PageMessage(std::move(m));
}

Result<PageMessage> read_device(Reader& r) {
  constexpr double kMostTurn = 100;  // radians
  Device m;
  m.input = r.u32();
  m.tool = r.u32();
  m.position = r.vec();
  m.rotation = r.vec();
  m.jaws = r.f64();
  if (!is_finite(m.position) || !is_finite(m.rotation) || !std::isfinite(m.jaws))
    return bad_input("a pose is not finite");
  for (int i = 0; i < 3; ++i)
    if (std::abs(m.position[i]) > kFarthest) return bad_input("a pose is more than 1e6 m from the origin");
  if (norm(m.rotation) > kMostTurn) return bad_input("a pose is turned by more than 100 radians");
  if (m.jaws < 0 || m.jaws > 1) return bad_input("jaws open from 0 to 1");
  return PageMessage(m);
}

Result<PageMessage> read_command(Reader& r) {
  Command m;
  m.input = r.u32();
  const std::uint32_t code = r.u32(), n = r.u32();
  r.u32();
  for (double& v : m.value) {
    v = r.f64();
    if (!std::isfinite(v)) return bad_input("a command's value is not finite");
  }
  m.text = r.text(n);
  if (!r.complete()) return bad_input("the length of a command's text does not fit the message");
  if (code < 1 || code > static_cast<std::uint32_t>(CommandCode::kContacts))
    return bad_input(fmt::format("there is no command {}", code));
  if (!is_text(m.text)) return bad_input("a command's text is not UTF-8");
  m.code = static_cast<CommandCode>(code);
  return PageMessage(std::move(m));
}

Result<PageMessage> read_upload(Reader& r) {
  Upload m;
  m.upload = r.u32();
  const std::uint32_t part = r.u32(), name = r.u32();
  m.offset = r.u32();
  m.total = r.u32();
  const std::uint32_t n = r.u32();
  m.name = r.text(name);
  m.bytes = r.text(n);
  if (!r.complete()) return bad_input("the lengths of an upload do not fit the message");
  if (part > static_cast<std::uint32_t>(UploadPart::kScene))
    return bad_input(fmt::format("there is no upload part {}", part));
  if (m.offset > m.total || n > m.total - m.offset) return bad_input("an upload's chunk reaches past its end");
  if (!is_text(m.name)) return bad_input("an upload's name is not UTF-8");
  m.part = static_cast<UploadPart>(part);
  return PageMessage(std::move(m));
}

}  // namespace

Bytes encode(const Hello& m) {
  return Writer(Type::kHello, 32 + padded(m.name.size()) + padded(m.json.size()))
      .u64(m.session)
      .u32(m.client)
      .u32(m.flags)
      .f32(m.tick)
      .size(m.name.size())
      .size(m.json.size())
      .u32(0)
      .text(m.name)
      .text(m.json)
      .finish();
}

Bytes encode(const Body& m) {
  KERF_ASSERT(m.rest.size() == m.normal.size() && m.rest.size() == m.copy.size() && m.copies.size() == m.cells.size() &&
              m.fading.size() == m.offset.size());
  return Writer(Type::kBody, 40 + 64 * m.frames.size() + 24 * m.rest.size() + 12 * (m.skin.size() + m.wall.size()) +
                                 40 * m.copies.size() + 12 * m.nodes.size() + 16 * m.fading.size())
      .u32(m.body)
      .u32(m.version)
      .size(m.rest.size())
      .size(m.skin.size())
      .size(m.wall.size())
      .size(m.copies.size())
      .size(m.nodes.size())
      .size(m.fading.size())
      .size(m.frames.size())
      .u32(0)
      .array(m.frames)
      .array(m.rest)
      .array(m.normal)
      .array(m.copy)
      .array(m.skin)
      .array(m.wall)
      .array(m.copies)
      .array(m.cells)
      .array(m.nodes)
      .array(m.fading)
      .array(m.offset)
      .finish();
}

Bytes encode(const Patch& m) {
  KERF_ASSERT(m.rest.size() == m.normal.size() && m.rest.size() == m.copy.size() && m.copies.size() == m.cells.size());
  KERF_ASSERT(m.rest.size() >= m.vertex_ids.size() && m.skin.size() >= m.skin_ids.size() &&
              m.wall.size() >= m.wall_ids.size() && m.copies.size() >= m.copy_ids.size());
  KERF_ASSERT(m.nodes.size() == m.totals.nn && m.fading.size() == m.offset.size());
  const std::size_t ids = m.vertex_ids.size() + m.skin_ids.size() + m.wall_ids.size() + m.copy_ids.size();
  return Writer(Type::kPatch, 76 + 4 * ids + 24 * m.rest.size() + 12 * (m.skin.size() + m.wall.size()) +
                                  40 * m.copies.size() + 12 * m.nodes.size() + 16 * m.fading.size())
      .u32(m.body)
      .u32(m.from)
      .u32(m.to)
      .u32(m.input)
      .u32(m.totals.nv)
      .u32(m.totals.ns)
      .u32(m.totals.nw)
      .u32(m.totals.nc)
      .u32(m.totals.nn)
      .size(m.vertex_ids.size())
      .size(m.skin_ids.size())
      .size(m.wall_ids.size())
      .size(m.copy_ids.size())
      .size(m.rest.size() - m.vertex_ids.size())
      .size(m.skin.size() - m.skin_ids.size())
      .size(m.wall.size() - m.wall_ids.size())
      .size(m.copies.size() - m.copy_ids.size())
      .size(m.fading.size())
      .u32(0)
      .array(m.vertex_ids)
      .array(m.rest)
      .array(m.normal)
      .array(m.copy)
      .array(m.skin_ids)
      .array(m.skin)
      .array(m.wall_ids)
      .array(m.wall)
      .array(m.copy_ids)
      .array(m.copies)
      .array(m.cells)
      .array(m.nodes)
      .array(m.fading)
      .array(m.offset)
      .finish();
}

Bytes encode(const Frame& m) {
  KERF_ASSERT(m.contacts.size() == m.partners.size() && m.fading.size() == m.offset.size() &&
              m.held.size() == m.grasps.size());
  Writer w(Type::kFrame, 76 + 12 * m.nodes.size() + 28 * m.grasps.size() + 32 * m.places.size() + 56 * m.tools.size() +
                             44 * m.contacts.size() + 16 * m.fading.size());
  w.u32(m.body)
      .u32(m.seq)
      .u32(m.version)
      .u32(m.input)
      .f64(m.time)
      .f32(m.step_ms)
      .f32(m.speed)
      .size(m.nodes.size())
      .u32(m.flags)
      .u32(m.undo_depth)
      .u32(m.redo_depth)
      .size(m.grasps.size())
      .size(m.places.size())
      .size(m.tools.size())
      .size(m.contacts.size())
      .u32(m.touching)
      .f32(m.press)
      .size(m.fading.size())
      .array(m.nodes);
  for (const Grasp& g : m.grasps) w.vec(g.held).vec(g.target);
  w.array(m.held);
  for (const Place& p : m.places)
    for (const float x : p) w.f32(x);
  for (const ToolForces& t : m.tools)
    for (const float x : t) w.f32(x);
  for (const ContactPoint& c : m.contacts) w.vec(c.point).vec(c.normal).vec(c.force).f32(c.gap);
  w.array(m.partners).array(m.fading).array(m.offset);
  return w.finish();
}

Bytes encode(const Hit& m) {
  return Writer(Type::kHit, 60)
      .u32(m.input)
      .i32(m.triangle)
      .f64(m.t)
      .vec(m.point)
      .vec(m.normal)
      .f32(m.beside)
      .u32(m.copy)
      .finish();
}

Bytes encode(const Stats& m) {
  return Writer(Type::kStats, 64)
      .f32(m.step_ms)
      .f32(m.step_ms_99)
      .f32(m.mechanics_ms)
      .f32(m.steps_per_second)
      .u32(m.iterations)
      .f32(m.residual)
      .counts(m.counts)
      .u32(m.pieces)
      .u32(m.dropped)
      .u32(m.bad)
      .u32(m.clients)
      .finish();
}

Bytes encode(const CutReport& m) {
  return Writer(Type::kCutReport, 64 + padded(m.text.size()))
      .u32(m.input)
      .u32(static_cast<std::uint32_t>(m.outcome))
      .u32(m.pieces)
      .u32(m.triangles)
      .f32(m.cut_and_binding_ms)
      .f32(m.embedding_ms)
      .f32(m.cut_surface_ms)
      .f32(m.total_ms)
      .counts(m.counts)
      .u32(static_cast<std::uint32_t>(m.invariants))
      .size(m.text.size())
      .text(m.text)
      .finish();
}

Bytes encode(const Role& m) { return Writer(Type::kRole, 16).u32(m.holder).u32(m.held).u32(m.clients).u32(0).finish(); }

Bytes encode(const ErrorMessage& m) {
  return Writer(Type::kError, 16 + padded(m.text.size()))
      .u32(m.input)
      .u32(static_cast<std::uint32_t>(m.code))
      .size(m.text.size())
      .u32(0)
      .text(m.text)
      .finish();
}

Bytes encode(const Overlay& m) {
  KERF_ASSERT(m.rest.size() == m.copy.size() && m.feet.size() == m.foot_rest.size());
  return Writer(Type::kOverlay, 32 + 16 * m.rest.size() + 12 * m.triangles.size() +
                                    8 * (m.bound.size() + m.links.size()) + 20 * m.feet.size())
      .u32(m.body)
      .u32(m.version)
      .size(m.rest.size())
      .size(m.triangles.size())
      .size(m.bound.size())
      .size(m.links.size())
      .size(m.feet.size())
      .u32(0)
      .array(m.rest)
      .array(m.copy)
      .array(m.triangles)
      .array(m.bound)
      .array(m.links)
      .array(m.feet)
      .array(m.foot_rest)
      .finish();
}

Bytes encode(const File& m) {
  return Writer(Type::kFile, 16 + padded(m.name.size()) + padded(m.bytes.size()))
      .u32(m.request)
      .size(m.name.size())
      .size(m.bytes.size())
      .u32(0)
      .text(m.name)
      .text(m.bytes)
      .finish();
}

Bytes encode(const Loading& m) {
  return Writer(Type::kLoading, 16 + padded(m.stage.size()))
      .u32(m.input)
      .u32(static_cast<std::uint32_t>(m.state))
      .f32(m.fraction)
      .size(m.stage.size())
      .text(m.stage)
      .finish();
}

Bytes encode(const Things& m) {
  return Writer(Type::kThings, 16 + padded(m.json.size()) + 12 * m.positions.size() + 12 * m.triangles.size())
      .u32(m.body)
      .size(m.json.size())
      .size(m.positions.size())
      .size(m.triangles.size())
      .text(m.json)
      .array(m.positions)
      .array(m.triangles)
      .finish();
}

Bytes encode(const Score& m) {
  return Writer(Type::kScore, 32)
      .f32(m.lesion_volume)
      .f32(m.lesion_removed)
      .f32(m.healthy_removed)
      .f32(m.healthy_share)
      .f32(m.roughness)
      .f32(m.largest_force)
      .f32(m.time)
      .u32(m.loose_pieces)
      .finish();
}

Bytes encode(const Fixed& m) {
  return Writer(Type::kFixed, 16 + 4 * (m.nodes.size() + m.vertices.size()))
      .u32(m.body)
      .size(m.nodes.size())
      .size(m.vertices.size())
      .u32(0)
      .array(m.nodes)
      .array(m.vertices)
      .finish();
}

Bytes encode(const Masses& m) {
  KERF_ASSERT(m.mass.size() == m.copy.size());
  Writer w(Type::kMasses, 16 + 8 * m.mass.size());
  w.u32(m.body).u32(m.version).f32(m.uncut).size(m.mass.size());
  for (const float x : m.mass) w.f32(x);
  return w.array(m.copy).finish();
}

Result<PageMessage> decode_page_message(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes)
    return bad_input(fmt::format("a message of {} bytes has no header, which has {}", bytes.size(), kHeaderBytes));
  Reader r(bytes);
  const std::uint16_t type = r.u16(), version = r.u16();
  const std::uint32_t length = r.u32();
  if (version != kVersion)
    return bad_input(fmt::format("protocol version {} instead of {}; load the page again", version, kVersion));
  if (length != bytes.size()) return bad_input(fmt::format("a message says {} bytes and has {}", length, bytes.size()));
  const bool upload = type == static_cast<std::uint16_t>(Type::kUpload);
  if (length > (upload ? kMaxUploadBytes : kMaxPageBytes))
    return bad_input(fmt::format("a message of {} bytes is too long", length));
  Result<PageMessage> message = bad_input("");
  switch (static_cast<Type>(type)) {
    case Type::kPageHello: {
      PageHello m;
      m.protocol = r.u32();
      r.u32();
      m.session = r.u64();
      m.body = r.u32();
      m.version = r.u32();
      message = PageMessage(m);
      break;
    }
    case Type::kAck: {
      Ack m;
      m.seq = r.u32();
      r.u32();
      message = PageMessage(m);
      break;
    }
    case Type::kTool: message = read_tool(r); break;
    case Type::kRay: {
      RayQuery m;
      m.input = r.u32();
      m.near = r.f32();
      if (const Status read = read_ray(r, m.ray); !read) return read.error();
      if (!(m.near >= 0 && m.near <= kFarthest)) return bad_input("a ray's width is negative or too large");
      message = PageMessage(m);
      break;
    }
    case Type::kCommand: message = read_command(r); break;
    case Type::kClaim: {
      const std::uint32_t take = r.u32();
      r.u32();
      if (take > 1) return bad_input(fmt::format("a claim is 0 or 1, not {}", take));
      message = PageMessage(Claim{take == 1});
      break;
    }
    case Type::kUpload: message = read_upload(r); break;
    case Type::kDevice: message = read_device(r); break;
    default: return bad_input(fmt::format("there is no page message {}", type));
  }
  if (message.ok() && !r.complete())
    return bad_input(fmt::format("a message of type {} can't have {} bytes", type, length));
  return message;
}

std::uint32_t input_of(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes + 4) return 0;
  Reader r(bytes);
  const auto type = static_cast<Type>(r.u16());
  r.u16();
  r.u32();
  return type == Type::kTool || type == Type::kRay || type == Type::kCommand || type == Type::kDevice ? r.u32() : 0;
}

}  // namespace kerf::protocol
