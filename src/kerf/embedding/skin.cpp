#include "kerf/embedding/skin.h"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

/// A vertex's local coordinates and scaled normal into a lane. cof(F) n = cof(dx/dlocal) diag(h) R' n up to a factor.
void fill_lane(const CellComplex& body, const HexMesh& hex, VisualVertex v, SkinBlock& block, int lane) {
  const Vec3 local = hex.local(block.copy, body.visual.rest[v]);
  const Vec3 n = transposed_times(hex.frame.axes, to_double(body.visual.normal[v]));
  const Vec3 m = normalized({n.x * hex.frame.cell.x, n.y * hex.frame.cell.y, n.z * hex.frame.cell.z});
  const std::size_t l = at(lane);
  block.x[l] = static_cast<float>(local.x), block.y[l] = static_cast<float>(local.y), block.z[l] = static_cast<float>(local.z);
  block.nx[l] = static_cast<float>(m.x), block.ny[l] = static_cast<float>(m.y), block.nz[l] = static_cast<float>(m.z);
  block.vertex[l] = v.value;
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

using Lanes = std::array<float, kSkinLanes>;

/// Value and gradient of one coordinate at the eight lanes.
inline void evaluate_lanes(const float* a, const SkinBlock& b, Lanes& value) {
  for (std::size_t l = 0; l < kSkinLanes; ++l) {
    const float x = b.x[l], y = b.y[l], z = b.z[l];
    value[l] = (a[0] + x * a[1] + y * (a[2] + x * a[3])) + z * (a[4] + x * a[5] + y * (a[6] + x * a[7]));
  }
}
inline void gradient_lanes(const float* a, const SkinBlock& b, Lanes& dx, Lanes& dy, Lanes& dz) {
  for (std::size_t l = 0; l < kSkinLanes; ++l) {
    const float x = b.x[l], y = b.y[l], z = b.z[l];
    dx[l] = a[1] + y * a[3] + z * (a[5] + y * a[7]);
    dy[l] = a[2] + x * a[3] + z * (a[6] + x * a[7]);
    dz[l] = a[4] + x * a[5] + y * (a[6] + x * a[7]);
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
  skin.dirty.insert(skin.dirty.end(), moved.begin(), moved.end());
}

void note_rollback(Skin& skin, const Embedding& embedding, Journaled<VisualVertex, HexId>::Mark to) {
  embedding.visual.for_each_changed(to, [&](VisualVertex v) { skin.dirty.push_back(v); });
  for (std::size_t v = to.size; v < embedding.visual.size(); ++v) skin.dirty.push_back(VisualVertex(v));
}

void note_step(Skin& skin, const JournalStep& step) {
  const JournalSegment& visual = step.arrays[0];
  for (const std::uint32_t v : visual.indices) skin.dirty.push_back(VisualVertex(std::size_t{v}));
  // Vertices that the step made are found by their number.
  for (std::size_t v = visual.base_size; v < skin.slot.size(); ++v) skin.dirty.push_back(VisualVertex(v));
}

void refresh_skin(const CellComplex& body, const HexMesh& hex, const Embedding& embedding, Skin& skin) {
  const std::size_t n = embedding.visual.size();
  for (std::size_t v = n; v < skin.slot.size(); ++v) remove(skin, VisualVertex(v));
  for (std::size_t v = skin.slot.size(); v < n; ++v) skin.dirty.push_back(VisualVertex(v));
  skin.slot.resize(n, -1);
  if (skin.first_block.size() < hex.hex_count()) skin.first_block.resize(hex.hex_count(), -1);
  for (const VisualVertex v : skin.dirty) {
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
    Lanes x, y, z;
    evaluate_lanes(a, b, x);
    evaluate_lanes(a + 8, b, y);
    evaluate_lanes(a + 16, b, z);
    for (std::int32_t l = 0; l < b.count; ++l) positions[at(b.vertex[at(l)])] = {x[at(l)], y[at(l)], z[at(l)]};
    if (!with_normals) continue;
    Lanes xx, xy, xz, yx, yy, yz, zx, zy, zz;  // [coordinate][derivative]
    gradient_lanes(a, b, xx, xy, xz);
    gradient_lanes(a + 8, b, yx, yy, yz);
    gradient_lanes(a + 16, b, zx, zy, zz);
    for (std::size_t l = 0; l < kSkinLanes; ++l) {
      const float p = b.nx[l], q = b.ny[l], r = b.nz[l];
      x[l] = p * (yy[l] * zz[l] - zy[l] * yz[l]) + q * (yz[l] * zx[l] - zz[l] * yx[l]) + r * (yx[l] * zy[l] - zx[l] * yy[l]);
      y[l] = p * (zy[l] * xz[l] - xy[l] * zz[l]) + q * (zz[l] * xx[l] - xz[l] * zx[l]) + r * (zx[l] * xy[l] - xx[l] * zy[l]);
      z[l] = p * (xy[l] * yz[l] - yy[l] * xz[l]) + q * (xz[l] * yx[l] - yz[l] * xx[l]) + r * (xx[l] * yy[l] - yx[l] * xy[l]);
    }
    for (std::size_t l = 0; l < kSkinLanes; ++l) {
      const float square = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
      const float scale = 1.0f / std::sqrt(std::max(square, 1e-37f));
      x[l] *= scale, y[l] *= scale, z[l] *= scale;
    }
    for (std::int32_t l = 0; l < b.count; ++l) normals[at(b.vertex[at(l)])] = {x[at(l)], y[at(l)], z[at(l)]};
  }
}

}  // namespace kerf
