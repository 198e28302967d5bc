#include "kerf/base/rotation.h"

namespace kerf {

Mat3 followed_rotation(const Mat3& deformation, const Mat3& start, int iterations) {
  double f[3][3], r[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      f[i][j] = deformation.c[j][i];
      r[i][j] = start.c[j][i];
    }
  for (int k = 0; k < iterations; ++k) improve_rotation(f, r);
  orthonormalise(r);
  Mat3 out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.c[j][i] = r[i][j];
  return out;
}

}  // namespace kerf
