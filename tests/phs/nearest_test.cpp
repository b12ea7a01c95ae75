// The name that an unknown one is answered with.
#include "phs/nearest.h"

#include <gtest/gtest.h>

namespace porthos::test::nearest_test {
namespace {

TEST(Nearest, WordsOfANameCountWhereNoEditsDo) {
  const Names keys{"limit", "momentum_limit", "stiffness"};
  EXPECT_EQ(nearest("torque_limit", keys), "limit");
  EXPECT_EQ(nearest("momentum_limits", keys), "momentum_limit") << "edits";
  EXPECT_EQ(nearest("limt", keys), "limit") << "edits";
  EXPECT_EQ(nearest("torquelimits", {"limit", "torque"}), "torque") << "control: no words";
  EXPECT_EQ(near_enough("torque_limit", keys), "") << "control: not meant";
  EXPECT_EQ(nearest("my_momentum_limit_x", keys), "momentum_limit") << "the longest";
}

}  // namespace
}  // namespace porthos::test::nearest_test
