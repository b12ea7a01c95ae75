#pragma once
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "phs/error.h"

namespace porthos::test {

/// One line of a table: what was measured, and the bound it must keep or, as a control, break.
inline void keeps(const std::string& what, double measured, double bound) {
  std::printf("  %-58s %.1e   bound %.1e\n", what.c_str(), measured, bound);
  EXPECT_LE(measured, bound) << what;
}
inline void breaks(const std::string& what, double measured, double bound) {
  std::printf("  %-58s %.1e   control, must exceed %.1e\n", what.c_str(), measured, bound);
  EXPECT_GT(measured, bound) << what << ": this control must fail";
}

/// The sentence a call refuses its arguments with, or the machine refuses it; empty if neither.
template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const InvalidArgument& error) {
    return error.what();
  } catch (const IoError& error) {
    return error.what();
  }
  return "";
}

}  // namespace porthos::test
