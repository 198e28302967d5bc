#include "kerf/binding/bound_body_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "kerf/base/hash.h"
#include "kerf/base/shown_text.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/mesh/surface_tolerances.h"
#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the file layout is the memory layout of little-endian machines");

/// The first version whose closed bodies are bound on a squashed surface.
constexpr std::uint32_t kSquashedVersion = 3;

constexpr int kMostHintedCells = 1 << 20;  // along an axis
constexpr char kMagic[8] = {'K', 'E', 'R', 'F', 'B', 'O', 'D', 'Y'};

/// Pool runs have padding bytes in memory; in files they are three numbers.
struct StoredRun {
  std::int32_t first = 0, count = 0, reversed = 0;
};
StoredRun stored(PoolRun r) { return {r.first, r.count, r.reversed}; }
PoolRun restored(StoredRun r) { return {r.first, r.count, r.reversed != 0}; }
std::array<StoredRun, 2> stored(const std::array<PoolRun, 2>& r) { return {stored(r[0]), stored(r[1])}; }
std::array<PoolRun, 2> restored(const std::array<StoredRun, 2>& r) { return {restored(r[0]), restored(r[1])}; }
template <class T>
concept HasPadding = requires(const T& x) {
  stored(x);
};

/// The numbers of the report in file order, as of `version`.
template <class Report, class F>
void for_each_number(Report& r, std::uint32_t version, F&& f) {
  f(r.closed), f(r.flipped_collision), f(r.flipped_visual);
  f(r.merged_vertices), f(r.unused_vertices), f(r.input_vertices), f(r.input_triangles), f(r.visual_vertices),
      f(r.visual_triangles);
  f(r.inserted_points), f(r.snapped_points), f(r.paths), f(r.rim_followed), f(r.divided_edges), f(r.uniform_patches);
  f(r.path_length), f(r.area_before), f(r.area_after), f(r.volume_before), f(r.volume_after);
  auto& s = r.seconds;  // zeros: the same meshes give the same file, however long it took; older files have times
  f(s.prepare), f(s.vertices), f(s.paths), f(s.patches), f(s.parameters), f(s.assemble), f(s.total);
  if (version >= kSquashedVersion) f(r.led_vertices), f(r.crossed_normals), f(r.upright_patches), f(r.upright);
}

/// Writes to a file, or to a text in memory.
class Writer {
 public:
  explicit Writer(ReplacingFile& file) : file_(&file) {}
  explicit Writer(std::string& memory) : memory_(&memory) {}
  void bytes(const void* data, std::size_t n) {
    const std::string_view text(static_cast<const char*>(data), n);
    if (n > 0 && file_) file_->write(text);
    if (n > 0 && memory_) memory_->append(text);
    hash_.add_bytes(data, n);
  }
  template <class T>
  void value(const T& x) {
    bytes(&x, sizeof x);
  }
  template <class T>
  void array(const std::vector<T>& items) {
    value(std::uint64_t{items.size()});
    value(std::uint32_t{sizeof(T)});
    bytes(items.data(), items.size() * sizeof(T));
  }
  [[nodiscard]] std::uint64_t hash() const { return hash_.value(); }

 private:
  ReplacingFile* file_ = nullptr;
  std::string* memory_ = nullptr;
  Hash hash_;
};

/// After the first failure all reads give zeros and empty arrays.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  void bytes(void* data, std::size_t n) {
    if (!ok_ || n > bytes_.size()) {
      ok_ = false;
      if (n > 0) std::memset(data, 0, n);
      return;
    }
    if (n > 0) std::memcpy(data, bytes_.data(), n);
    bytes_.remove_prefix(n);
    hash_.add_bytes(data, n);
  }
  template <class T>
  void value(T& x) {
    bytes(&x, sizeof x);
  }
  template <class T>
  void array(std::vector<T>& items) {
    std::uint64_t count = 0;
    std::uint32_t size = 0;
    value(count);
    value(size);
    if (!ok_ || size != sizeof(T) || count > left() / sizeof(T) || count > 0x7fffffff) {
      ok_ = false;
      return;
    }
    items.resize(count);
    bytes(static_cast<void*>(items.data()), count * sizeof(T));
  }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::uint64_t left() const { return bytes_.size(); }
  [[nodiscard]] std::uint64_t hash() const { return hash_.value(); }

 private:
  std::string_view bytes_;
  Hash hash_;
  bool ok_ = true;
};

