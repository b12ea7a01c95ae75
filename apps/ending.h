#pragma once

namespace porthos::apps {

/// Ends the program by one sentence, without asking for memory. It is also the end of an exception
/// that a destructor lets out, which happens where memory is missing (nlohmann::json).
[[noreturn]] void no_memory();

/// As std::terminate, but for missing memory.
[[noreturn]] void terminated();

}  // namespace porthos::apps
