#pragma once
#include <cstdio>
#include <string>

#include "phs/error.h"

namespace porthos::apps {

/// @throws IoError if standard output cannot be written
inline void print(const std::string& text) {
  // A text longer than the buffer fails in fputs, a short one in fflush.
  if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw IoError("standard output cannot be written");
}

}  // namespace porthos::apps