void write_body(Writer& w, BoundBody& body) {
  w.bytes(kMagic, sizeof kMagic);
  w.value(kBoundBodyVersion);
  w.value(std::uint32_t{body.complex.closed ? 1u : 0u});
  w.value(body.complex.mean_root_edge);
  body.complex.for_each_array([&]<class Id, class T>(Journaled<Id, T>& a) {
    if constexpr (HasPadding<T>) {
      std::vector<decltype(stored(std::declval<T>()))> items;
      items.reserve(a.size());
      for (const T& x : a.raw()) items.push_back(stored(x));
      w.array(items);
    } else {
      w.array(a.raw());
    }
  });
  BindReport report = body.report;
  report.seconds = {};
  for_each_number(report, kBoundBodyVersion, [&]<class T>(const T& x) {
    if constexpr (std::is_same_v<T, bool>) w.value(std::uint8_t{x});
    else w.value(x);
  });
  w.value(std::uint64_t{body.report.warnings.size()});
  for (const std::string& s : body.report.warnings) w.array(std::vector<char>(s.begin(), s.end()));
}

void read_body(Reader& r, std::uint32_t version, BoundBody& body) {
  std::uint32_t flags = 0;
  r.value(flags);
  body.complex.closed = flags == 1;
  r.value(body.complex.mean_root_edge);
  body.complex.for_each_array([&]<class Id, class T>(Journaled<Id, T>& a) {
    if constexpr (HasPadding<T>) {
      std::vector<decltype(stored(std::declval<T>()))> items;
      r.array(items);
      std::vector<T> values;
      values.reserve(items.size());
      for (const auto& x : items) values.push_back(restored(x));
      a = Journaled<Id, T>(std::move(values));
    } else {
      std::vector<T> items;
      r.array(items);
      a = Journaled<Id, T>(std::move(items));
    }
  });
  for_each_number(body.report, version, [&]<class T>(T& x) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      r.value(byte);
      x = byte == 1;
    } else {
      r.value(x);
    }
  });
  std::uint64_t warnings = 0;
  r.value(warnings);
  for (std::uint64_t i = 0; i < warnings && r.ok(); ++i) {
    std::vector<char> text;
    r.array(text);
    body.report.warnings.emplace_back(text.begin(), text.end());
  }
}

void write_nature(Writer& w, const BodyNature& nature) {
  const std::optional<double>* numbers[] = {&nature.young, &nature.poisson, &nature.density};
  std::uint8_t known = nature.lattice ? 8 : 0;
  for (std::size_t i = 0; i < 3; ++i) known = static_cast<std::uint8_t>(known | (*numbers[i] ? 1u << i : 0u));
  w.value(known);
  for (const auto* number : numbers) w.value(number->value_or(0));
  const LatticeHint lattice = nature.lattice.value_or(LatticeHint{});
  for (const Vec3 v : {lattice.origin, lattice.cell})
    for (int i = 0; i < 3; ++i) w.value(v[i]);
  for (const int n : lattice.cells) w.value(static_cast<std::int32_t>(n));
}

/// False where it can't be.
bool read_nature(Reader& r, BodyNature& nature) {
  std::uint8_t known = 0;
  r.value(known);
  double numbers[3];
  for (double& x : numbers) r.value(x);
  LatticeHint lattice;
  for (Vec3* v : {&lattice.origin, &lattice.cell})
    for (int i = 0; i < 3; ++i) r.value((*v)[i]);
  for (int& n : lattice.cells) {
    std::int32_t stored_count = 0;
    r.value(stored_count);
    n = stored_count;
  }
  bool sound = known < 16;
  const auto take = [&](int i, std::optional<double>& to, double least, double most) {
    if (!(known >> i & 1)) return;
    to = numbers[i];
    sound = sound && *to > least && *to < most;
  };
  take(0, nature.young, 0, HUGE_VAL);
  take(1, nature.poisson, -1, 0.5);
  take(2, nature.density, 0, HUGE_VAL);
  if (known & 8) {
    sound = sound && is_finite(lattice.origin) && is_finite(lattice.cell);
    for (int i = 0; i < 3; ++i) {
      const int n = lattice.cells[static_cast<std::size_t>(i)];
      sound = sound && lattice.cell[i] > 0 && n > 0 && n <= kMostHintedCells;
    }
    nature.lattice = lattice;
  }
  return sound;
}

