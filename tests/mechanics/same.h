#pragma once
#include <gtest/gtest.h>

#include <string>

#include "mechanics/spatial.h"

namespace porthos::mechanics {

/// To the last bit.
inline void expect_same(const Vec3d& a, const Vec3d& b, const std::string& what = "") {
  EXPECT_TRUE(a.x == b.x && a.y == b.y && a.z == b.z)
      << what << ": (" << a.x << ", " << a.y << ", " << a.z << "), expected (" << b.x << ", " << b.y
      << ", " << b.z << ")";
}
inline void expect_same(const Mat3<double>& a, const Mat3<double>& b,
                        const std::string& what = "") {
  expect_same(a.x, b.x, what + " x");
  expect_same(a.y, b.y, what + " y");
  expect_same(a.z, b.z, what + " z");
}

}  // namespace porthos::mechanics
