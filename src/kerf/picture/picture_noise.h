// Smooth pseudo-random functions of space, for solid textures. The same everywhere, no tables.
#pragma once

#include <cmath>
#include <cstdint>

#include "kerf/base/vec.h"

namespace kerf {

inline double lattice_value(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ull ^
                    static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4full ^
                    static_cast<std::uint64_t>(z) * 0x165667b19e3779f9ull;
  h ^= h >> 29;
  h *= 0xbf58476d1ce4e5b9ull;
  h ^= h >> 32;
  return static_cast<double>(h >> 11) * 0x1p-52 - 1;
}

/// Value noise in about [-1, 1], features of size 1.
inline double noise(Vec3 p) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto x = static_cast<std::int64_t>(fx), y = static_cast<std::int64_t>(fy), z = static_cast<std::int64_t>(fz);
  const auto fade = [](double t) { return t * t * t * (t * (6 * t - 15) + 10); };
  const double u = fade(p.x - fx), v = fade(p.y - fy), w = fade(p.z - fz);
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  double layer[2];
  for (int k = 0; k < 2; ++k) {
    const double a = mix(lattice_value(x, y, z + k), lattice_value(x + 1, y, z + k), u);
    const double b = mix(lattice_value(x, y + 1, z + k), lattice_value(x + 1, y + 1, z + k), u);
    layer[k] = mix(a, b, v);
  }
  return mix(layer[0], layer[1], w);
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