/// What lies out of all scale, as of meshes; empty: nothing.
std::string scale_fault(const CellComplex& x, const BodyNature& nature) {
  Box3 box;
  for (const Vec3 p : x.visual.rest.raw()) box.add(p);
  for (const CollisionVertex v : ids<CollisionVertex>(x.collision.vertex_count()))
    for (const double side : {1.0, -1.0}) box.add(x.collision.rest[v] + side * x.collision.offset[v]);
  if (const auto fault = extent_fault(box)) return "the body is " + fault->what;
  if (!(x.mean_root_edge <= kLargestDiagonal))
    return fmt::format("the collision mesh has a mean edge of {:.3g} m", x.mean_root_edge);
  const auto is_far = [](Vec2 p) { return !(std::abs(p.x) <= kLargestDiagonal && std::abs(p.y) <= kLargestDiagonal); };
  if (std::any_of(x.visual.planar.raw().begin(), x.visual.planar.raw().end(), is_far) ||
      std::any_of(x.collision.planar.raw().begin(), x.collision.planar.raw().end(), is_far))
    return fmt::format("a parameter lies farther than {:g} m from its triangle", kLargestDiagonal);
  if (!nature.lattice) return {};
  const LatticeHint& lattice = *nature.lattice;
  for (int i = 0; i < 3; ++i) {
    const double length = lattice.cells[static_cast<std::size_t>(i)] * lattice.cell[i];
    if (!(length <= kLargestDiagonal && std::abs(lattice.origin[i]) <= kLargestDiagonal))
      return fmt::format("the lattice begins at {:.3g} m and is {:.3g} m long, {:g} m are the most", lattice.origin[i],
                         length, kLargestDiagonal);
  }
  return {};
}

/// Magic and version.
Status check_start(std::string_view first, const std::string& name) {
  Reader r(first);
  char magic[sizeof kMagic];
  std::uint32_t version = 0;
  r.bytes(magic, sizeof magic);
  r.value(version);
  if (!r.ok() || std::memcmp(magic, kMagic, sizeof magic) != 0)
    return bad_input(fmt::format("{}: is not a bound body; make one with kerf bind", shown(name)));
  if (version < 1 || version > kBoundBodyVersion)
    return bad_input(fmt::format("{}: has version {}, this program reads versions 1 to {}; bind the body again",
                                 shown(name), version, kBoundBodyVersion));
  return {};
}

void write_all(Writer w, const BoundBody& body, const BodyNature& nature) {
  // Only reads: the arrays are visited through the one function that lists them.
  write_body(w, const_cast<BoundBody&>(body));
  write_nature(w, nature);
  w.value(w.hash());
}

}  // namespace

Status save_bound_body(const BoundBody& body, const std::filesystem::path& file, const BodyNature& nature) {
  ReplacingFile out(file.string());
  write_all(Writer(out), body, nature);
  return out.commit();
}

std::string bound_body_bytes(const BoundBody& body, const BodyNature& nature) {
  std::string out;
  write_all(Writer(out), body, nature);
  return out;
}

Result<BoundBody> load_bound_body(const std::filesystem::path& file, BodyNature* nature) {
  const std::string path = file.string();
  const FileKind kind{"a bound body", kMostBodyBytes, "bind a coarser mesh", check_start};
  const auto bytes = read_whole_file(path, kind);
  if (!bytes) return bytes.error();
  return within_memory(path, [&] { return parse_bound_body(bytes->view(), path, nature); });
}

Result<BoundBody> parse_bound_body(std::string_view bytes, const std::string& name, BodyNature* nature) {
  const auto bad = [&](const std::string& why) { return bad_input(fmt::format("{}: {}", shown(name), why)); };
  KERF_TRY(check_start(bytes, name));
  Reader r(bytes);
  char magic[sizeof kMagic];
  std::uint32_t version = 0;
  r.bytes(magic, sizeof magic);
  r.value(version);
  BoundBody body;
  read_body(r, version, body);
  BodyNature known;
  const bool sound = version < 2 || read_nature(r, known);
  const std::uint64_t expected = r.hash();
  std::uint64_t written = 0;
  r.value(written);
  if (!r.ok()) return bad("is truncated or damaged; bind the body again");
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
  written = expected;  // a fuzzer does not get past a checksum
#endif
  if (r.left() != 0 || written != expected) return bad("is damaged (its checksum is wrong); bind the body again");
  if (!sound) return bad("holds a material or a lattice that can't be; bind the body again");
  if (const Status valid = validate_binding(body.complex); !valid)
    return bad(valid.error().message + "; bind the body again");
  if (const std::string fault = scale_fault(body.complex, known); !fault.empty())
    return bad(fault + "; the file is damaged: bind the body again");
  if (nature) *nature = known;
  if (body.complex.closed) body.report.displacement = measure_displacement(body.complex);
  if (version < kSquashedVersion && body.complex.closed)
    body.report.warnings.push_back(fmt::format(
        "the file has version {}: walls of cuts near the rim will be drawn beside the blade; bind the body again",
        version));
  return body;
}

}  // namespace kerf
