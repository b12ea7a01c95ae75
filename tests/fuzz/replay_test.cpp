// Inputs that a reader once failed on, its seeds, and damaged seeds: read, or refused
// by a sentence. ./dev fuzz looks for more of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "scene/run/checkpoint.h"
#include "tests/fuzz/base.h"
#include "tests/fuzz/readers.h"
#include "tests/places.h"

namespace porthos::test::fuzz {
namespace {

std::string text_of(const std::exception& e) { return std::string(typeid(e).name()) + e.what(); }

/// Whether a reader gets through an input; fails the test if it throws what it may not.
bool reads(const Reader& r, const std::string& bytes, const std::string& what) {
  try {
    return !attempt(r, bytes);
  } catch (const std::exception& e) {
    ADD_FAILURE() << r.name << ", " << what << ": " << text_of(e);
    return false;
  }
}

/// A seed with some bytes turned over, a piece cut out or doubled, or its end cut off.
std::string damaged(std::string bytes, std::mt19937_64& random) {
  if (bytes.empty()) return bytes;
  const auto below = [&](size_t n) { return size_t(random() % std::max<size_t>(1, n)); };
  const size_t at = below(bytes.size()), length = below(std::min<size_t>(64, bytes.size() - at));
  switch (random() % 5) {
    case 0:
      bytes.resize(at);
      break;
    case 1:
      bytes.erase(at, length);
      break;
    case 2:
      bytes.insert(below(bytes.size()), bytes.substr(at, length));
      break;
    default:
      for (size_t n = 1 + below(6); n > 0; --n) bytes[below(bytes.size())] = char(random());
  }
  return bytes;
}

class Replay : public ::testing::TestWithParam<std::string> {};

TEST_P(Replay, OfCorpusAndDamagedSeeds) {
  const Reader& r = reader(GetParam());
  int kept = 0, tried = 0, refused = 0;
  const fs::path corpus = fs::path(PORTHOS_SOURCE_DIR) / "tests/fuzz/corpus" / r.name;
  if (fs::is_directory(corpus))
    for (const auto& entry : fs::directory_iterator(corpus)) {
      reads(r, read_bytes(entry.path()), entry.path().filename().string());
      ++kept;
    }
  const auto seeds = r.seeds();
  for (const std::string& seed : seeds) EXPECT_FALSE(seed.empty());
  EXPECT_TRUE(r.name == "trajectory_h5" || reads(r, seeds[0], "the first seed"));
  std::mt19937_64 random(7);
  const int most = (r.name == "urdf" ? 20000 : 150) * (std::getenv("PORTHOS_LONG") ? 50 : 1);
  for (; tried < most; ++tried)
    refused += !reads(r, damaged(seeds[size_t(tried) % seeds.size()], random),
                      "damaged seed " + std::to_string(tried));
  std::printf("  %-15s %d kept inputs, %d damaged seeds, %d refused\n", r.name.c_str(), kept, tried,
              refused);
  EXPECT_GT(refused, 0);
}

std::vector<std::string> names() {
  std::vector<std::string> list;
  for (const Reader& r : readers()) list.push_back(r.name);
  return list;
}
INSTANTIATE_TEST_SUITE_P(Readers, Replay, ::testing::ValuesIn(names()),
                         [](const auto& i) { return i.param; });

// What was undefined behaviour, of which nothing shows without a sanitizer, is refused now.
TEST(Kept, NumbersOutOfReachAreRefused) {
  const fs::path corpus = fs::path(PORTHOS_SOURCE_DIR) / "tests/fuzz/corpus";
  EXPECT_TRUE(
      attempt(reader("trajectory_csv"), read_bytes(corpus / "trajectory_csv/angle_of_1e40")));
  // Counts of a checkpoint, with a checksum that fits.
  base().restore_stopped();
  const fs::path folder = base().stopped() / "checkpoint";
  const scene::Checkpoint good = scene::read_checkpoint(folder);
  for (const std::int64_t n : {std::int64_t(-1), std::int64_t(1) << 54}) {
    scene::Checkpoint a = good, b = good, c = good;
    a.cost.evaluations = n;
    b.state.step = n;
    c.log.records = n;
    for (const scene::Checkpoint& bad : {a, b, c}) {
      scene::write_checkpoint(folder, bad);
      EXPECT_TRUE(says(refusal([&] { scene::read_checkpoint(folder); }), "for a count, expected"));
    }
  }
  scene::write_checkpoint(folder, good);
  EXPECT_EQ(refusal([&] { scene::read_checkpoint(folder); }), "");
}

// Control: a reader that lets an exception of the library out is found.
TEST(Attempt, LetsOtherExceptionsOut) {
  const Reader bad{"bad", [](const std::string& s) { (void)s.at(100); }, nullptr};
  EXPECT_THROW(attempt(bad, "short"), std::out_of_range);
  const Reader refuses{"refuses", [](const std::string&) { throw InvalidArgument("no"); }, nullptr};
  EXPECT_TRUE(attempt(refuses, ""));
}

}  // namespace
}  // namespace porthos::test::fuzz
