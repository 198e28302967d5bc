// Smooth pseudo-random functions of space, for solid textures. The same everywhere, no tables.
#pragma once

#include <cmath>
#include <cstdint>

#include "kerf/base/vec.h"

namespace kerf {

constexpr std::uint64_t kLatticeX = 0x9e3779b97f4a7c15ull, kLatticeY = 0xc2b2ae3d27d4eb4full,
                        kLatticeZ = 0x165667b19e3779f9ull;

/// Of three coordinates, each times its factor.
inline double hashed_value(std::uint64_t h) {
  h ^= h >> 29;
  h *= 0xbf58476d1ce4e5b9ull;
  h ^= h >> 32;
  return static_cast<double>(static_cast<std::int64_t>(h >> 11)) * 0x1p-52 - 1;
}
inline double lattice_value(std::int64_t x, std::int64_t y, std::int64_t z) {
  return hashed_value(static_cast<std::uint64_t>(x) * kLatticeX ^ static_cast<std::uint64_t>(y) * kLatticeY ^
                      static_cast<std::uint64_t>(z) * kLatticeZ);
}

/// Value noise in about [-1, 1], features of size 1.
inline double noise(Vec3 p) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto factor = [](double f, std::uint64_t by) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(f)) * by;
  };
  const std::uint64_t x0 = factor(fx, kLatticeX), x1 = x0 + kLatticeX;
  const std::uint64_t y0 = factor(fy, kLatticeY), y1 = y0 + kLatticeY;
  const auto fade = [](double t) { return t * t * t * (t * (6 * t - 15) + 10); };
  const double u = fade(p.x - fx), v = fade(p.y - fy), w = fade(p.z - fz);
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  const auto layer = [&](std::uint64_t z) {
    const double a = mix(hashed_value(x0 ^ y0 ^ z), hashed_value(x1 ^ y0 ^ z), u);
    const double b = mix(hashed_value(x0 ^ y1 ^ z), hashed_value(x1 ^ y1 ^ z), u);
    return mix(a, b, v);
  };
  const std::uint64_t z0 = factor(fz, kLatticeZ);
  return mix(layer(z0), layer(z0 + kLatticeZ), w);
}

/// Sum of octaves, about [-1, 1].
inline double fractal_noise(Vec3 p, int octaves) {
  double sum = 0, amplitude = 0.5;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * noise(p);
    p = 2.03 * p + Vec3{17.3, -9.1, 5.7};
    amplitude *= 0.5;
  }
  return sum;
}

inline double smooth_step(double low, double high, double x) {
  const double t = std::fmin(1, std::fmax(0, (x - low) / (high - low)));
  return t * t * (3 - 2 * t);
}

}  // namespace kerf
