#include "kerf/cutting/piece_labels.h"

#include <algorithm>
#include <utility>

#include "kerf/base/at.h"
#include "kerf/cutting/pieces.h"

namespace kerf {
namespace {

using F = CollisionTriangle;

}  // namespace

std::int32_t PieceLabels::root_of(std::int32_t cluster) {
  while (clusters_[at(cluster)].joined != cluster)
    cluster = clusters_[at(cluster)].joined = clusters_[at(clusters_[at(cluster)].joined)].joined;
  return cluster;
}

void PieceLabels::join(std::int32_t a, std::int32_t b) {
  a = root_of(a), b = root_of(b);
  if (a == b) return;
  if (b < a) std::swap(a, b);
  clusters_[at(b)].joined = a;
  clusters_[at(a)].label = std::max(clusters_[at(a)].label, clusters_[at(b)].label);  // one of them may not know it
}

/// One face further.
void PieceLabels::look_around(const CollisionMesh& mesh, std::int32_t cluster) {
  Cluster& c = clusters_[at(cluster)];
  const F face = c.faces[c.next++];
  for (int i = 0; i < 3; ++i) {
    const CollisionHalfEdge twin = mesh.twin[CollisionMesh::corner(face, i)];
    if (!twin.valid()) continue;
    const F other = CollisionMesh::face(twin);
    if (const std::int32_t there = reached_[other.index()]; there >= 0) {
      join(cluster, there);
      continue;
    }
    reached_[other.index()] = cluster;
    c.faces.push_back(other);
    std::int32_t& label = clusters_[at(root_of(cluster))].label;
    label = std::max(label, label_[other.index()]);
  }
}

/// Does nothing else that still grows belong to the piece that this cluster was part of?
bool PieceLabels::is_settled(std::int32_t cluster) {
  const std::int32_t root = root_of(cluster);
  if (clusters_[at(root)].label < 0) return false;
  for (std::size_t i = 0; i < used_; ++i) {
    const std::int32_t other = root_of(static_cast<std::int32_t>(i));
    if (other == root || !clusters_[i].open()) continue;
    const std::int32_t label = clusters_[at(other)].label;
    if (label < 0 || label == clusters_[at(root)].label) return false;
  }
  return true;
}

std::int32_t PieceLabels::count_all(const CollisionMesh& mesh) {
  Pieces all = collision_pieces(mesh);
  label_ = std::move(all.of_face);
  reached_.assign(mesh.face_count(), -1);
  pieces_ = next_label_ = all.count;
  return pieces_;
}

std::int32_t PieceLabels::count(const CollisionMesh& mesh, std::span<const CollisionTriangle> changed) {
  if (label_.empty()) return count_all(mesh);
  const std::size_t before = std::min(label_.size(), mesh.face_count());
  label_.resize(before);
  label_.resize(mesh.face_count(), -1);
  reached_.resize(mesh.face_count(), -1);

  seeds_.clear();
  for (const F f : changed)
    if (f.index() < before) seeds_.push_back(f);
  for (std::size_t f = before; f < mesh.face_count(); ++f) seeds_.emplace_back(f);
  std::sort(seeds_.begin(), seeds_.end());
  seeds_.erase(std::unique(seeds_.begin(), seeds_.end()), seeds_.end());

  // Each seed is a cluster with its neighbours among the seeds: marked first, so that growing stops there.
  constexpr std::int32_t kSeed = INT32_MAX;
  for (const F f : seeds_) reached_[f.index()] = kSeed;
  used_ = 0;
  for (const F seed : seeds_) {
    if (reached_[seed.index()] != kSeed) continue;
    if (clusters_.size() == used_) clusters_.emplace_back();
    Cluster& c = clusters_[used_];
    c.faces.assign(1, seed);
    c.next = 0;
    c.joined = static_cast<std::int32_t>(used_);
    c.label = -1;
    reached_[seed.index()] = c.joined;
    for (std::size_t i = 0; i < c.faces.size(); ++i) {
      c.label = std::max(c.label, label_[c.faces[i].index()]);
      for (int k = 0; k < 3; ++k) {
        const CollisionHalfEdge twin = mesh.twin[CollisionMesh::corner(c.faces[i], k)];
        if (!twin.valid() || reached_[CollisionMesh::face(twin).index()] != kSeed) continue;
        reached_[CollisionMesh::face(twin).index()] = c.joined;
        c.faces.push_back(CollisionMesh::face(twin));
      }
    }
    ++used_;
  }
  const auto clusters = static_cast<std::int32_t>(used_);
  for (bool grows = true; grows;) {
    grows = false;
    for (std::int32_t i = 0; i < clusters; ++i) {
      if (!clusters_[at(i)].open() || is_settled(i)) continue;
      look_around(mesh, i);
      grows = true;
    }
  }

  // What is open has kept its label; of those that are whole, the first of a piece without an open one keeps it.
  std::vector<std::int32_t> taken;
  const auto is_open = [&](std::int32_t root) {
    for (std::int32_t i = 0; i < clusters; ++i)
      if (root_of(i) == root && clusters_[at(i)].open()) return true;
    return false;
  };
  std::vector<std::int32_t> roots;
  for (std::int32_t i = 0; i < clusters; ++i)
    if (root_of(i) == i) roots.push_back(i);
  std::stable_partition(roots.begin(), roots.end(), is_open);
  std::vector<std::int32_t> label_of(used_, -1);
  for (const std::int32_t root : roots) {
    const std::int32_t label = clusters_[at(root)].label;
    const bool free = label >= 0 && std::find(taken.begin(), taken.end(), label) == taken.end();
    if (free) taken.push_back(label);
    else ++pieces_;
    label_of[at(root)] = free ? label : next_label_++;
  }
  for (std::int32_t i = 0; i < clusters; ++i)
    for (const F f : clusters_[at(i)].faces) {
      label_[f.index()] = label_of[at(root_of(i))];
      reached_[f.index()] = -1;
    }
  return pieces_;
}

}  // namespace kerf
