#include "kerf/embedding/skin.h"

#include <cstring>

#include "kerf/base/at.h"

namespace kerf {
namespace {

/// A vertex's local coordinates and scaled normal into a lane. cof(F) n = cof(dx/dlocal) diag(h) R' n up to a factor.
void fill_lane(const CellComplex& body, const HexMesh& hex, VisualVertex v, SkinBlock& block, int lane) {
  const Vec3 local = hex.local(block.copy, body.visual.rest[v]);
  const LatticeFrame& frame = hex.frame_of(block.copy);
  const Vec3 n = transposed_times(frame.axes, to_double(body.visual.normal[v]));
  const Vec3 m = normalized({n.x * frame.cell.x, n.y * frame.cell.y, n.z * frame.cell.z});
  const std::size_t l = at(lane);
  block.x[l] = static_cast<float>(local.x), block.y[l] = static_cast<float>(local.y),
  block.z[l] = static_cast<float>(local.z);
  block.nx[l] = static_cast<float>(m.x), block.ny[l] = static_cast<float>(m.y), block.nz[l] = static_cast<float>(m.z);
  block.vertex[l] = v.value;
}

/// Each vertex once: who cuts without ever looking must not fill the memory.
void note(Skin& skin, VisualVertex v) {
  if (v.index() >= skin.noted.size()) skin.noted.resize(v.index() + 1, 0);
  if (skin.noted[v.index()] != 0) return;
  skin.noted[v.index()] = 1;
  skin.dirty.push_back(v);
}

void remove(Skin& skin, VisualVertex v) {
  const std::int32_t slot = skin.slot[v.index()];
  if (slot < 0) return;
  skin.slot[v.index()] = -1;
  SkinBlock& block = skin.blocks[at(slot / kSkinLanes)];
  // The last lane of the copy's first block, the only one that may not be full, takes its place.
  const std::int32_t first = skin.first_block[block.copy.index()];
  SkinBlock& tail = skin.blocks[at(first)];
  const std::size_t last = at(--tail.count), here = at(slot % kSkinLanes);
  if (tail.vertex[last] != v.value) {
    block.x[here] = tail.x[last], block.y[here] = tail.y[last], block.z[here] = tail.z[last];
    block.nx[here] = tail.nx[last], block.ny[here] = tail.ny[last], block.nz[here] = tail.nz[last];
    block.vertex[here] = tail.vertex[last];
    skin.slot[at(block.vertex[here])] = slot;
  }
  if (tail.count == 0) {
    skin.first_block[tail.copy.index()] = tail.next;
    tail.copy = {};
    tail.next = skin.free_block;
    skin.free_block = first;
  }
}

void insert(const CellComplex& body, const HexMesh& hex, Skin& skin, VisualVertex v, HexId copy) {
  std::int32_t first = skin.first_block[copy.index()];
  if (first < 0 || skin.blocks[at(first)].count == kSkinLanes) {
    std::int32_t fresh = skin.free_block;
    if (fresh >= 0) {
      skin.free_block = skin.blocks[at(fresh)].next;
    } else {
      fresh = static_cast<std::int32_t>(skin.blocks.size());
      skin.blocks.emplace_back();
    }
    SkinBlock& block = skin.blocks[at(fresh)];
    block.copy = copy;
    block.count = 0;
    block.next = first;
    skin.first_block[copy.index()] = first = fresh;
  }
  SkinBlock& block = skin.blocks[at(first)];
  fill_lane(body, hex, v, block, block.count);
  skin.slot[v.index()] = first * kSkinLanes + block.count++;
}

/// Monomials 1, xi, eta, xi eta, zeta, ... of the three coordinates, from the corners.
void polynomial(const HexMesh& hex, HexId h, std::span<const Vec3> nodes, std::array<float, 24>& out) {
  Vec3 a[8];
  for (std::size_t c = 0; c < 8; ++c) a[c] = nodes[hex.nodes[h][c].index()];
  for (std::size_t bit = 1; bit < 8; bit <<= 1)
    for (std::size_t c = 0; c < 8; ++c)
      if ((c & bit) == 0) {
        const Vec3 lo = a[c], hi = a[c | bit];
        a[c] = 0.5 * (lo + hi);
        a[c | bit] = 0.5 * (hi - lo);
      }
  for (std::size_t c = 0; c < 8; ++c) {
    out[c] = static_cast<float>(a[c].x);
    out[8 + c] = static_cast<float>(a[c].y);
    out[16 + c] = static_cast<float>(a[c].z);
  }
}

/// Eight floats in a vector register (of g++ and clang; several smaller ones where the machine has none so wide).
using Lanes = float __attribute__((vector_size(4 * kSkinLanes)));
using LaneBits = std::int32_t __attribute__((vector_size(4 * kSkinLanes)));

inline Lanes load(const std::array<float, kSkinLanes>& a) {
  Lanes v;
  std::memcpy(&v, a.data(), sizeof v);
  return v;
}

/// 1 / sqrt(s) to float precision in plain arithmetic: the same bits everywhere.
inline Lanes inverse_square_root(Lanes s) {
  Lanes r = reinterpret_cast<Lanes>(0x5f375a86 - (reinterpret_cast<LaneBits>(s) >> 1));
  const Lanes half = 0.5f * s;
  for (int i = 0; i < 3; ++i) r *= 1.5f - half * r * r;
  return r;
}

/// x and y of a vertex go out together.
using Pairs = double __attribute__((vector_size(4 * kSkinLanes)));
inline void store(const SkinBlock& b, Lanes x, Lanes y, Lanes z, std::span<Vec3f> out) {
  if (b.count == kSkinLanes) {
    const Pairs low = reinterpret_cast<Pairs>(__builtin_shufflevector(x, y, 0, 8, 1, 9, 4, 12, 5, 13));
    const Pairs high = reinterpret_cast<Pairs>(__builtin_shufflevector(x, y, 2, 10, 3, 11, 6, 14, 7, 15));
    const auto put = [&](std::size_t l, double xy, float last) {
      Vec3f& to = out[at(b.vertex[l])];
      std::memcpy(&to.x, &xy, sizeof xy);
      to.z = last;
    };
    put(0, low[0], z[0]), put(1, low[1], z[1]), put(2, high[0], z[2]), put(3, high[1], z[3]);
    put(4, low[2], z[4]), put(5, low[3], z[5]), put(6, high[2], z[6]), put(7, high[3], z[7]);
  } else {
    for (std::int32_t l = 0; l < b.count; ++l) out[at(b.vertex[at(l)])] = {x[l], y[l], z[l]};
  }
}

}  // namespace

void build_skin(const CellComplex& body, const HexMesh& hex, const Embedding& embedding, Skin& skin) {
  skin = {};
  skin.slot.assign(embedding.visual.size(), -1);
  skin.first_block.assign(hex.hex_count(), -1);
  // Copy by copy, vertices ascending: neighbours in memory are evaluated together.
  std::vector<std::int32_t> start(hex.hex_count() + 1, 0);
  for (const HexId h : embedding.visual.raw())
    if (h.valid()) ++start[h.index() + 1];
  for (std::size_t h = 0; h < hex.hex_count(); ++h) start[h + 1] += start[h];
  std::vector<VisualVertex> sorted(at(start.back()));
  {
    std::vector<std::int32_t> cursor(start.begin(), start.end() - 1);
    for (const VisualVertex v : ids<VisualVertex>(embedding.visual.size()))
      if (const HexId h = embedding.visual[v]; h.valid()) sorted[at(cursor[h.index()]++)] = v;
  }
  skin.blocks.reserve(sorted.size() / kSkinLanes + 2 * hex.hex_count());
  for (const HexId h : ids<HexId>(hex.hex_count()))
    for (std::int32_t i = start[h.index()]; i < start[h.index() + 1]; ++i) insert(body, hex, skin, sorted[at(i)], h);
}

void note_moved(Skin& skin, std::span<const VisualVertex> moved) {
  for (const VisualVertex v : moved) note(skin, v);
}

void note_rollback(Skin& skin, const Embedding& embedding, Journaled<VisualVertex, HexId>::Mark to) {
  embedding.visual.for_each_changed(to, [&](VisualVertex v) { note(skin, v); });
  for (std::size_t v = to.size; v < embedding.visual.size(); ++v) note(skin, VisualVertex(v));
}

void note_step(Skin& skin, const JournalStep& step) {
  const JournalSegment& visual = step.arrays[0];
  for (const std::uint32_t v : visual.indices) note(skin, VisualVertex(std::size_t{v}));
  // Vertices that the step made are found by their number.
  for (std::size_t v = visual.base_size; v < skin.slot.size(); ++v) note(skin, VisualVertex(v));
}

void refresh_skin(const CellComplex& body, const HexMesh& hex, const Embedding& embedding, Skin& skin) {
  const std::size_t n = embedding.visual.size();
  for (std::size_t v = n; v < skin.slot.size(); ++v) remove(skin, VisualVertex(v));
  for (std::size_t v = skin.slot.size(); v < n; ++v) note(skin, VisualVertex(v));
  skin.slot.resize(n, -1);
  if (skin.first_block.size() < hex.hex_count()) skin.first_block.resize(hex.hex_count(), -1);
  for (const VisualVertex v : skin.dirty) {
    skin.noted[v.index()] = 0;
    if (v.index() >= n) continue;
    remove(skin, v);
    if (embedding.visual[v].valid()) insert(body, hex, skin, v, embedding.visual[v]);
  }
  skin.dirty.clear();
}

void evaluate_skin(const HexMesh& hex, Skin& skin, std::span<const Vec3> nodes, std::span<Vec3f> positions,
                   std::span<Vec3f> normals) {
  KERF_ASSERT(positions.size() == skin.slot.size() && (normals.empty() || normals.size() == positions.size()));
  skin.coefficients.resize(skin.first_block.size());
  for (std::size_t h = 0; h < skin.first_block.size(); ++h)
    if (skin.first_block[h] >= 0) polynomial(hex, HexId(h), nodes, skin.coefficients[h]);
  const bool with_normals = !normals.empty();
  for (const SkinBlock& b : skin.blocks) {
    if (b.count == 0) continue;
    const float* a = skin.coefficients[b.copy.index()].data();
    const Lanes u = load(b.x), v = load(b.y), w = load(b.z);
    // Coordinate by coordinate: c0 + u c1 + v (c2 + u c3) + w (c4 + u c5 + v (c6 + u c7)), and its derivatives.
    Lanes value[3], du[3], dv[3], dw[3];
    for (int i = 0; i < 3; ++i) {
      const float* c = a + 8 * i;
      const Lanes low_v = c[2] + u * c[3], high_v = c[6] + u * c[7];
      const Lanes low = (c[0] + u * c[1]) + v * low_v;
      dw[i] = (c[4] + u * c[5]) + v * high_v;
      value[i] = low + w * dw[i];
      dv[i] = low_v + w * high_v;
      du[i] = (c[1] + v * c[3]) + w * (c[5] + v * c[7]);
    }
    store(b, value[0], value[1], value[2], positions);
    if (!with_normals) continue;
    const Lanes p = load(b.nx), q = load(b.ny), r = load(b.nz);
    Lanes n[3];
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      n[i] = p * (dv[j] * dw[k] - dv[k] * dw[j]) + q * (dw[j] * du[k] - dw[k] * du[j]) +
             r * (du[j] * dv[k] - du[k] * dv[j]);
    }
    const Lanes scale = inverse_square_root(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] + 1e-37f);
    store(b, n[0] * scale, n[1] * scale, n[2] * scale, normals);
  }
}

}  // namespace kerf
