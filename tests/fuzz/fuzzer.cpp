// The entry points of libFuzzer, for the program porthos_fuzz. The variable PORTHOS_FUZZ names the
// reader; PORTHOS_FUZZ_SEEDS, if it is set, a folder for the inputs to begin with.
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/readers.h"
#include "tests/run/scenes.h"

namespace {
const porthos::test::fuzz::Reader* chosen = nullptr;
}  // namespace

/// Called once, before the corpus is read. argc, argv: of the program, not used.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  namespace fs = std::filesystem;
  const char* name = std::getenv("PORTHOS_FUZZ");
  try {
    chosen = &porthos::test::fuzz::reader(name ? name : "");
  } catch (const porthos::InvalidArgument& e) {
    std::fprintf(stderr, "PORTHOS_FUZZ: %s\n", e.what());
    std::exit(2);
  }
  if (const char* folder = std::getenv("PORTHOS_FUZZ_SEEDS")) {
    int k = 0;
    for (const std::string& bytes : chosen->seeds())
      porthos::test::write_bytes(fs::path(folder) / ("seed_" + std::to_string(k++)), bytes);
  }
  return 0;
}

/// One input. data, size: its bytes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  porthos::test::fuzz::attempt(*chosen, std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
